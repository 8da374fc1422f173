import { expect, it } from "vitest";
import type { Block, Path } from "./edited";
import { dropAt, isWithin, sameBlocks, seenBlocks, type Row } from "./outline_rows";

const block = (kind: string, path: Path, ...children: Block[]): Block => ({
  path,
  kind,
  text: "",
  name: "",
  role: "",
  from: 0,
  to: 0,
  is_fixed: false,
  notes: [],
  leads: [],
  slots: children.length > 0 ? [{ path: children[0]!.path.slice(0, -1), holds: "several", of: "step", part: "do", is_there: true, has_names: false, start: "", is_optional: false }] : [],
  children,
});
const wait = block("wait", ["do", 1, "sequence", 0]);
const log = block("log", ["do", 1, "sequence", 1]);
const sequence = block("sequence", ["do", 1], wait, log);
const dock = block("dock", ["do", 0]);
const MISSION = [dock, sequence];

it("shows no block within a folded one", () => {
  expect(seenBlocks(MISSION, (one) => one === sequence)).toEqual([dock, sequence]);
  expect(seenBlocks(MISSION, () => false)).toEqual([dock, sequence, wait, log]);
});

it("knows a block again after it, or another one, was moved, edited, deleted or added", () => {
  const moved = [block("sequence", ["do", 0], block("wait", ["do", 0, "sequence", 0]), block("log", ["do", 0, "sequence", 1])), block("dock", ["do", 1])];
  const same = sameBlocks(MISSION, moved);
  expect([same.get(moved[0]!), same.get(moved[0]!.children[1]!), same.get(moved[1]!)]).toEqual([sequence, log, dock]);
  const edited = [{ ...dock, text: "there" }, sequence];
  expect(sameBlocks(MISSION, edited).get(edited[0]!)).toBe(dock);
  expect(sameBlocks(MISSION, [{ ...sequence }]).size).toBe(3);
  const added = [dock, block("new", ["do", 1]), { ...sequence, path: ["do", 2] }];
  expect(sameBlocks(MISSION, added).get(added[1]!)).toBeUndefined();
  expect(sameBlocks(MISSION, added).get(added[2]!)).toBe(sequence);
  const out = [dock, block("sequence", ["do", 1], wait), log];
  expect(sameBlocks(MISSION, out).get(log)).toBe(log);
});

it("never takes two blocks for the same one", () => {
  const twins = [block("wait", ["do", 0]), block("wait", ["do", 1]), block("wait", ["do", 2])];
  const same = sameBlocks([twins[0]!, twins[1]!], twins);
  expect(new Set(same.values()).size).toBe(same.size);
});

const row = (one: Block, parent: Block | null, turn: number, left: number): Row => ({
  block: one,
  parent,
  siblings: parent ? parent.children : MISSION,
  slots: parent ? parent.slots : [{ path: ["do"], holds: "one", of: "step", part: "do", is_there: true, has_names: false, start: "", is_optional: false }],
  top: 40 * turn,
  bottom: 40 * turn + 40,
  left,
  isOpen: one.children.length > 0,
});
const ROWS = [row(dock, null, 0, 10), row(sequence, null, 1, 10), row(wait, sequence, 2, 30), row(log, sequence, 3, 30)];

it.each([
  ["the upper half of a step", 50, 5, dock, "before", ["do"], 0],
  ["the lower half of a step", 50, 35, dock, "after", ["do"], 1],
  ["the middle of what holds others", 50, 60, sequence, "into", ["do", 1, "sequence"], 1_000],
  ["below what is open", 50, 78, wait, "before", ["do", 1, "sequence"], 0],
  ["the end of the last one", 50, 158, log, "after", ["do", 1, "sequence"], 2],
  ["the end of the last one, further left", 20, 158, sequence, "after", ["do"], 2],
])("drops at %s", (_, x, y, at, where, to, index) => {
  expect(dropAt(ROWS, x, y)).toEqual({ at, where, to, index });
});

it("drops nothing outside, and nothing into itself", () => {
  expect(dropAt(ROWS, 50, 500)).toBeNull();
  expect(isWithin(dropAt(ROWS, 50, 90)!, sequence)).toBe(true);
  expect(isWithin(dropAt(ROWS, 50, 5)!, sequence)).toBe(false);
});

it("drops beside the only step of a place, and among names by their order", () => {
  const only = block("wait", ["do"]);
  const alone: Row = { ...row(only, null, 0, 10), siblings: [only] };
  expect(dropAt([alone], 50, 35)).toMatchObject({ to: ["do"], index: 1 });
  const states = ["a", "b"].map((name) => block("state", ["machine", "states", name]));
  const last: Row = { ...row(states[1]!, null, 0, 10), siblings: states, slots: [] };
  expect(dropAt([last], 50, 35)).toMatchObject({ to: ["machine", "states"], index: 2 });
});
