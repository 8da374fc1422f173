import { expect, it } from "vitest";
import { breakpointsAt, byHandText, machineOf, spotOf, stoppedHere, stoppedText } from "./debugging";
import type { Drawn, Picture } from "./mission";

const breakpoint = (where: string, spots: [number, string | null][], mission = "patrol") => ({
  mission,
  where,
  place: "patrol.yaml:3",
  text: "",
  spots,
});

it("finds the breakpoints of a mission by where they stop it", () => {
  const listed = [
    breakpoint("patrol.yaml:3", [
      [2, null],
      [4, null],
    ]),
    breakpoint("2", [[2, null]]),
    breakpoint("2->home", [[2, "success"]]),
    breakpoint("nap", [[2, null]], "rest"),
  ];
  const found = breakpointsAt(listed, "patrol");
  expect(found.get(spotOf(2))).toEqual(["patrol.yaml:3", "2"]);
  expect(found.get(spotOf(4))).toEqual(["patrol.yaml:3"]);
  expect(found.get(spotOf(2, "success"))).toEqual(["2->home"]);
  expect(found.get(spotOf(2, "failure"))).toBeUndefined();
});

it("says where a mission was stopped, and what it lacks", () => {
  const before = { node: 2, place: "patrol.yaml:3", text: "go_to dock", after: "" };
  const after = { ...before, text: "away", after: "success" };
  expect(stoppedText([before])).toBe("Stopped at patrol.yaml:3, before go_to dock.");
  expect(stoppedText([after])).toBe("Stopped at patrol.yaml:3, after away: success.");
  expect([before, after].map(stoppedHere)).toEqual(["stopped here, before it begins", "stopped here, after success"]);
  expect(byHandText(0)).toBe("");
  expect(byHandText(1)).toContain("once");
  expect(byHandText(3)).toContain("3 times");
});

it("knows the machine of a state", () => {
  const plain = { kind: "", text: "", name: "", role: "", notes: [], arrows: [], is_start: false, sign: "" };
  const drawn = (number: number, form: string, ...children: Drawn[]): Drawn => ({ ...plain, number, form, children });
  const [state, step] = [drawn(2, "state"), drawn(3, "after")];
  const machine = drawn(1, "machine", state, step);
  const picture: Picture = { name: "", about: "", main: drawn(0, "after", machine), interrupts: [], count: 4 };
  expect(machineOf(state, picture)).toBe(machine);
  expect(machineOf(structuredClone(state), picture)).toBe(machine);
  expect(machineOf(step, picture)).toBeNull();
});
