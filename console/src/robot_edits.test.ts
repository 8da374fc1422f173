import { describe, expect, it } from "vitest";
import { withUnit } from "./edits_bar";
import { differing, freshName, rounded } from "./places_editor";
import { RobotEdits, withChange, type EditedRobot, type Entry, type RobotChange } from "./robot_edits";
import type { Json, LinkState, Message, Rosbridge } from "./rosbridge";
import { LostError } from "./rosbridge";
import { Signal } from "./signal";

const moved = (name: string, x: number): RobotChange => ({ op: "set", path: ["places", name], values: { x } });

/** A robot's editor that refuses places called "bad", and shows a place for each change. */
class FakeLink {
  readonly state = new Signal<LinkState>({ is: "open" } as LinkState);
  readonly asked: { service: string; args: Message }[] = [];
  hash = "1";
  fails: Error | null = null;

  async call(service: string, args: Message): Promise<Json> {
    this.asked.push({ service, args });
    await Promise.resolve();
    if (this.fails) throw this.fails;
    const changes = args.changes as unknown as RobotChange[];
    const known = (args.hashes as Message)["robot.yaml"];
    if (known !== undefined && known !== this.hash) return no("'robot.yaml' has changed on disk since it was opened: load it again");
    if (changes.some(({ path }) => path[1] === "bad")) return no("'bad' is no name");
    if (service === "/console/robot/save") {
      this.hash = `${this.hash}+`;
      return { success: true, message: "", answer: { files: ["robot.yaml"] } };
    }
    const entries = changes.map(({ path }) => ({ name: path[1], file: "robot.yaml", why_not: "" }));
    const rest = { file: "robot.yaml", why_not: "", findings: [], errors: 0, count: 0 };
    return { success: true, message: "", answer: { entries, hashes: { "robot.yaml": this.hash }, ...rest } };
  }
}

function no(message: string): Message {
  return { success: false, message, answer: null };
}

function edits(link: FakeLink): RobotEdits<Entry> {
  return new RobotEdits<Entry>(link as unknown as Rosbridge, "places");
}

const names = (one: RobotEdits<Entry>) => (one.robot.value as EditedRobot<Entry>).entries.map(({ name }) => name);

describe("changes of the robot", () => {
  it("are asked as a list from the beginning, and undone by a shorter one", async () => {
    const one = edits(new FakeLink());
    await one.open();
    expect(await one.change(moved("dock", 1))).toBe(true);
    await one.change(moved("table", 1));
    expect(names(one)).toEqual(["dock", "table"]);
    await one.undo();
    expect([names(one), one.canUndo, one.canRedo]).toEqual([["dock"], true, true]);
    await one.redo();
    expect([names(one), one.canRedo]).toEqual([["dock", "table"], false]);
  });

  it("are taken back if they are refused, and the others stay", async () => {
    const one = edits(new FakeLink());
    await one.open();
    await one.change(moved("dock", 1));
    expect(await one.change(moved("bad", 1))).toBe(false);
    expect([one.changes.length, names(one), one.says.value]).toEqual([1, ["dock"], "'bad' is no name"]);
  });

  it("that come while one is asked are asked together", async () => {
    const link = new FakeLink();
    const one = edits(link);
    await one.open();
    await Promise.all([1, 2, 3, 4].map((x) => one.change(moved("dock", x), true)));
    expect(one.changes).toEqual([moved("dock", 4)]);
    expect(link.asked.length).toBe(3); // to read, the first step, and the last one
  });

  it("stay without an answer, and are asked again", async () => {
    const link = new FakeLink();
    const one = edits(link);
    await one.open();
    link.fails = new Error("not connected");
    expect(await one.change(moved("dock", 1))).toBe(false);
    link.fails = null;
    await one.open();
    expect(names(one)).toEqual(["dock"]);
  });

  it("are made to the newest files after somebody else saved", async () => {
    const link = new FakeLink();
    const one = edits(link);
    await one.open();
    link.hash = "theirs";
    await one.change(moved("dock", 1));
    expect(one.isStale.value).toBe(true);
    await one.reload();
    expect([one.isStale.value, names(one)]).toEqual([false, ["dock"]]);
  });

  it("are gone when they were saved", async () => {
    const one = edits(new FakeLink());
    await one.open();
    await one.change(moved("dock", 1));
    await one.save();
    expect([one.canUndo, one.canRedo]).toEqual([false, false]);
    expect(one.says.value).toContain("Saved in robot.yaml");
  });

  it("are known to be saved or not when a lost connection is back", async () => {
    const link = new FakeLink();
    const one = edits(link);
    await one.open();
    await one.change(moved("dock", 1));
    link.fails = new LostError("lost");
    await one.save();
    expect(one.says.value).toContain("known when it is back");
    link.fails = null;
    link.state.set({ is: "lost" } as LinkState);
    link.state.set({ is: "open" } as LinkState);
    await new Promise((resolve) => setTimeout(resolve));
    expect([one.says.value, one.canUndo]).toEqual(["The connection is back: it was not saved. Save it again.", true]);
  });

  it("of one place become one if they are small steps", () => {
    const first = withChange([], moved("dock", 1));
    expect(withChange(first, moved("dock", 2), true)).toEqual([moved("dock", 2)]);
    expect(withChange(first, moved("dock", 2))).toHaveLength(2);
    expect(withChange(first, moved("table", 2), true)).toHaveLength(2);
  });
});

describe("places", () => {
  it("are put to centimetres and degrees", () => {
    expect(rounded({ x: 1.23456, y: -0.001, heading: Math.PI / 2 + 0.001 })).toEqual({ x: 1.23, y: 0, heading: Math.PI / 2 });
  });

  it("say only what changed", () => {
    expect(differing({ x: 1, y: 2, heading: 0 }, { x: 1, y: 3, heading: 0 })).toEqual({ y: 3 });
  });

  it("get a name that is free", () => {
    expect(freshName(["place_1", "dock"])).toBe("place_2");
  });

  it("have a unit if none was typed", () => {
    expect(["1.5", "-.5", "\u22122", "1.5 m", "90 deg", "x", ""].map((text) => withUnit(text, "m"))).toEqual([
      "1.5 m",
      "-.5 m",
      "-2 m",
      "1.5 m",
      "90 deg",
      "x",
      "",
    ]);
  });
});
