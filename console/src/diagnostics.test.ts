import { describe, expect, it } from "vitest";
import { isFolded, learnChanges, levelOf, problems, spansOf, type Change, type TreeLine } from "./diagnostics";

const change = (number: number, time: number, old: number, to: number): Change => ({
  number,
  time,
  path: "/a",
  old,
  new: to,
  cause: `${number}`,
});

const line = (path: string, level: number, is_group = false): TreeLine => ({
  path,
  name: path.split("/").at(-1)!,
  depth: 0,
  is_group,
  level,
  message: "",
  hardware_id: "",
  values: [],
});

describe("diagnostics", () => {
  it("have a word and an icon for each level, and count what is unknown as stale", () => {
    expect([0, 1, 2, 3, 9].map((level) => levelOf(level).word)).toEqual(["OK", "Warning", "Error", "Stale", "Stale"]);
  });

  it("name problems once, errors first", () => {
    const lines = [line("/a", 2, true), line("/a/x", 1), line("/a/y", 2), line("/a/z", 0), line("/b/w", 3)];
    expect(problems(lines).map(({ path }) => path)).toEqual(["/a/y", "/a/x", "/b/w"]);
  });

  it("hide what is in a folded group, not the group itself", () => {
    const folded = new Set(["/power"]);
    expect(["/power", "/power/battery", "/power/cells/1", "/powerful"].map((path) => isFolded(path, folded))).toEqual([
      false,
      true,
      true,
      false,
    ]);
  });

  it("show the past as spans without gaps", () => {
    const spans = spansOf([change(1, 10, 0, 1), change(2, 20, 1, 2)], "/a", 0, 30, 2);
    expect(spans.map(({ from, to, level }) => [from, to, level])).toEqual([
      [0, 10, 0],
      [10, 20, 1],
      [20, 30, 2],
    ]);
    expect(spansOf([], "/a", 0, 30, 1)).toEqual([{ from: 0, to: 30, level: 1, cause: "" }]);
    expect(spansOf([change(1, 10, 0, 1)], "/a", 15, 30, 1).map(({ from }) => from)).toEqual([15]);
  });

  it("tell each change once, and of a robot that came up again only those of its new run", async () => {
    const robot = [change(1, 10, 0, 1), change(2, 20, 1, 2)];
    const list = (after: number) => Promise.resolve(robot.filter(({ number }) => number > after));
    let known = await learnChanges([], list);
    robot.push(change(3, 30, 2, 0));
    known = await learnChanges(known, list);
    expect(known).toEqual(robot);
    expect(await learnChanges(known, list)).toEqual(robot);
    for (const again of [[], [change(1, 2, 0, 2)], [1, 2, 3, 4].map((number) => change(number, 40 + number, 0, 1))]) {
      robot.splice(0, Infinity, ...again);
      expect(await learnChanges(known, list)).toEqual(again);
    }
  });
});
