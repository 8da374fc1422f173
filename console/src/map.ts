/** The geometry of a map: frames and the transforms between them, the view of a canvas, grids as pictures. */
import { isMessage, type Json, type Message } from "./rosbridge";

export interface Point {
  x: number;
  y: number;
}

/** A pose in the plane [m, m, rad]. */
export interface Pose extends Point {
  heading: number;
}

export interface Vector extends Point {
  z: number;
}

export interface Quaternion extends Vector {
  w: number;
}

/** Takes a point from a child's frame to its parent's: it is turned, then moved. */
export interface Transform {
  translation: Vector;
  rotation: Quaternion;
}

export const IDENTITY: Transform = { translation: { x: 0, y: 0, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } };

// Rotations

/** Returns the heading of a rotation: the direction of its x axis, seen from above [rad]. */
export function yawOf({ x, y, z, w }: Quaternion): number {
  return Math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
}

export function quaternionOf(heading: number): Quaternion {
  return { x: 0, y: 0, z: Math.sin(heading / 2), w: Math.cos(heading / 2) };
}

function multiplied(a: Quaternion, b: Quaternion): Quaternion {
  return {
    x: a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
    y: a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
    z: a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
    w: a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
  };
}

function conjugated({ x, y, z, w }: Quaternion): Quaternion {
  return { x: -x, y: -y, z: -z, w };
}

function turned(by: Quaternion, { x, y, z }: Vector): Vector {
  const { x: rx, y: ry, z: rz } = multiplied(multiplied(by, { x, y, z, w: 0 }), conjugated(by));
  return { x: rx, y: ry, z: rz };
}

// Transforms

export function applied({ translation, rotation }: Transform, point: Vector): Vector {
  const { x, y, z } = turned(rotation, point);
  return { x: x + translation.x, y: y + translation.y, z: z + translation.z };
}

/** Returns the transform that does `inner`, then `outer`. */
export function composed(outer: Transform, inner: Transform): Transform {
  return {
    translation: applied(outer, inner.translation),
    rotation: multiplied(outer.rotation, inner.rotation),
  };
}

export function inverted({ translation, rotation }: Transform): Transform {
  const back = conjugated(rotation);
  const { x, y, z } = turned(back, translation);
  return { translation: { x: -x, y: -y, z: -z }, rotation: back };
}

/** Returns where the origin of a frame is, seen from above. */
export function poseOf({ translation: { x, y }, rotation }: Transform): Pose {
  return { x, y, heading: yawOf(rotation) };
}

/** Frames, each with its place in its parent. */
export class Frames {
  readonly #parents = new Map<string, { parent: string; transform: Transform }>();

  set(parent: string, child: string, transform: Transform): void {
    this.#parents.set(plain(child), { parent: plain(parent), transform });
  }

  has(child: string): boolean {
    return this.#parents.has(plain(child));
  }

  /** Returns the frame and those above it, with the transform that leads from the frame to each; a loop ends. */
  above(frame: string): Map<string, Transform> {
    let at = plain(frame);
    let transform = IDENTITY;
    const found = new Map([[at, transform]]);
    for (let step = this.#parents.get(at); step && !found.has(step.parent); step = this.#parents.get(at)) {
      transform = composed(step.transform, transform);
      at = step.parent;
      found.set(at, transform);
    }
    return found;
  }

  /** Returns the transform of points from one frame to another, or null if nothing connects them. */
  lookUp(target: string, source: string): Transform | null {
    const targets = this.above(target);
    for (const [frame, up] of this.above(source)) {
      const down = targets.get(frame);
      if (down) return composed(inverted(down), up);
    }
    return null;
  }

  /** Returns the frame in which a map shows the base: `map` if transforms lead to it, else `odom`, else the topmost. */
  fixedFor(base: string): string {
    const above = [...this.above(base).keys()];
    return ["map", "odom"].find((frame) => above.includes(frame)) ?? above.at(-1)!;
  }
}

/** Returns the name of a frame without the slash that old programs put before it. */
export function plain(frame: string): string {
  return frame.replace(/^\//, "");
}

// Messages

/** Returns the place that a `Transform` or a `Pose` says, or null if a number is missing. */
export function readTransform(message: Json | undefined): Transform | null {
  if (!isMessage(message)) return null;
  const translation = readNumbers(message.translation ?? message.position, ["x", "y", "z"]);
  const rotation = readNumbers(message.rotation ?? message.orientation, ["x", "y", "z", "w"]);
  if (!translation || !rotation) return null;
  const length = Math.hypot(rotation.x, rotation.y, rotation.z, rotation.w);
  if (length === 0) return { translation, rotation: IDENTITY.rotation };
  const { x, y, z, w } = rotation;
  return { translation, rotation: { x: x / length, y: y / length, z: z / length, w: w / length } };
}

function readNumbers<K extends string>(message: Json | undefined, names: readonly K[]): Record<K, number> | null {
  if (!isMessage(message)) return null;
  const numbers = names.map((name) => [name, message[name]] as const);
  return numbers.every(([, number]) => typeof number === "number")
    ? (Object.fromEntries(numbers) as Record<K, number>)
    : null;
}

/** A transform that somebody has published, and when [s]. */
export interface Stamped {
  parent: string;
  child: string;
  transform: Transform;
  stamp: number;
}

/** Returns the transforms of a `tf2_msgs/TFMessage`; those that miss a number are left out. */
export function readTransforms({ transforms }: Message): Stamped[] {
  return (Array.isArray(transforms) ? transforms.filter(isMessage) : []).flatMap((stamped) => {
    const transform = readTransform(stamped.transform);
    const stamp = isMessage(stamped.header) ? secondsOf(stamped.header.stamp) : 0;
    return transform ? [{ parent: frameOf(stamped), child: plain(String(stamped.child_frame_id)), transform, stamp }] : [];
  });
}

/** Returns a `builtin_interfaces/Time` in seconds. */
export function secondsOf(stamp: Json | undefined): number {
  return isMessage(stamp) ? Number(stamp.sec) + Number(stamp.nanosec) / 1e9 : 0;
}

export function frameOf(message: Message): string {
  return isMessage(message.header) && typeof message.header.frame_id === "string" ? plain(message.header.frame_id) : "";
}

/** Returns a `geometry_msgs/Pose`. */
export function poseMessage({ x, y, heading }: Pose): Message {
  return { position: { x, y, z: 0 }, orientation: { ...quaternionOf(heading) } };
}

/** Returns where a `sensor_msgs/LaserScan` was reflected, in its own frame; what is out of range is left out. */
export function readScan(scan: Message): Vector[] {
  const [start, step] = [Number(scan.angle_min), Number(scan.angle_increment)];
  const [least, most] = [Number(scan.range_min ?? 0), Number(scan.range_max ?? Infinity)];
  const ranges = Array.isArray(scan.ranges) ? scan.ranges : [];
  return ranges.flatMap((range, turn) => {
    if (typeof range !== "number" || range < least || range > most) return [];
    const angle = start + turn * step;
    return [{ x: range * Math.cos(angle), y: range * Math.sin(angle), z: 0 }];
  });
}

/** Returns the points of a `nav_msgs/Path`, in its frame. */
export function readPath(path: Message): Vector[] {
  return (Array.isArray(path.poses) ? path.poses : []).flatMap((stamped) => {
    const at = isMessage(stamped) ? readTransform(stamped.pose) : null;
    return at ? [at.translation] : [];
  });
}

/** A part of the map with a line around it, `colour` as a style sheet has it. */
export interface Area {
  corners: Vector[];
  colour: string;
}

/** What is drawn of a `visualization_msgs/MarkerArray`: closed lines, and texts. */
export interface Markers {
  frame: string;
  areas: Area[];
  labels: { at: Vector; text: string }[];
}

const [LINE_STRIP, TEXT] = [4, 9]; // types of markers

/** Returns the markers that are in the frame of the first one. */
export function readMarkers(message: Message): Markers {
  const all = Array.isArray(message.markers) ? message.markers.filter(isMessage) : [];
  const frame = all[0] ? frameOf(all[0]) : "";
  const drawn: Markers = { frame, areas: [], labels: [] };
  for (const marker of all) {
    const place = readTransform(marker.pose);
    if (!place || frameOf(marker) !== frame || marker.action !== 0) continue;
    if (marker.type === TEXT) drawn.labels.push({ at: place.translation, text: String(marker.text) });
    if (marker.type !== LINE_STRIP || !Array.isArray(marker.points)) continue;
    const corners = marker.points.flatMap((point) => {
      const read = readNumbers(point, ["x", "y", "z"]);
      return read ? [applied(place, read)] : [];
    });
    const [first, last] = [corners[0], corners.at(-1)];
    const isClosed = corners.length > 3 && first && last && distance(first, last) === 0;
    if (isClosed) drawn.areas.push({ corners: corners.slice(1), colour: readColour(marker.color) });
  }
  return drawn;
}

function readColour(colour: Json | undefined): string {
  const parts = readNumbers(colour, ["r", "g", "b", "a"]);
  if (!parts) return "";
  const { r, g, b, a } = parts;
  return `rgb(${[r, g, b].map((part) => Math.round(255 * part)).join(" ")} / ${a})`;
}

/** A `nav_msgs/OccupancyGrid`: cells of `resolution` [m] from its origin along x, then along y. */
export interface Grid {
  frame: string;
  width: number;
  height: number;
  resolution: number;
  origin: Transform;
  data: readonly Json[];
}

/** Returns a grid, or null if its message is none. */
export function readGrid(message: Message): Grid | null {
  const { info, data } = message;
  if (!isMessage(info) || !Array.isArray(data)) return null;
  const [width, height, resolution] = [Number(info.width), Number(info.height), Number(info.resolution)];
  const origin = readTransform(info.origin);
  if (!origin || !(resolution > 0) || !(width > 0) || data.length !== width * height) return null;
  return { frame: frameOf(message), width, height, resolution, origin, data };
}

/** Returns whether a point in the frame of a grid lies on it. */
export function isOn({ origin, width, height, resolution }: Grid, point: Vector): boolean {
  const { x, y } = applied(inverted(origin), point);
  return x >= 0 && y >= 0 && x < width * resolution && y < height * resolution;
}

/** Returns the pixels of a grid of costs, RGBA: the dearer a cell, the less is seen through it. */
export function costPixels({ width, height, data }: Grid, dear: Colour): Uint8ClampedArray<ArrayBuffer> {
  const pixels = new Uint8ClampedArray(4 * width * height);
  for (let row = 0; row < height; row += 1) {
    for (let column = 0; column < width; column += 1) {
      const value = Number(data[row * width + column]);
      if (value > 0 && value <= 100) pixels.set([...dear, value * 1.4], 4 * ((height - 1 - row) * width + column));
    }
  }
  return pixels;
}

export type Colour = readonly [red: number, green: number, blue: number];

/** Returns the pixels of a grid, RGBA, its last row first: y points up in a map, and down in a picture. */
export function gridPixels(grid: Grid, free: Colour, occupied: Colour): Uint8ClampedArray<ArrayBuffer> {
  const { width, height, data } = grid;
  const pixels = new Uint8ClampedArray(4 * width * height);
  for (let row = 0; row < height; row += 1) {
    for (let column = 0; column < width; column += 1) {
      const value = Number(data[row * width + column]);
      if (!(value >= 0 && value <= 100)) continue; // unknown: nothing is drawn
      const at = 4 * ((height - 1 - row) * width + column);
      for (let part = 0; part < 3; part += 1) {
        pixels[at + part] = free[part]! + ((occupied[part]! - free[part]!) * value) / 100;
      }
      pixels[at + 3] = 255;
    }
  }
  return pixels;
}

// The view

/** What a canvas shows: a point of the map at its centre, and how large a metre is [px]. */
export interface View extends Point {
  scale: number;
  width: number;
  height: number;
}

export const SMALLEST_SCALE = 0.2;
export const LARGEST_SCALE = 2_000;
const USUAL_SCALE = 200; // the most that a fit uses [px/m]
const MARGIN = 48; // [px] around what a fit shows

export function toScreen(view: View, { x, y }: Point): Point {
  return { x: view.width / 2 + (x - view.x) * view.scale, y: view.height / 2 - (y - view.y) * view.scale };
}

export function toWorld(view: View, { x, y }: Point): Point {
  return { x: view.x + (x - view.width / 2) / view.scale, y: view.y - (y - view.height / 2) / view.scale };
}

/** Returns the view after its content was dragged by a number of pixels. */
export function panned(view: View, right: number, down: number): View {
  return { ...view, x: view.x - right / view.scale, y: view.y + down / view.scale };
}

/** Returns the view in which a metre is larger by a factor, and what is at a pixel stays there. */
export function zoomed(view: View, factor: number, at: Point): View {
  const scale = clamp(view.scale * factor, Math.min(SMALLEST_SCALE, view.scale), LARGEST_SCALE); // a fit may have less
  const fixed = toWorld(view, at);
  const moved = toWorld({ ...view, scale }, at);
  return { ...view, scale, x: view.x + fixed.x - moved.x, y: view.y + fixed.y - moved.y };
}

/** Returns the view that shows all points, with a margin; without points, the surroundings of the origin. */
export function fitted(points: readonly Point[], width: number, height: number): View {
  const all = points.length > 0 ? points : [{ x: 0, y: 0 }];
  const [left, right] = extent(all.map(({ x }) => x));
  const [bottom, top] = extent(all.map(({ y }) => y));
  const room = (pixels: number, metres: number) => Math.max(1, pixels - 2 * MARGIN) / metres; // infinite for a point
  const scale = Math.min(room(width, right - left), room(height, top - bottom), USUAL_SCALE);
  return { x: (left + right) / 2, y: (bottom + top) / 2, scale, width, height };
}

function extent(numbers: readonly number[]): [number, number] {
  const [least, most] = [Infinity, -Infinity];
  return numbers.reduce(([low, high], number) => [Math.min(low, number), Math.max(high, number)], [least, most]);
}

function clamp(number: number, least: number, most: number): number {
  return Math.max(least, Math.min(most, number));
}

/** Returns the longest of 1, 2, 5, 10, ... [m] that is no longer than a number of pixels. */
export function niceLength(scale: number, longest: number): number {
  const most = longest / scale;
  const power = 10 ** Math.floor(Math.log10(most));
  return power * (most >= 5 * power ? 5 : most >= 2 * power ? 2 : 1);
}

/** Returns the distance between lines of the grid [m]: 1, unless they were too close. */
export function gridStep(scale: number): number {
  return 10 ** Math.max(0, Math.ceil(Math.log10(8 / scale)));
}

export function formatLength(metres: number): string {
  if (metres >= 1000) return `${metres / 1000}\u202fkm`;
  return metres >= 1 ? `${metres}\u202fm` : `${Number((metres * 100).toPrecision(3))}\u202fcm`;
}

export function distance(from: Point, to: Point): number {
  return Math.hypot(to.x - from.x, to.y - from.y);
}

const TAP = 10; // [px] that a finger moves without meaning it

/** Returns the pose that a drag from one pixel to another means; of a tap, with the heading `otherwise`. */
export function draggedPose(view: View, from: Point, to: Point, otherwise: number): Pose {
  const isTap = distance(from, to) < TAP;
  return { ...toWorld(view, from), heading: isTap ? otherwise : Math.atan2(from.y - to.y, to.x - from.x) };
}

// The trail

const TRAIL = 60_000; // [ms]
const APART = 0.02; // [m]

/** Where the robot has been in the last minute. */
export class Trail {
  #points: (Point & { at: number })[] = [];

  get points(): readonly Point[] {
    return this.#points;
  }

  add({ x, y }: Point, now: number): void {
    const last = this.#points.at(-1);
    if (!last || distance(last, { x, y }) >= APART) this.#points.push({ x, y, at: now });
    const first = this.#points.findIndex(({ at }) => at > now - TRAIL);
    if (first !== 0) this.#points = first < 0 ? [] : this.#points.slice(first);
  }

  clear(): void {
    this.#points = [];
  }
}
