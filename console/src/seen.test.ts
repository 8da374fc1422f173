import { describe, expect, it } from "vitest";
import { outlineIn, readBoxes, readCamera, readThings, thingMarkers, type PinholeCamera } from "./seen";

const info = { header: { frame_id: "eye" }, width: 640, height: 480, k: [500, 0, 320, 0, 500, 240, 0, 0, 1] };
const camera = readCamera(info) as PinholeCamera;
const pose = { position: { x: 0.1, y: -0.2, z: 2 }, orientation: { x: 1, y: 0, z: 0, w: 0 } };
const tag = {
  id: "left_box",
  results: [{ hypothesis: { class_id: "left_box", score: 0.9 } }],
  bbox: { center: pose, size: { x: 0.2, y: 0.2, z: 0.001 } },
};

describe("things", () => {
  it("have names, poses and sizes; what has no place is left out", () => {
    const lost = { ...tag, results: [{ hypothesis: { class_id: "x", score: 0 } }] };
    const [thing, ...others] = readThings({ detections: [tag, lost, { id: "nothing" }, 7] });
    expect(others).toEqual([]);
    expect(thing?.name).toBe("left box");
    expect(thing?.size).toEqual({ x: 0.2, y: 0.2, z: 0.001 });
  });

  it("are where a pinhole has them in its picture", () => {
    const [thing] = readThings({ detections: [tag] });
    const outline = outlineIn(camera, thing!)!;
    const middle = { x: 320 + (500 * 0.1) / 2, y: 240 - (500 * 0.2) / 2 };
    expect(outline.reduce((sum, { x }) => sum + x / 4, 0)).toBeCloseTo(middle.x);
    expect(outline.reduce((sum, { y }) => sum + y / 4, 0)).toBeCloseTo(middle.y);
    expect(Math.max(...outline.map(({ x }) => x)) - Math.min(...outline.map(({ x }) => x))).toBeCloseTo(50);
  });

  it("behind the camera are not in its picture", () => {
    const [thing] = readThings({ detections: [{ ...tag, bbox: { ...tag.bbox, center: { ...pose, position: { x: 0, y: 0, z: -1 } } } }] });
    expect(outlineIn(camera, thing!)).toBeNull();
  });

  it("are drawn on a map with their names", () => {
    const { frame, areas, labels } = thingMarkers({ header: { frame_id: "/eye" }, detections: [tag] });
    expect(frame).toBe("eye");
    expect(areas[0]!.corners).toHaveLength(4);
    expect(labels).toEqual([{ at: pose.position, text: "left box" }]);
  });
});

describe("boxes", () => {
  it("are in pixels, from the upper left", () => {
    const bbox = { center: { position: { x: 100, y: 50 }, theta: 0 }, size_x: 40, size_y: 20 };
    const found = readBoxes({ detections: [{ id: "cup", bbox }, { id: "none", bbox: {} }] });
    expect(found).toEqual([{ name: "cup", left: 80, top: 40, width: 40, height: 20 }]);
  });
});

describe("cameras", () => {
  it("that are not calibrated are none", () => {
    expect(camera).toEqual({ frame: "eye", width: 640, height: 480, fx: 500, fy: 500, cx: 320, cy: 240 });
    expect(readCamera({ ...info, k: [0, 0, 0, 0, 0, 0, 0, 0, 0] })).toBeNull();
    expect(readCamera({})).toBeNull();
  });
});
