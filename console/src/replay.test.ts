import { describe, expect, it } from "vitest";
import { poseAt, statusesAt } from "./replay";
import type { DryRun } from "./trial";

const run: DryRun = {
  outcome: "success",
  why: "",
  time: 3,
  left_out: 0,
  story: [],
  statuses: [],
  places: [],
  changes: [
    { time: 0, path: ["do"], status: "running" },
    { time: 1, path: ["do", 0], status: "success" },
    { time: 2, path: ["do"], status: "success" },
  ],
  track: [
    [0.5, 0, 0, 0],
    [1, 1, 2, 0.5],
  ],
};

describe("a dry run at a time", () => {
  it("has the status that each block had last", () => {
    expect(statusesAt(run, -1)).toEqual([]);
    expect(statusesAt(run, 1.5).map(({ status }) => status)).toEqual(["running", "success"]);
    expect(statusesAt(run, 9).map(({ status }) => status)).toEqual(["success", "success"]);
  });

  it("has the robot where it was last, with its trail", () => {
    expect(poseAt(run, 0.1)).toBeNull();
    expect(poseAt(run, 2)).toEqual({ robot: { x: 1, y: 2, heading: 0.5 }, trail: [{ x: 0, y: 0 }, { x: 1, y: 2 }] });
    expect(poseAt(run, 500)).toEqual({ robot: { x: 1, y: 2, heading: 0.5 }, trail: [] });
  });
});
