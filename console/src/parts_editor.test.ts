import { describe, expect, it } from "vitest";
import { draggedTo, freePartName, matchingParts, type OfferedPart } from "./parts_editor";

const part = (name: string, about: string): OfferedPart => ({ name, about, file: "", has_body: true, needs: [] });
const parts = [part("xtion", "A depth camera of the size of an Xtion."), part("pan_tilt_head", "A head that pans and tilts.")];
const pose = { x: 0.1, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0 };

describe("parts", () => {
  it("are found by words of their names and of what is said of them", () => {
    expect(matchingParts(parts, "CAMERA depth").map(({ name }) => name)).toEqual(["xtion"]);
    expect(matchingParts(parts, "pan tilt").map(({ name }) => name)).toEqual(["pan_tilt_head"]);
    expect(matchingParts(parts, " ")).toHaveLength(2);
    expect(matchingParts(parts, "wheel")).toEqual([]);
  });

  it("get a name that is free", () => {
    expect(freePartName(["base"], "xtion")).toBe("xtion");
    expect(freePartName(["xtion", "xtion_2"], "xtion")).toBe("xtion_3");
  });

  it("are dragged to millimetres and degrees, and only what changed is said", () => {
    const after = { ...pose, x: 0.12345, yaw: Math.PI / 2 + 0.001, y: 0.0001 };
    const moved = draggedTo(pose, after) as Record<string, number>;
    expect(Object.keys(moved)).toEqual(["x", "yaw"]);
    expect(moved.x).toBeCloseTo(0.123, 9);
    expect(moved.yaw).toBeCloseTo(Math.PI / 2, 9);
  });
});
