import { describe, expect, it } from "vitest";
import { columns, numberAt, Rate, Series, shapeOf, writable } from "./data";

describe("a rate", () => {
  it("is that of the last seconds, and unknown before the second message", () => {
    const rate = new Rate();
    expect(rate.at(0)).toBeNull();
    for (let time = 0; time <= 1000; time += 100) rate.count(time);
    expect(rate.at(1000)).toBeCloseTo(10);
    expect(rate.at(9000)).toBeNull();
  });
});

describe("a number in a message", () => {
  it.each([
    [["a", "b"], 2],
    [["c", "1"], 4],
    [["d"], 1],
    [["e"], null],
    [["a", "x", "y"], null],
    [["f"], null],
  ])("at %j is %j", (path, value) => {
    expect(numberAt({ a: { b: 2 }, c: [3, 4], d: true, e: null, f: "1" }, path)).toBe(value);
  });
});

describe("series", () => {
  it("forget what is old", () => {
    const series = new Series(1000);
    for (const time of [0, 500, 1200]) series.add(time, time);
    expect(series.at(1200)).toEqual([[-0.7, 0], [500, 1200]]);
  });

  it("share their times, each with its own values", () => {
    const [one, two] = [new Series(), new Series()];
    one.add(0, 1);
    two.add(500, 2);
    one.add(1000, null);
    expect(columns([one, two], 1000)).toEqual([
      [-1, -0.5, 0],
      [1, undefined, null],
      [undefined, 2, undefined],
    ]);
  });
});

it("messages have one shape while only their values differ", () => {
  expect(shapeOf({ a: 1, b: ["x", "y"], c: {} })).toBe(shapeOf({ a: null, b: ["", "z"], c: {} }));
  expect(shapeOf({ b: ["x"] })).not.toBe(shapeOf({ b: ["x", "y"] }));
});

it("a message to publish has no header", () => {
  expect(JSON.parse(writable({ header: { frame_id: "map" }, x: 1 }))).toEqual({ x: 1 });
  expect(writable(null)).toBe("{}");
});
