import { expect, it } from "vitest";
import { leftOverText, waysOn } from "./left_over";

const left = { mission: "patrol", at: 0, doing: "go_to dock", inputs: {}, changed: "", waits: false };
const ways = (...given: Parameters<typeof waysOn>) => waysOn(...given).map(({ requests }) => requests.join(", "));

it("tells where a run was, and why it cannot go on", () => {
  expect(leftOverText({ ...left, waits: true }, "10:00")).toBe(
    "This run did not end: its process crashed or the power was lost (10:00, at: go_to dock).",
  );
  expect(leftOverText({ ...left, doing: "", changed: "the robot's places" }, "10:00")).toBe(
    "An earlier run did not end: its process crashed or the power was lost (10:00). " +
      "It cannot go on, because the robot's places changed since.",
  );
});

it("offers what the robot will not refuse", () => {
  expect(ways({ ...left, waits: true }, true)).toEqual(["ResumeMission", "CancelMission, RunMission"]);
  expect(ways(left, false)).toEqual(["RestoreMission", "RunMission", "ForgetMission"]);
  expect(ways(left, true)).toEqual(["CancelMission, RestoreMission", "ForgetMission"]);
  expect(ways({ ...left, changed: "x" }, false)).toEqual(["RunMission", "ForgetMission"]);
  expect(ways({ ...left, changed: "x" }, true)).toEqual(["ForgetMission"]);
});
