/** The world of a simulated robot: what stands and moves in it at which time, and its walls as a mesh. */
import type { Component } from "./description";
import { readGrid, secondsOf, type Grid, type Point } from "./map";
import { isMessage, type Json, type Message } from "./rosbridge";

const WORLD = "rbxcompose_msgs/msg/World";
const ROBOTS = "rbxcompose_msgs/msg/WorldRobots";
const SOLID = 65; // percent from which a cell is a wall

/** A convex part of a mesh: three numbers for each corner [m], and three corners for each triangle. */
export interface Hull {
  corners: number[];
  triangles: number[];
}

/**
 * A box, an upright cylinder or a mesh; `size` is [m] along x, y and z, or radius and height, or empty; `z` is that of its
 * base.
 */
export interface WorldShape extends Point {
  name: string;
  kind: "box" | "cylinder" | "mesh";
  size: number[];
  hulls: Hull[];
  z: number;
  heading: number;
  colour: string;
  /** Where it is at which time [s]; empty if it stands. */
  path: (Point & { time: number })[];
  repeats: boolean;
}

/** A lamp; its strength is from 0 to 1. */
export interface WorldLight extends Point {
  z: number;
  colour: string;
  strength: number;
}

export interface World {
  walls: Grid | null;
  shapes: WorldShape[];
  /** Others that share it, where they start. */
  robots: WorldShape[];
  lights: WorldLight[];
  /** Corners of each part of the ground that is not there. */
  holes: Point[][];
  /** Robot time at stamp 0 [s]. */
  epoch: number;
}

/** Returns the topic of the world; empty if the robot is in none, as real ones are. */
export function worldTopicOf(components: readonly Component[]): string {
  const ports = components.flatMap((component) => component.ports);
  return ports.find(({ kind, type }) => kind === "out" && type === WORLD)?.topic ?? "";
}

/** Returns the topic with the poses of what the robot has pushed; empty if nothing can be pushed. */
export function movedTopicOf(components: readonly Component[]): string {
  const ports = components.flatMap((component) => component.ports);
  return ports.find(({ kind, topic }) => kind === "out" && topic.endsWith("world/moved"))?.topic ?? "";
}

/** Returns the topic that tells where other robots are in the same world; empty if nothing listens to it. */
export function robotsTopicOf(components: readonly Component[]): string {
  const ports = components.flatMap((component) => component.ports);
  return ports.find(({ kind, type, topic }) => kind === "in" && type === ROBOTS && topic.endsWith("/others"))?.topic ?? "";
}

/** Returns where robots are, by name, of `rbxcompose_msgs/WorldRobots`. */
export function readRobots({ names, xs, ys }: Message): Map<string, Point> {
  const [rights, ups] = [numbersOf(xs), numbersOf(ys)];
  return new Map((Array.isArray(names) ? names : []).map((name, turn) => [String(name), { x: rights[turn]!, y: ups[turn]! }]));
}

/** Returns the world of `rbxcompose_msgs/World`. */
export function readWorld({ map, shapes, lights, holes, robots, time }: Message): World {
  const header = isMessage(map) ? map.header : null;
  return {
    walls: isMessage(map) ? readGrid(map) : null,
    shapes: messagesIn(shapes).map(readShape),
    robots: messagesIn(robots).map(readShape),
    lights: messagesIn(lights).map(({ x, y, z, colour, strength }) => ({
      x: Number(x),
      y: Number(y),
      z: Number(z),
      colour: String(colour ?? ""),
      strength: Number(strength),
    })),
    holes: messagesIn(holes).map(({ xs, ys }) => numbersOf(xs).map((x, at) => ({ x, y: numbersOf(ys)[at]! }))),
    epoch: Number(time) - (isMessage(header) ? secondsOf(header.stamp) : 0),
  };
}

function messagesIn(values: Json | undefined): Message[] {
  return Array.isArray(values) ? values.filter(isMessage) : [];
}

function readShape({ name, kind, size, hulls, x, y, z, heading, times, xs, ys, repeats, colour }: Message): WorldShape {
  const [ats, rights, ups] = [times, xs, ys].map(numbersOf) as [number[], number[], number[]];
  return {
    name: String(name),
    kind: kind === "box" || kind === "mesh" ? kind : "cylinder",
    size: numbersOf(size),
    hulls: messagesIn(hulls).map(({ corners, triangles }) => ({ corners: numbersOf(corners), triangles: numbersOf(triangles) })),
    x: Number(x),
    y: Number(y),
    z: Number(z),
    heading: Number(heading),
    colour: String(colour ?? ""),
    path: ats.map((time, turn) => ({ time, x: rights[turn]!, y: ups[turn]! })),
    repeats: repeats === true,
  };
}

function numbersOf(values: Json | undefined): number[] {
  return Array.isArray(values) ? values.map(Number) : [];
}

/**
 * Returns where a shape is at a robot time [s]: on straight lines between the points of its path. Before the first and
 * after the last one it stands there; if the path repeats, the last one is the first one again.
 */
export function placeAt({ x, y, path, repeats }: WorldShape, time: number): Point {
  const [first, last] = [path[0], path.at(-1)];
  if (!first || !last) return { x, y };
  const period = last.time - first.time;
  const now = repeats && period > 0 && time > last.time ? first.time + ((time - first.time) % period) : time;
  const after = path.findIndex((point) => point.time > now);
  if (after <= 0) return after < 0 ? last : first;
  const [from, to] = [path[after - 1]!, path[after]!];
  const share = (now - from.time) / (to.time - from.time);
  return { x: from.x + (to.x - from.x) * share, y: from.y + (to.y - from.y) * share };
}

/** Returns how high a shape is [m]. */
export function heightOf({ kind, size, hulls }: WorldShape): number {
  if (kind !== "mesh") return size.at(-1) ?? 0;
  return Math.max(0, ...hulls.flatMap(({ corners }) => corners.filter((_, at) => at % 3 === 2)));
}

/** Corners of a box, of a cylinder as a polygon, or of what is around a mesh, from above at a robot time [s]. */
export function outlineOf(shape: WorldShape, time: number): Point[] {
  const at = placeAt(shape, time);
  const [a = 0, b = 0] = shape.size;
  const corners: [number, number][] =
    shape.kind === "mesh"
      ? around(shape.hulls.flatMap(({ corners: all }) => all.flatMap((x, turn) => (turn % 3 === 0 ? [[x, all[turn + 1]!] as [number, number]] : []))))
      : shape.kind === "box"
      ? [[a / 2, b / 2], [-a / 2, b / 2], [-a / 2, -b / 2], [a / 2, -b / 2]]
      : Array.from({ length: 24 }, (_, turn) => [a * Math.cos((turn * Math.PI) / 12), a * Math.sin((turn * Math.PI) / 12)]);
  const [cos, sin] = [Math.cos(shape.heading), Math.sin(shape.heading)];
  return corners.map(([x, y]) => ({ x: at.x + cos * x - sin * y, y: at.y + sin * x + cos * y }));
}

/** Returns the corners of the smallest convex polygon around points (A. M. Andrew, 1979). */
function around(points: [number, number][]): [number, number][] {
  const ordered = [...points].sort(([a, b], [c, d]) => a - c || b - d);
  const half = (way: [number, number][]) => {
    const found: [number, number][] = [];
    for (const point of way) {
      while (found.length > 1 && isRight(found.at(-2)!, found.at(-1)!, point)) found.pop();
      found.push(point);
    }
    return found.slice(0, -1);
  };
  return [...half(ordered), ...half(ordered.reverse())];
}

function isRight([ax, ay]: [number, number], [bx, by]: [number, number], [cx, cy]: [number, number]): boolean {
  return (bx - ax) * (cy - by) - (by - ay) * (cx - bx) <= 0;
}

/** Faces of rectangles, four vertices each: three numbers for each vertex [m], and for its normal. */
export interface Mesh {
  positions: Float32Array;
  normals: Float32Array;
  indices: Uint32Array;
}

/**
 * Returns the walls of a grid, in its own frame: sides where a wall ends, in as few pieces as lines have, and a top.
 * There are no faces within walls, so that they can be seen through.
 */
export function wallMesh({ width, height, resolution, data }: Grid, tall: number): Mesh {
  const isSolid = (column: number, row: number) =>
    column >= 0 && row >= 0 && column < width && row < height && Number(data[row * width + column]) >= SOLID;
  const positions: number[] = [];
  const normals: number[] = [];
  /** Adds a face from a corner along two edges, in cells and `tall`; the normal is their cross product. */
  const add = (corner: Triple, one: Triple, other: Triple) => {
    const [a, b, c] = [0, 1, 2].map((turn) => {
      const [left, right] = [(turn + 1) % 3, (turn + 2) % 3];
      return Math.sign(one[left]! * other[right]! - one[right]! * other[left]!);
    });
    for (const [first, second] of [[0, 0], [1, 0], [1, 1], [0, 1]] as const) {
      const [x, y, z] = corner.map((at, turn) => at + first * one[turn]! + second * other[turn]!);
      positions.push(x! * resolution, y! * resolution, z! * tall);
      normals.push(a!, b!, c!);
    }
  };
  for (let row = 0; row <= height; row += 1) {
    for (const [inside, outside] of [[row, row - 1], [row - 1, row]] as const) {
      const south = outside < inside;
      for (const [from, to] of runs(width, (column) => isSolid(column, inside) && !isSolid(column, outside))) {
        add(south ? [from, row, 0] : [to, row, 0], [south ? to - from : from - to, 0, 0], [0, 0, 1]);
      }
    }
  }
  for (let column = 0; column <= width; column += 1) {
    for (const [inside, outside] of [[column, column - 1], [column - 1, column]] as const) {
      const west = outside < inside;
      for (const [from, to] of runs(height, (row) => isSolid(inside, row) && !isSolid(outside, row))) {
        add(west ? [column, to, 0] : [column, from, 0], [0, west ? from - to : to - from, 0], [0, 0, 1]);
      }
    }
  }
  for (const { x, y, columns, rows } of rectangles(width, height, isSolid)) add([x, y, 1], [columns, 0, 0], [0, rows, 0]);
  const faces = positions.length / 12;
  const indices = Uint32Array.from({ length: 6 * faces }, (_, at) => 4 * Math.floor(at / 6) + [0, 1, 2, 0, 2, 3][at % 6]!);
  return { positions: new Float32Array(positions), normals: new Float32Array(normals), indices };
}

type Triple = readonly [number, number, number];

/** Yields the longest stretches, from one number to before another, on which something holds. */
function* runs(length: number, holds: (at: number) => boolean): Generator<[from: number, to: number]> {
  let from = -1;
  for (let at = 0; at <= length; at += 1) {
    const is = at < length && holds(at);
    if (is && from < 0) from = at;
    if (!is && from >= 0) {
      yield [from, at];
      from = -1;
    }
  }
}

/** Yields rectangles that cover all solid cells once: runs of a row, as long as rows below have the same one. */
function* rectangles(width: number, height: number, isSolid: (column: number, row: number) => boolean) {
  let open = new Map<string, { x: number; y: number; columns: number; rows: number }>();
  for (let row = 0; row <= height; row += 1) {
    const next: typeof open = new Map();
    for (const [from, to] of row < height ? runs(width, (column) => isSolid(column, row)) : []) {
      const key = `${from}:${to}`;
      const above = open.get(key) ?? { x: from, y: row, columns: to - from, rows: 0 };
      above.rows += 1;
      next.set(key, above);
      open.delete(key);
    }
    yield* open.values();
    open = next;
  }
}
