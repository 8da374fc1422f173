/** What cameras of the robot see: tags and things in messages of `vision_msgs`, and where these are in a picture. */
import { applied, frameOf, readTransform, type Markers, type Point, type Transform, type Vector } from "./map";
import { isMessage, type Json, type Message } from "./rosbridge";

/** A tag or a thing in the frame of a camera; its size is along its own axes [m]. */
export interface SeenThing {
  name: string;
  pose: Transform;
  size: Vector;
}

/** A box in a picture [px]. */
export interface SeenBox {
  name: string;
  left: number;
  top: number;
  width: number;
  height: number;
}

/** A pinhole camera: its picture in pixels, focal lengths and axis. */
export interface PinholeCamera {
  frame: string;
  width: number;
  height: number;
  fx: number;
  fy: number;
  cx: number;
  cy: number;
}

const NEAREST = 0.01; // [m] before the camera, at which something is in its picture
const FLAT = 0.005; // [m] up to which a thing is a tag
const COLOUR = "rgb(20 110 190 / 0.9)";

/** Returns what is in a `Detection3DArray`; what has no place is left out. */
export function readThings({ detections }: Message): SeenThing[] {
  return listed(detections).flatMap((one) => {
    const box = isMessage(one.bbox) ? one.bbox : {};
    const [pose, size] = [readTransform(box.center), isMessage(box.size) ? box.size : {}];
    const [x, y, z] = [Number(size.x), Number(size.y), Number(size.z)];
    if (!pose || scoreOf(one) <= 0 || ![x, y, z].every(Number.isFinite)) return [];
    return [{ name: nameOf(one), pose, size: { x, y, z } }];
  });
}

/** Returns what is in a `Detection2DArray`. */
export function readBoxes({ detections }: Message): SeenBox[] {
  return listed(detections).flatMap((one) => {
    const box = isMessage(one.bbox) ? one.bbox : {};
    const centre = isMessage(box.center) && isMessage(box.center.position) ? box.center.position : {};
    const [x, y, width, height] = [Number(centre.x), Number(centre.y), Number(box.size_x), Number(box.size_y)];
    if (![x, y, width, height].every(Number.isFinite)) return [];
    return [{ name: nameOf(one), left: x - width / 2, top: y - height / 2, width, height }];
  });
}

/** Returns the camera of a `CameraInfo`, or null if it is not calibrated. */
export function readCamera(info: Message): PinholeCamera | null {
  const k = Array.isArray(info.k) ? info.k.map(Number) : [];
  const [fx, , cx, , fy, cy] = k as number[];
  const camera = { frame: frameOf(info), width: Number(info.width), height: Number(info.height), fx, fy, cx, cy };
  const isKnown = Object.values(camera).every((value) => typeof value === "string" || Number.isFinite(value));
  return isKnown && camera.fx! > 0 && camera.width > 0 ? (camera as PinholeCamera) : null;
}

/** Returns the corners of a tag, or of the face of a thing that is nearest along z, in its frame. */
function corners({ size: { x, y, z } }: SeenThing): Vector[] {
  const front = z <= FLAT ? 0 : z / 2;
  return [
    [-1, 1],
    [1, 1],
    [1, -1],
    [-1, -1],
  ].map(([right, up]) => ({ x: (right! * x) / 2, y: (up! * y) / 2, z: front }));
}

/** Returns the outline of a thing in a picture [px], without the distortion of the lens; null if it is not before it. */
export function outlineIn(camera: PinholeCamera, thing: SeenThing): Point[] | null {
  const places = corners(thing).map((corner) => applied(thing.pose, corner));
  if (places.some(({ z }) => !(z > NEAREST))) return null;
  return places.map(({ x, y, z }) => ({ x: camera.cx + (camera.fx * x) / z, y: camera.cy + (camera.fy * y) / z }));
}

/** Returns things as a map draws them: their outlines from above, and names. */
export function thingMarkers(message: Message): Markers {
  const things = readThings(message);
  return {
    frame: frameOf(message),
    areas: things.map((thing) => ({ corners: corners(thing).map((corner) => applied(thing.pose, corner)), colour: COLOUR })),
    labels: things.map(({ name, pose }) => ({ at: pose.translation, text: name })),
  };
}

function listed(detections: Json | undefined): Message[] {
  return Array.isArray(detections) ? detections.filter(isMessage) : [];
}

function resultOf(one: Message): Message {
  const first = Array.isArray(one.results) ? one.results[0] : undefined;
  return isMessage(first) && isMessage(first.hypothesis) ? first.hypothesis : {};
}

function scoreOf(one: Message): number {
  const { score } = resultOf(one);
  return typeof score === "number" ? score : 1;
}

function nameOf(one: Message): string {
  const { class_id: kind } = resultOf(one);
  return String(one.id || kind || "?").replaceAll("_", " ");
}
