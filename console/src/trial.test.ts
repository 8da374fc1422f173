import { describe, expect, it } from "vitest";
import { ending, poseAt, statusesAt, tested, timeAt, type DryRun } from "./trial";

const run = { outcome: "success", why: "", time: 12.345, left_out: 0, story: [], statuses: [], changes: [], track: [], places: [] };

it("tells how a dry run ended", () => {
  expect(ending(run)).toBe("It ended in success after 12.3 s of robot time");
  expect(ending({ ...run, outcome: "", why: "it waits" })).toBe("Not ended: it waits");
});

it("counts tests and ways", () => {
  const coverage = { ways: 5, taken: 3, missing: [] };
  const test = { name: "a", passed: true, outcome: "success", problems: [] };
  expect(tested({ tests: [test], coverage })).toBe("1 of 1 test passed; they took 3 of 5 ways.");
});

const played: DryRun = {
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
    expect(statusesAt(played, -1)).toEqual([]);
    expect(statusesAt(played, 1.5).map(({ status }) => status)).toEqual(["running", "success"]);
    expect(statusesAt(played, 9).map(({ status }) => status)).toEqual(["success", "success"]);
  });

  it.each([10.700000000000001, 0.1 + 0.2, 0])("has its last change at its end, %d s", (time) => {
    const run = { ...played, time, changes: [{ time, path: ["do"], status: "success" }] };
    expect(statusesAt(run, timeAt(run, Number("1"))).map(({ status }) => status)).toEqual(["success"]);
  });

  it("has the robot where it was last, with its trail", () => {
    expect(poseAt(played, 0.1)).toBeNull();
    expect(poseAt(played, 2)).toEqual({ robot: { x: 1, y: 2, heading: 0.5 }, trail: [{ x: 0, y: 0 }, { x: 1, y: 2 }] });
    expect(poseAt(played, 500)).toEqual({ robot: { x: 1, y: 2, heading: 0.5 }, trail: [] });
  });
});
