import { expect, it } from "vitest";
import { lastText, nextText, type Trigger } from "./triggers";

const nothing = { priority: 0, running: "skip", next: "", waits: false, fired: "", came: "", off: "" };
const trigger: Trigger = { name: "nightly", mission: "patrol", cause: "at 22:00", ...nothing };

it("tells what a trigger does next", () => {
  expect(nextText(trigger)).toBe("On");
  expect(nextText({ ...trigger, next: "Fri 22:00" })).toBe("On; next: Fri 22:00");
  expect(nextText({ ...trigger, waits: true })).toBe("Waits for its turn");
  expect(nextText({ ...trigger, waits: true, off: "the robot is stopped" })).toBe("Off: the robot is stopped");
});

it("tells what came of it", () => {
  expect(lastText(trigger)).toBe("Has not fired since the robot came up");
  expect(lastText({ ...trigger, fired: "Fri 22:00", came: "not started: base is in use" })).toBe(
    "Last fired Fri 22:00: not started: base is in use",
  );
});
