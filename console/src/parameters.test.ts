import { afterEach, describe, expect, it, vi } from "vitest";
import { limitsOf, parameterOf, parsed, Sender, settingOf, slideOf, valueOf, type Setting, type Value } from "./parameters";

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
    expect(valueOf(share, { type: 3, double_value: 0.2 })).toBe(20);
    expect(parameterOf(share, 20)).toEqual({ name: "runtime", value: { type: 3, double_value: 0.2 } });
    const turn = setting({ description: "Largest turn rate. [rad/s]" });
    expect(turn.unit).toBe("\u00b0/s");
    expect(valueOf(turn, { type: 3, double_value: Math.PI / 2 })).toBe(90);
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
  ])("reads %j", (text, result) => expect(parsed(setting(), text)).toEqual(result));
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
