import { describe, expect, it } from "vitest";
import { byPriority, swapped, type RankedRow } from "./muxes_editor";

const row = (name: string, priority: number | null): RankedRow => ({
  name,
  priority,
  group: "inputs",
  source: "",
  timeout: "1 s",
  file: "",
  why_not: "",
});
const rows = [row("low", 1), row("high", 9), row("middle", 5)];

describe("inputs of a mux", () => {
  it("stand with the highest priority first", () => {
    expect(byPriority(rows).map(({ name }) => name)).toEqual(["high", "middle", "low"]);
  });

  it("change places with the next one by changing their priorities", () => {
    expect(swapped(rows, rows[2]!, -1)).toEqual({ "inputs.middle.priority": 9, "inputs.high.priority": 5 });
    expect(swapped(rows, rows[2]!, 1)).toEqual({ "inputs.middle.priority": 1, "inputs.low.priority": 5 });
  });

  it("have nowhere to go at the ends, and without priorities", () => {
    expect(swapped(rows, rows[1]!, -1)).toBeNull();
    expect(swapped(rows, rows[0]!, 1)).toBeNull();
    expect(swapped([row("one", null), row("other", null)], row("one", null), 1)).toBeNull();
  });

  it("that are equal are told apart", () => {
    const equal = [row("one", 5), row("other", 5)];
    expect(swapped(equal, equal[1]!, -1)).toEqual({ "inputs.other.priority": 15 });
    expect(swapped(equal, equal[0]!, 1)).toEqual({ "inputs.one.priority": -5 });
  });
});
