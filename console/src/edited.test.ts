import { describe, expect, it } from "vitest";
import { allBlocks, blockAt, isSame, kindOf, partsOf, placeBehind, verdict, type Block } from "./edited";
import { matching, type Offered } from "./step_form";

const PART = { part: "do", is_there: true, has_names: false, start: "", is_optional: false };

function block(path: Block["path"], from: number, to: number, children: Block[] = []): Block {
  const slots = children.length > 0 ? [{ path: [...path, "do"], holds: "several" as const, of: "step" as const, ...PART }] : [];
  return { path, kind: "wait", text: "", name: "", role: "", from, to, is_fixed: false, notes: [],
  leads: [], slots, children };
}

const inner = block(["do", 1, "do", 0], 20, 30);
const blocks = [block(["do", 0], 0, 10), block(["do", 1], 10, 40, [inner])];

describe("the outline", () => {
  it("finds the innermost block at a place", () => {
    expect(blockAt(blocks, 5)).toBe(blocks[0]);
    expect(blockAt(blocks, 10)).toBe(blocks[1]);
    expect(blockAt(blocks, 25)).toBe(inner);
    expect(blockAt(blocks, 40)).toBeNull();
  });

  it("lists all blocks in the order of the text", () => {
    expect(allBlocks(blocks)).toEqual([blocks[0], blocks[1], inner]);
    expect(isSame(inner.path, ["do", 1, "do", 0])).toBe(true);
    expect(isSame(inner.path, ["do", 1, "do", "0"])).toBe(false);
  });

  it("puts a new step behind the chosen one, else at the end", () => {
    const slots = [{ path: ["do"], holds: "one" as const, of: "step" as const, ...PART }];
    expect(placeBehind({ blocks, slots }, inner)).toEqual({ path: ["do", 1, "do"], index: 1 });
    expect(placeBehind({ blocks, slots }, block(["do"], 0, 1))).toEqual({ path: ["do"], index: 1 });
    expect(placeBehind({ blocks, slots }, null)).toEqual({ path: ["do"], index: 1_000 });
    expect(placeBehind({ blocks, slots: [] }, null)).toBeNull();
  });
});

describe("parts", () => {
  const name = { holds: "named" as const, is_there: true, has_names: true, start: "", is_optional: false };
  const [a, b] = ["a", "b"].map((state) => ({ ...block(["machine", "states", state], 0, 1), kind: "state", name: state }));
  const step = { ...block(["machine", "states", "a", "do"], 0, 1), slots: [{ ...name, path: ["x", "else"], of: "step" as const, part: "else", is_there: false }] };
  a!.children.push(step);
  const slots = [
    { ...name, path: ["interrupts"], of: "interrupt" as const, part: "interrupt", is_there: false },
    { ...name, path: ["machine", "states"], of: "state" as const, part: "state" },
    { path: ["do"], holds: "one" as const, of: "step" as const, ...PART },
  ];
  const outline = { blocks: [a!, b!], slots };

  it("can be added to the chosen block first, behind it, else at the end", () => {
    expect(partsOf(outline, step).map(({ part, index }) => [part, index])).toEqual([["else", 1_000], ["interrupt", 1_000], ["state", 1]]);
    expect(partsOf(outline, b!).map(({ part, index }) => [part, index])).toEqual([["interrupt", 1_000], ["state", 2]]);
    expect(partsOf(outline, null).map(({ part, index }) => [part, index])).toEqual([["interrupt", 1_000], ["state", 1_000]]);
  });
});

describe("words", () => {
  it("counts mistakes", () => {
    expect(verdict({ errors: 0, count: 0 })).toBe("No mistakes");
    expect(verdict({ errors: 1, count: 3 })).toBe("1 error, 2 warnings");
  });

  it("tells what a line of a difference is", () => {
    expect(["@@ -1 +1 @@", "-a", "+b", " c"].map(kindOf)).toEqual(["place", "old", "new", "same"]);
  });

  it("searches by all words, names first", () => {
    const offered = [["check", "wait not"], ["wait", "some time"], ["wait_for", "a condition"]].map(
      ([word, about]) => ({ word, about, sort: "kind", yaml: "" }) as Offered,
    );
    expect(matching(offered, "wait").map(({ word }) => word)).toEqual(["wait", "wait_for", "check"]);
    expect(matching(offered, "time wait").map(({ word }) => word)).toEqual(["wait"]);
    expect(matching(offered, "")).toHaveLength(3);
  });
});
