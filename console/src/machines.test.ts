import { expect, it } from "vitest";
import type { Block, Path, Slot } from "./edited";
import { activeStates, arrowWords, graphOf, machinesAround, namesOf } from "./machines";
import type { Drawn, Seen } from "./mission";

const slot = (path: Path, start: string): Slot => ({ path, holds: "named", of: "state", part: "state", is_there: true, has_names: true, start, is_optional: false });
const state = (path: Path, leads: Block["leads"], slots: Slot[] = [], children: Block[] = []): Block => ({
  path,
  kind: "state",
  text: "",
  name: String(path.at(-1)),
  role: "",
  from: 0,
  to: 0,
  is_fixed: false,
  notes: [],
  leads,
  slots,
  children,
});
const lead = (outcome: string, to: string) => ({ outcome, to });
const OUTER: Path = ["machine", "states"];
const INNER: Path = [...OUTER, "b", "machine", "states"];
const within = state([...INNER, "x"], [lead("", "finished")]);
const a = state([...OUTER, "a"], [lead("success", "b"), lead("lost", "b"), lead("failure", "failed")]);
const b = state([...OUTER, "b"], [lead("", "finished")], [slot(INNER, "x")], [within]);
const OUTLINE = { blocks: [a, b], slots: [slot(OUTER, "a")] };

it("draws states, ends and transitions, those between the same two as one", () => {
  const { boxes, arrows } = graphOf("m", OUTLINE.slots[0]!, OUTLINE.blocks);
  expect(boxes.map(({ name, block, isStart, isNested }) => [name, block !== null, isStart, isNested])).toEqual([
    ["a", true, true, false],
    ["b", true, false, true],
    ["failed", false, false, false],
    ["finished", false, false, false],
  ]);
  expect(arrows.map(arrowWords)).toEqual(["a leads to b after success or lost", "a leads to failed after failure", "b leads to finished"]);
});

it("shows the machines around and in what is chosen, else the first one", () => {
  expect(machinesAround(OUTLINE, within).map(({ title }) => title)).toEqual(["The mission", "b"]);
  expect(machinesAround(OUTLINE, a).map(({ title }) => title)).toEqual(["The mission"]);
  expect(machinesAround(OUTLINE, null).map(({ title }) => title)).toEqual(["The mission"]);
  const step = { ...b, name: "later", path: ["do", 1] as Path };
  expect(machinesAround({ blocks: [step], slots: [] }, null).map(({ title }) => title)).toEqual(["later"]);
  expect(machinesAround({ blocks: [], slots: [] }, null)).toEqual([]);
});

const drawn = (number: number, name: string, form: string, ...children: Drawn[]): Drawn => ({
  number,
  kind: form,
  text: "",
  name: "",
  role: name,
  notes: [],
  arrows: [],
  is_start: false,
  children,
  sign: "",
  form,
});

it("knows the states in which the robot is by their names", () => {
  const main = drawn(0, "", "machine", drawn(1, "a", "state"), drawn(2, "b", "state", drawn(3, "", "machine", drawn(4, "x", "state"))));
  const seen = { state: "running", statuses: { 0: 1, 1: 2, 2: 1, 3: 1, 4: 1 }, picture: { main, interrupts: [] } } as unknown as Seen;
  expect(activeStates(seen)).toEqual(new Set([namesOf(b.path), namesOf(within.path)]));
  expect(activeStates({ ...seen, state: "success" }).size).toBe(0);
});
