import { describe, expect, it } from "vitest";
import type { Component } from "./description";
import { IDENTITY, type Grid } from "./map";
import { heightOf, outlineOf, placeAt, readRobots, readWorld, robotsTopicOf, wallMesh, worldTopicOf, type WorldShape } from "./world";

const VISITOR: WorldShape = {
  name: "visitor",
  kind: "cylinder",
  size: [0.25, 1.7],
  hulls: [],
  x: 0,
  y: 0,
  z: 0,
  heading: 0,
  colour: "",
  path: [{ time: 2, x: 0, y: 0 }, { time: 4, x: 4, y: 0 }, { time: 8, x: 0, y: 0 }],
  repeats: true,
};

function gridOf(rows: string[]): Grid {
  const data = rows.flatMap((row) => [...row].map((cell) => (cell === "#" ? 100 : 0)));
  return { frame: "map", width: rows[0]!.length, height: rows.length, resolution: 0.5, origin: IDENTITY, data };
}

/** Returns the area of all faces that look into a direction [m²]. */
function area(rows: string[], normal: [number, number, number]): number {
  const { positions, normals, indices } = wallMesh(gridOf(rows), 2);
  const at = (vertex: number) => [...positions.slice(3 * vertex, 3 * vertex + 3)] as [number, number, number];
  let sum = 0;
  for (let face = 0; face < indices.length; face += 3) {
    const [a, b, c] = [...indices.slice(face, face + 3)].map(at);
    const [one, other] = [b, c].map((point) => point!.map((value, turn) => value - a![turn]!));
    const cross = [0, 1, 2].map((turn) => one![(turn + 1) % 3]! * other![(turn + 2) % 3]! - one![(turn + 2) % 3]! * other![(turn + 1) % 3]!);
    const said = [...normals.slice(3 * indices[face]!, 3 * indices[face]! + 3)];
    const size = Math.hypot(...cross);
    cross.forEach((value, turn) => expect(value / size).toBeCloseTo(said[turn]!)); // faces look outwards
    if (said.every((value, turn) => value === normal[turn])) sum += size / 2;
  }
  return sum;
}

describe("the walls of a map", () => {
  const rows = ["####", "#..#", "##.#"];
  it("have a top as large as their cells, and sides where they end", () => {
    expect(area(rows, [0, 0, 1])).toBeCloseTo(9 * 0.25);
    expect(area(rows, [0, 0, -1])).toBe(0);
    // Below the four cells of the lowest row, and below one of the highest: each 0.5 m long and 2 m tall.
    expect(area(rows, [0, -1, 0])).toBeCloseTo(5 * 0.5 * 2);
    expect(area(rows, [0, 1, 0])).toBeCloseTo(area(rows, [0, -1, 0]));
    expect(area(rows, [1, 0, 0])).toBeCloseTo(area(rows, [-1, 0, 0]));
  });
  it("are a few faces where they are straight, however many cells they have", () => {
    const faces = (side: number) => wallMesh(gridOf(Array.from({ length: side }, () => "#".repeat(side))), 1).indices.length / 6;
    expect([faces(1), faces(50)]).toEqual([5, 5]);
    expect(wallMesh(gridOf(["..", ".."]), 1).indices).toHaveLength(0);
  });
  it("do not know what is unknown, and count from 65 percent", () => {
    const grid = { ...gridOf(["...."]), data: [-1, 64, 65, 100] };
    expect(wallMesh(grid, 1).indices).toHaveLength(5 * 6);
  });
});

describe("what moves in a world", () => {
  it.each([
    [-1, 0], [2, 0], [3, 2], [4, 4], [6, 2], [8, 0], [9, 2], [12, 2], [6_000_003, 2],
  ])("is at its place at %d s", (time, x) => {
    expect(placeAt(VISITOR, time).x).toBeCloseTo(x);
  });
  it("stays where its path ends, if that does not repeat, and stands without one", () => {
    const path = VISITOR.path.slice(0, 2);
    expect(placeAt({ ...VISITOR, path, repeats: false }, 100)).toMatchObject({ x: 4, y: 0 });
    expect(placeAt({ ...VISITOR, path: [], x: 7, y: 8 }, 100)).toEqual({ x: 7, y: 8 });
  });
  it("is around a mesh, and as high", () => {
    const corners = [0, 0, 0, 2, 0, 0, 2, 1, 0.5, 0, 1, 0, 1, 0.5, 0.7];
    const mesh: WorldShape = { ...VISITOR, kind: "mesh", size: [], hulls: [{ corners, triangles: [0, 1, 4] }], path: [], x: 1 };
    expect(outlineOf(mesh, 0)).toEqual([{ x: 1, y: 0 }, { x: 3, y: 0 }, { x: 3, y: 1 }, { x: 1, y: 1 }]);
    expect(heightOf(mesh)).toBe(0.7);
  });
  it("has an outline as large as it is, turned with it", () => {
    const box: WorldShape = { ...VISITOR, kind: "box", size: [2, 1, 1], heading: Math.PI / 2, path: [], x: 5 };
    const xs = outlineOf(box, 0).map(({ x }) => x);
    const ys = outlineOf(box, 0).map(({ y }) => y);
    expect([Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)].map((value) => Number(value.toFixed(6)))).toEqual([4.5, 5.5, -1, 1]);
    for (const { x, y } of outlineOf(VISITOR, 3)) expect(Math.hypot(x - 2, y)).toBeCloseTo(0.25);
  });
});

describe("a world", () => {
  it("is found by its type, and only where it is published", () => {
    const port = (kind: string, type: string) => ({ kind, type, topic: `/${kind}` });
    const components = [{ ports: [port("in", "rbxcompose_msgs/msg/World"), port("out", "rbxcompose_msgs/msg/World")] }] as unknown as Component[];
    expect(worldTopicOf(components)).toBe("/out");
    expect(worldTopicOf([])).toBe("");
    const robots = [{ ports: [{ kind: "in", type: "rbxcompose_msgs/msg/WorldRobots", topic: "/world/others" }] }] as unknown as Component[];
    expect(robotsTopicOf(robots)).toBe("/world/others");
    expect(robotsTopicOf(components)).toBe("");
  });
  it("has others, who are where they say", () => {
    expect([...readRobots({ names: ["a", "b"], xs: [1, 2], ys: [3, 4] })]).toEqual([["a", { x: 1, y: 3 }], ["b", { x: 2, y: 4 }]]);
  });
  it("tells robot time by its stamp, and has no walls without cells", () => {
    const map = { header: { stamp: { sec: 1000, nanosec: 500_000_000 } }, info: { width: 0 }, data: [] };
    const shape = { name: "visitor", kind: "cylinder", size: [0.25, 1.7], x: 0, y: 0, z: 0, heading: 0, colour: "", times: [2, 4, 8], xs: [0, 4, 0], ys: [0, 0, 0], repeats: true };
    const world = readWorld({ map, shapes: [shape], time: 3 });
    expect(world.walls).toBeNull();
    expect(world.epoch + 1001).toBeCloseTo(3.5);
    expect(world.shapes).toEqual([VISITOR]);
    expect(world.robots).toEqual([]);
  });
});
