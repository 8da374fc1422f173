import { expect, it } from "vitest";
import type { Block, Path, Slot } from "./edited";
import { arrowWords, graphOf, machinesAround } from "./machines";

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
