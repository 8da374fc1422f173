import { expect, it } from "vitest";
import { ConfigError, parseConfig, pluck } from "./config";
import { chargeOf, formatAge, formatName, formatNumber, formatValue, numberIn } from "./format";

it.each<[number | null, string, string]>([
  [0.2, "m/s", "0.20"],
  [-0.2, "m/s", "\u22120.20"],
  [-0.001, "m/s", "0.00"],
  [null, "m/s", "\u2013"],
  [Number.NaN, "V", "\u2013"],
  [12.345, "V", "12.3"],
  [77.6, "%", "78"],
])("%s %s is written %s", (value, unit, text) => expect(formatNumber(value, unit)).toBe(text));

it("a unit stands beside its number, if there is one", () => {
  expect([formatValue(12, "V"), formatValue(80, "%"), formatValue(3, ""), formatValue(null, "V")]).toEqual([
    "12.0\u202fV",
    "80%",
    "3.00",
    "\u2013",
  ]);
});

it("a number is typed with a point or a comma, and nothing is none", () => {
  const texts = ["1.5", " 1,5 ", "-2", "0", "", " ", "1.2.3", "two"];
  expect(texts.map(numberIn)).toEqual([1.5, 1.5, -2, 0, NaN, NaN, NaN, NaN]);
});

it("names are words", () => {
  expect([formatName("base_battery"), formatName("/arm/load"), formatName("")]).toEqual([
    "Base battery",
    "Arm load",
    "",
  ]);
});

it("ages have one unit", () => {
  expect(
    [formatAge(-5), formatAge(1499), formatAge(61_000), formatAge(7_300_000)].map((age) => age.replace("\u202f", " ")),
  ).toEqual(["0 s", "1 s", "1 min", "2 h"]);
});

it("batteries are low up to 30 % and fair up to 50 %", () => {
  expect([0, 30, 30.1, 50, 50.1, 100].map(chargeOf)).toEqual(["low", "low", "fair", "fair", "good", "good"]);
});

it.each<[string, number | null]>([
  ["data", 1],
  ["cells[1].voltage", 4],
  ["cells[7].voltage", null],
  ["data.more", null],
  ["name", null],
])("the number at %s is %s", (field, value) => {
  expect(pluck({ data: 1, name: "x", cells: [{ voltage: 3 }, { voltage: 4 }] }, field)).toBe(value);
});

it("a configuration has defaults, and a robot without a base has no drive", () => {
  expect(parseConfig({})).toMatchObject({ robot: "robot", about: "", firstPage: "", drive: null, values: [], places: [] });
  const { drive, values, places } = parseConfig({
    drive: { topic: "/cmd", max_speed: null },
    values: { a: { topic: "/a" }, b: 3 },
    places: { dock: { x: 1, y: 2, heading: 0 }, lost: { x: 1 } },
  });
  expect(drive).toEqual({ topic: "/cmd", type: "geometry_msgs/Twist", maxSpeed: 0.5, maxTurnRate: 1 });
  expect(values).toEqual([{ name: "a", topic: "/a", type: "", field: "data", unit: "" }]);
  expect(places).toEqual([{ name: "dock", x: 1, y: 2, heading: 0, colour: "" }]);
});

it.each([null, [], "x", 3])("%j is no configuration", (json) => expect(() => parseConfig(json)).toThrow(ConfigError));
