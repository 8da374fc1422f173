import { afterEach, describe, expect, it, vi } from "vitest";
import { Changes, limitsOf, parameterOf, parsed, Sender, settingOf, shownOf, slideOf, textOf, valueOf, type Setting, type Value } from "./parameters";

const descriptor = (more: object) => ({
  name: "runtime",
  type: 3,
  description: "Time from full to empty. [s]",
  additional_constraints: "greater than 0 s",
  read_only: false,
  floating_point_range: [{ from_value: 5e-324, to_value: null, step: 0 }],
  integer_range: [],
  ...more,
});
const setting = (more: object = {}): Setting => settingOf("/battery", descriptor(more) as never)!;

describe("a setting", () => {
  it("has its limits in words", () => {
    expect(limitsOf(setting())).toBe("from 0 s");
    const range = (from_value: number | null, to_value: number | null) => setting({ floating_point_range: [{ from_value, to_value, step: 0 }] });
    expect(limitsOf(range(1, 7200))).toBe("1 s to 7200 s");
    expect(limitsOf(range(null, 5))).toBe("up to 5 s");
    expect(limitsOf(setting({ floating_point_range: [] }))).toBe("");
  });

  it("has the unit and the limits of its description", () => {
    expect(setting()).toMatchObject({ about: "Time from full to empty.", unit: "s", least: 0, most: null });
  });

  it("shows shares in percent and angles in degrees, and sends SI", () => {
    const share = setting({ description: "Below this it warns. [0 to 1]", floating_point_range: [{ from_value: 0, to_value: 1 }] });
    expect(share).toMatchObject({ unit: "%", least: 0, most: 100 });
    expect(shownOf(share, 0.2)).toBe(20);
    expect(parsed(share, "20", 0.5)).toEqual({ value: 0.2 });
    const turn = setting({ description: "Largest turn rate. [rad/s]" });
    expect(turn.unit).toBe("\u00b0/s");
    expect(shownOf(turn, Math.PI / 2)).toBe(90);
  });

  it("keeps the digits of a value that is shown with fewer", () => {
    const turn = setting({ description: "Largest turn rate. [rad/s]" });
    const sent = { type: 3, double_value: 2 };
    expect(parameterOf(turn, valueOf(turn, sent)!)).toEqual({ name: "runtime", value: sent });
    expect(textOf(turn, 2)).toBe("114.592");
    expect(parsed(turn, "114.592", 2)).toEqual({ value: 2 });
  });

  it("has the words that it may be", () => {
    const profile = setting({ type: 4, additional_constraints: "one of modern, ros1", description: "Rules." });
    expect(profile).toMatchObject({ choices: ["modern", "ros1"], unit: "", about: "Rules." });
  });

  it("is none if no control fits its type", () => expect(settingOf("/x", descriptor({ type: 9 }) as never)).toBeNull());

  it.each([
    ["45", { value: 45 }],
    ["4,5", { value: 4.5 }],
    ["", { why: "This is no number." }],
    ["-1", { why: "At least 0 s." }],
  ])("reads %j", (text, result) => expect(parsed(setting(), text, 1)).toEqual(result));
});

describe("a slider", () => {
  it("reaches from limit to limit, or to twice what is set now", () => {
    expect(slideOf(setting(), 45)).toEqual({ least: 0, most: 100, step: 1 });
    expect(slideOf(setting({ floating_point_range: [{ from_value: 0.1, to_value: 0.5 }] }), 0.3)).toMatchObject({ least: 0.1, most: 0.5 });
    expect(slideOf(setting({ type: 2, floating_point_range: [], integer_range: [{ from_value: 0, to_value: 9, step: 0 }] }), 3)).toEqual({ least: 0, most: 9, step: 1 });
  });

  it("is none without any limit, and for texts", () => {
    expect(slideOf(setting({ floating_point_range: [] }), 3)).toBeNull();
    expect(slideOf(setting({ type: 4 }), 3)).toBeNull();
  });
});

it("slides in the unit that is shown", () => {
  const share = setting({ description: "It warns. [0 to 1]", floating_point_range: [{ from_value: 0, to_value: null }] });
  expect(slideOf(share, 0.4)).toMatchObject({ least: 0, most: 100 });
});

describe("what can be taken back", () => {
  const changes = () => {
    const one = { value: 0.5 as Value, isSending: false };
    const known = new Map([["one", one]]);
    const kept = new Changes((key) => known.get(key));
    const set = (value: Value) => {
      kept.put("one", one.value);
      one.value = value;
    };
    return { one, known, kept, set };
  };

  it("is what was changed before the page was opened again, as long as the robot has it", () => {
    const { known, kept, set } = changes();
    set(0.4);
    known.set("one", { value: 0.4, isSending: false });
    expect(kept.isEmpty).toBe(false);
    known.clear();
    expect(kept.isEmpty).toBe(true);
  });

  it("is what was taken, without what was refused", () => {
    const { one, kept, set } = changes();
    set(0.4);
    set(0);
    one.value = 0.4; // refused
    expect(kept.takeBack()).toEqual({ key: "one", before: 0.5 });
    expect(kept.isEmpty).toBe(true);
  });

  it("is one change of a slider that moves", () => {
    const { one, kept, set } = changes();
    set(0.4);
    one.isSending = true;
    set(0.3);
    expect(kept.takeBack()).toEqual({ key: "one", before: 0.5 });
    expect(kept.isEmpty).toBe(true);
  });

  it("is nothing after the only change was refused", () => {
    const { one, kept, set } = changes();
    set(0);
    expect(kept.isEmpty).toBe(false);
    one.value = 0.5;
    expect(kept.isEmpty).toBe(true);
  });
});

describe("a sender", () => {
  afterEach(() => vi.useRealTimers());

  it("sends the first and the last of a flood, and few between", async () => {
    vi.useFakeTimers();
    const sent: Value[] = [];
    const sender = new Sender(async (value) => void sent.push(value), 200);
    for (let value = 0; value <= 100; value += 1) {
      sender.put(value);
      await vi.advanceTimersByTimeAsync(10);
    }
    await vi.advanceTimersByTimeAsync(1000);
    expect(sent[0]).toBe(0);
    expect(sent.at(-1)).toBe(100);
    expect(sent.length).toBeLessThanOrEqual(7);
    expect(sender.isBusy).toBe(false);
  });
});
