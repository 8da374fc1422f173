import { describe, expect, it } from "vitest";
import {
  applied,
  composed,
  distance,
  draggedPose,
  fitted,
  formatLength,
  Frames,
  costPixels,
  gridPixels,
  gridStep,
  IDENTITY,
  inverted,
  LARGEST_SCALE,
  niceLength,
  panned,
  poseOf,
  quaternionOf,
  readGrid,
  readMarkers,
  readPath,
  readScan,
  readTransform,
  SMALLEST_SCALE,
  toScreen,
  toWorld,
  Trail,
  yawOf,
  zoomed,
  type Point,
  type Pose,
  type Transform,
  type View,
} from "./map";

/** Returns numbers between -1 and 1, the same ones each time. */
function numbers(): () => number {
  let state = 1;
  return () => {
    state = (state * 48_271) % 2_147_483_647;
    return (2 * state) / 2_147_483_647 - 1;
  };
}

const CASES = 200;
const next = numbers();
const views = Array.from({ length: CASES }, (): View => {
  const [width, height] = [600 + 500 * next(), 500 + 400 * next()];
  return { x: 100 * next(), y: 100 * next(), scale: 10 ** (1 + 1.5 * next()), width, height };
});
const points = Array.from({ length: CASES }, (): Point => ({ x: 100 * next(), y: 100 * next() }));
const transforms = Array.from({ length: CASES }, (): Transform => {
  const [x, y, z, w] = [next(), next(), next(), next()];
  const length = Math.hypot(x, y, z, w);
  const rotation = { x: x / length, y: y / length, z: z / length, w: w / length };
  return { translation: { x: 9 * next(), y: 9 * next(), z: 9 * next() }, rotation };
});

function near(one: Point, other: Point, digits = 6): void {
  expect(one.x).toBeCloseTo(other.x, digits);
  expect(one.y).toBeCloseTo(other.y, digits);
}

function transformOf({ x, y, heading }: Pose): Transform {
  return { translation: { x, y, z: 0 }, rotation: quaternionOf(heading) };
}

const same = (one: Transform, other: Transform) => {
  for (const point of [{ x: 0, y: 0, z: 0 }, { x: 1, y: 2, z: 3 }]) {
    near(applied(one, point), applied(other, point));
    expect(applied(one, point).z).toBeCloseTo(applied(other, point).z, 6);
  }
};

describe("rotations", () => {
  it("keep the heading through a quaternion", () => {
    for (let turn = 0; turn < CASES; turn += 1) {
      const heading = Math.PI * next();
      expect(yawOf(quaternionOf(heading))).toBeCloseTo(heading, 9);
    }
  });

  it("have the heading of their x axis, however they are tilted", () => {
    for (const { rotation } of transforms) {
      const ahead = applied({ ...IDENTITY, rotation }, { x: 1, y: 0, z: 0 });
      expect(yawOf(rotation)).toBeCloseTo(Math.atan2(ahead.y, ahead.x), 9);
    }
  });
});

describe("transforms", () => {
  it("are undone by their inverse, on both sides", () => {
    for (const transform of transforms) {
      same(composed(transform, inverted(transform)), IDENTITY);
      same(composed(inverted(transform), transform), IDENTITY);
    }
  });

  it("are chained one after the other", () => {
    transforms.slice(1).forEach((inner, turn) => {
      const outer = transforms[turn]!;
      near(applied(composed(outer, inner), { x: 1, y: 2, z: 3 }), applied(outer, applied(inner, { x: 1, y: 2, z: 3 })));
    });
  });

  it("of the plane are the poses that they say", () => {
    const pose = { x: 1, y: -2, heading: 2 };
    expect(poseOf(transformOf(pose))).toMatchObject({ x: 1, y: -2, heading: expect.closeTo(2, 9) });
  });

  it("are read from messages, and from none that lacks a number", () => {
    const rotation = { x: 0, y: 0, z: 0, w: 2 };
    expect(readTransform({ translation: { x: 1, y: 2, z: 3 }, rotation })).toEqual({
      translation: { x: 1, y: 2, z: 3 },
      rotation: IDENTITY.rotation,
    });
    const unset = { position: { x: 1, y: 2, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 0 } };
    expect(readTransform(unset)?.rotation).toEqual(IDENTITY.rotation);
    expect(readTransform({ translation: { x: null, y: 2, z: 3 }, rotation })).toBeNull();
    expect(readTransform(undefined)).toBeNull();
  });
});

describe("frames", () => {
  const chain = () => {
    const frames = new Frames();
    frames.set("map", "odom", transformOf({ x: 10, y: 0, heading: Math.PI / 2 }));
    frames.set("/odom", "base", transformOf({ x: 1, y: 0, heading: 0 }));
    frames.set("base", "laser", transformOf({ x: 0.5, y: 0, heading: Math.PI }));
    return frames;
  };

  it("lead from one to another through all between them, up and down", () => {
    const frames = chain();
    near(poseOf(frames.lookUp("map", "laser")!), { x: 10, y: 1.5 });
    expect(poseOf(frames.lookUp("map", "base")!).heading).toBeCloseTo(Math.PI / 2, 9);
    same(composed(frames.lookUp("laser", "map")!, frames.lookUp("map", "laser")!), IDENTITY);
    same(frames.lookUp("odom", "odom")!, IDENTITY);
  });

  it("that nothing connects have no transform", () => {
    const frames = chain();
    frames.set("other_map", "other_base", IDENTITY);
    expect(frames.lookUp("map", "other_base")).toBeNull();
  });

  it("show a base in map, else in odom, else in the topmost one", () => {
    const frames = chain();
    expect(frames.fixedFor("base")).toBe("map");
    frames.set("earth", "map", IDENTITY);
    expect(frames.fixedFor("laser")).toBe("map");
    const lost = new Frames();
    lost.set("odom", "base", IDENTITY);
    expect(lost.fixedFor("base")).toBe("odom");
    lost.set("world", "cart", IDENTITY);
    expect(lost.fixedFor("cart")).toBe("world");
  });

  it("in a loop are left again", () => {
    const frames = new Frames();
    frames.set("a", "b", IDENTITY);
    frames.set("b", "a", IDENTITY);
    frames.set("c", "c", IDENTITY);
    expect(frames.lookUp("map", "a")).toBeNull();
    expect(frames.lookUp("map", "c")).toBeNull();
  });
});

describe("the view", () => {
  it("takes a point to a pixel and back", () => {
    views.forEach((view, turn) => near(toWorld(view, toScreen(view, points[turn]!)), points[turn]!));
  });

  it("has y up, and a metre as long as its scale", () => {
    for (const view of views) {
      const [from, to] = [toScreen(view, { x: 1, y: 1 }), toScreen(view, { x: 2, y: 2 })];
      expect(to.x - from.x).toBeCloseTo(view.scale, 6);
      expect(from.y - to.y).toBeCloseTo(view.scale, 6);
    }
  });

  it("moves a point by as many pixels as a finger", () => {
    views.forEach((view, turn) => {
      const [before, after] = [toScreen(view, points[turn]!), toScreen(panned(view, 30, -20), points[turn]!)];
      near(after, { x: before.x + 30, y: before.y - 20 });
    });
  });

  it("keeps what is under the finger when it zooms, and its scale within limits", () => {
    views.forEach((view, turn) => {
      const at = { x: 50 + turn, y: 80 };
      for (const factor of [0.001, 0.5, 1, 3, 1e6]) {
        const closer = zoomed(view, factor, at);
        near(toWorld(closer, at), toWorld(view, at), 4);
        expect(closer.scale).toBeGreaterThanOrEqual(SMALLEST_SCALE);
        expect(closer.scale).toBeLessThanOrEqual(LARGEST_SCALE);
      }
    });
  });

  it("that fits shows every point, however far apart they are, and is zoomed out no further", () => {
    const far = [{ x: -30_000, y: 1 }, { x: 90_000, y: 0 }];
    for (let count = 0; count < 20; count += 1) {
      const shown = [...points.slice(0, count), ...far.slice(0, count % 3)];
      const view = fitted(shown, 390, 300);
      expect(zoomed(view, 0.5, { x: 0, y: 0 }).scale).toBeLessThanOrEqual(view.scale);
      expect(zoomed(view, 2, { x: 0, y: 0 }).scale).toBeGreaterThan(view.scale);
      for (const point of shown) {
        const { x, y } = toScreen(view, point);
        expect(x).toBeGreaterThanOrEqual(0);
        expect(x).toBeLessThanOrEqual(390);
        expect(y).toBeGreaterThanOrEqual(0);
        expect(y).toBeLessThanOrEqual(300);
      }
    }
  });

  it("has a scale bar of a round length that is not too long, and lines that are not too close", () => {
    for (const { scale } of views) {
      const length = niceLength(scale, 120);
      expect(["1", "2", "5"]).toContain(length.toExponential().charAt(0));
      expect(length.toExponential()).not.toContain(".");
      expect(length * scale).toBeLessThanOrEqual(120.000001);
      expect(length * scale).toBeGreaterThan(48 - 0.000001);
      expect(gridStep(scale) * scale).toBeGreaterThanOrEqual(8);
    }
    expect(gridStep(50)).toBe(1);
    expect([0.02, 0.5, 1, 20, 2000].map(formatLength)).toEqual([
      "2\u202fcm",
      "50\u202fcm",
      "1\u202fm",
      "20\u202fm",
      "2\u202fkm",
    ]);
  });

  it("makes of a drag a pose that looks where the finger went, and of a tap one that looks elsewhere", () => {
    const view = { x: 0, y: 0, scale: 100, width: 200, height: 200 };
    expect(draggedPose(view, { x: 150, y: 100 }, { x: 150, y: 50 }, 9)).toEqual({ x: 0.5, y: 0, heading: Math.PI / 2 });
    expect(draggedPose(view, { x: 150, y: 100 }, { x: 155, y: 102 }, 9).heading).toBe(9);
  });
});

describe("a grid", () => {
  const info = {
    width: 2,
    height: 3,
    resolution: 0.5,
    origin: { position: { x: -1, y: 2, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
  };
  const message = { header: { frame_id: "/map" }, info, data: [0, 100, 50, -1, 100, 0] };

  it("is a picture with its last row on top; what is unknown is transparent", () => {
    const grid = readGrid(message)!;
    expect(grid).toMatchObject({ frame: "map", width: 2, height: 3, origin: { translation: { x: -1, y: 2 } } });
    const pixels = [...gridPixels(grid, [200, 200, 200], [0, 0, 0])];
    const cell = (at: number) => pixels.slice(4 * at, 4 * at + 4);
    const rows = [0, 1, 2].map((row) => [cell(2 * row), cell(2 * row + 1)]);
    expect(rows).toEqual([
      [[0, 0, 0, 255], [200, 200, 200, 255]],
      [[100, 100, 100, 255], [0, 0, 0, 0]],
      [[200, 200, 200, 255], [0, 0, 0, 255]],
    ]);
  });

  it("of costs is seen through where it is cheap", () => {
    const costs = costPixels(readGrid({ ...message, data: [0, 100, 50, -1, 0, 0] })!, [1, 2, 3]);
    expect([...costs.slice(4 * 5, 4 * 6)]).toEqual([1, 2, 3, 140]);
    expect([...costs].filter((_, at) => at % 4 === 3)).toEqual([0, 0, 70, 0, 0, 140]);
  });

  it("that does not have as many cells as it says is none", () => {
    expect(readGrid({ ...message, data: [0] })).toBeNull();
    expect(readGrid({ ...message, info: { ...info, resolution: 0 } })).toBeNull();
    expect(readGrid({})).toBeNull();
  });
});

describe("what is seen", () => {
  it("is where the laser was reflected; what is out of range is left out", () => {
    const beams = { angle_min: 0, angle_increment: Math.PI / 2, range_min: 0.1, range_max: 5 };
    const found = readScan({ ...beams, ranges: [1, 2, null, 9, 0.01, 3] });
    expect(found).toHaveLength(3);
    near(found[0]!, { x: 1, y: 0 });
    near(found[1]!, { x: 0, y: 2 });
    near(found[2]!, { x: 0, y: 3 });
  });

  it("is a path of poses", () => {
    const pose = (x: number) => ({ pose: { position: { x, y: 1, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } } });
    expect(readPath({ poses: [pose(1), pose(2), {}] })).toEqual([{ x: 1, y: 1, z: 0 }, { x: 2, y: 1, z: 0 }]);
    expect(readPath({})).toEqual([]);
  });
});

describe("the trail", () => {
  it("is that of the last minute, without a point for every message", () => {
    const trail = new Trail();
    for (let second = 0; second <= 90; second += 1) trail.add({ x: second, y: 0 }, second * 1000);
    expect(trail.points.map(({ x }) => x)).toEqual(Array.from({ length: 60 }, (_, turn) => turn + 31));
    trail.add({ x: 90.001, y: 0 }, 91_000);
    expect(trail.points.at(-1)).toMatchObject({ x: 90 });
    trail.add({ x: 90, y: 0 }, 500_000);
    expect(trail.points).toEqual([]);
    expect(distance({ x: 0, y: 0 }, { x: 3, y: 4 })).toBe(5);
  });
});

describe("markers", () => {
  const pose = { position: { x: 1, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: Math.SQRT1_2, w: Math.SQRT1_2 } };
  const point = (x: number, y: number) => ({ x, y, z: 0 });
  const marker = { header: { frame_id: "map" }, action: 0, pose, color: { r: 1, g: 0.5, b: 0, a: 1 } };
  const corners = [point(0, 0), point(2, 0), point(0, 1)];
  const outline = { ...marker, type: 4, points: [...corners, point(0, 0)] };

  it("are areas where a line is closed, turned by their pose, and texts", () => {
    const text = { ...marker, type: 9, text: "stairs: keep out" };
    const { frame, areas, labels } = readMarkers({ markers: [{ header: { frame_id: "/map" }, action: 3 }, outline, text] });
    expect(frame).toBe("map");
    expect(areas).toHaveLength(1);
    expect(areas[0]!.colour).toBe("rgb(255 128 0 / 1)");
    expect(areas[0]!.corners).toHaveLength(3);
    near(areas[0]!.corners[0]!, { x: 1, y: 2 });
    expect(labels).toMatchObject([{ at: { x: 1, y: 0 }, text: "stairs: keep out" }]);
  });
  it("are nothing that is drawn where they are open lines, of other types, or elsewhere", () => {
    const others = [
      { ...outline, points: corners },
      { ...outline, type: 1 },
      { ...outline, action: 2 },
      { ...outline, header: { frame_id: "odom" } },
    ];
    expect(readMarkers({ markers: [{ ...marker, type: 0 }, ...others] })).toEqual({ frame: "map", areas: [], labels: [] });
    expect(readMarkers({})).toEqual({ frame: "", areas: [], labels: [] });
  });
});
