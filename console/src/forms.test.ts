import { describe, expect, it } from "vitest";
import { fieldsOf, leavesOf, messageOf, NO_HINTS, type TypeDef } from "./forms";
import { unitsIn } from "./units";

const GOAL: TypeDef[] = [
  { type: "demo/Reach_Goal", fieldnames: ["tip", "speed", "pose", "keep", "names"], fieldtypes: ["demo/Tip", "float64", "string", "bool", "string"], fieldarraylen: [-1, -1, -1, -1, 0] },
  { type: "demo/Tip", fieldnames: ["header", "x", "yaw", "wait"], fieldtypes: ["std_msgs/msg/Header", "float64", "float64", "builtin_interfaces/msg/Duration"], fieldarraylen: [-1, -1, -1, -1] },
  { type: "std_msgs/Header", fieldnames: ["stamp", "frame_id"], fieldtypes: ["builtin_interfaces/Time", "string"], fieldarraylen: [-1, -1] },
];
const HINTS = { ...NO_HINTS, measures: { tip: { x: "m", yaw: "rad" }, speed: "0 to 1" }, choices: { pose: ["home", "wave"] } };

describe("a form", () => {
  const fields = fieldsOf(GOAL, "demo/action/Reach_Goal", HINTS);

  it("has a field for each number and text, with unit, limits and words", () => {
    expect(fields.map(({ path, kind, unit }) => [path.join("."), kind, unit])).toEqual([
      ["tip.header.frame_id", "text", ""],
      ["tip.x", "number", "m"],
      ["tip.yaw", "number", "\u00b0"],
      ["tip.wait", "duration", "s"],
      ["speed", "number", ""],
      ["pose", "text", ""],
      ["keep", "boolean", ""],
      ["names", "json", ""],
    ]);
    expect(fields[4]).toMatchObject({ least: 0, most: 1 });
    expect(fields[5]!.choices).toEqual(["home", "wave"]);
  });

  it("makes the message, angles in radians", () => {
    const values = ["map", "1,5", "180", "1.5", "0.5", "wave", "true", '["a"]'];
    expect(messageOf(fields, values)).toEqual({
      tip: { header: { frame_id: "map" }, x: 1.5, yaw: Math.PI, wait: { sec: 1, nanosec: 500_000_000 } },
      speed: 0.5,
      pose: "wave",
      keep: true,
      names: ["a"],
    });
  });

  it.each([
    [1, "far", "tip x: this is no number"],
    [1, "", "tip x: this is no number"],
    [4, "2", "speed: at most 1"],
    [7, "[", "names: this is no JSON"],
  ])("names the field that is wrong", (at, text, reason) => {
    const values = fields.map(({ value }) => value);
    values[at] = text;
    expect(() => messageOf(fields, values)).toThrow(reason);
  });

  it("gives the only number of a request the unit of its port, within the limits of that", () => {
    const level = [{ type: "demo/SetLevel_Request", fieldnames: ["value"], fieldtypes: ["float32"], fieldarraylen: [-1] }];
    const [value] = fieldsOf(level, "demo/SetLevel", { ...NO_HINTS, unit: "%" });
    expect(value).toMatchObject({ unit: "%", least: 0, most: 100 });
  });

  it("takes a rotation as three angles", () => {
    const turn = [{ type: "a/Turn", fieldnames: ["to"], fieldtypes: ["geometry_msgs/Quaternion"], fieldarraylen: [-1] }];
    const angles = fieldsOf(turn, "a/Turn");
    expect(angles.map(({ path, unit }) => [path.at(-1), unit])).toEqual([["roll", "\u00b0"], ["pitch", "\u00b0"], ["yaw", "\u00b0"]]);
    const { to } = messageOf(angles, ["0", "0", "90"]) as { to: Record<string, number> };
    expect(to.z).toBeCloseTo(Math.SQRT1_2);
    expect(to.w).toBeCloseTo(Math.SQRT1_2);
    expect(Object.keys(to).sort()).toEqual(["w", "x", "y", "z"]);
  });

  it("has the units of standard types, unless the robot says others", () => {
    const number = (type: string, ...fieldnames: string[]) => ({ type, fieldnames, fieldtypes: fieldnames.map(() => "float64"), fieldarraylen: fieldnames.map(() => -1) });
    const types = [
      { type: "a/Go_Goal", fieldnames: ["to", "twist", "other"], fieldtypes: ["geometry_msgs/msg/Point", "geometry_msgs/msg/Twist", "geometry_msgs/msg/Point"], fieldarraylen: [-1, -1, -1] },
      number("geometry_msgs/Point", "x"),
      { type: "geometry_msgs/Twist", fieldnames: ["linear", "angular"], fieldtypes: ["geometry_msgs/Vector3", "geometry_msgs/Vector3"], fieldarraylen: [-1, -1] },
      number("geometry_msgs/Vector3", "x"),
    ];
    const fields = fieldsOf(types, "a/Go_Goal", { ...NO_HINTS, measures: { other: { x: "%" } } });
    expect(fields.map(({ unit }) => unit)).toEqual(["m", "m/s", "\u00b0/s", "%"]);
  });

  it("ends with a type that contains itself", () => {
    const loop = [{ type: "a/A", fieldnames: ["a"], fieldtypes: ["a/A"], fieldarraylen: [-1] }];
    expect(fieldsOf(loop, "a/A")).toHaveLength(1);
  });
});

describe("the leaves of a message", () => {
  it("are its values, counted and without its header", () => {
    const message = { header: { frame_id: "x" }, a: { b: 1, c: ["u", "v"], none: "", empty: [] }, d: "e", f: true };
    expect(leavesOf(message, 3)).toEqual([["a b", 1, ""], ["a c", "2 items", ""], ["d", "e", ""]]);
  });

  it("have the units that standard types have", () => {
    const odometry = { pose: { pose: { position: { x: 1 } } }, twist: { twist: { linear: { x: 0.3 }, angular: { z: 1 } } } };
    expect(leavesOf(odometry, 6, unitsIn("nav_msgs/msg/Odometry")).map(([, , unit]) => unit)).toEqual(["m", "m/s", "rad/s"]);
    expect(leavesOf({ voltage: 12, present: true }, 6, unitsIn("sensor_msgs/BatteryState"))).toEqual([["voltage", 12, "V"], ["present", true, ""]]);
  });

  it("are the numbers of a short list, with the names that a message has for them", () => {
    const many = Array.from({ length: 40 }, () => 0);
    expect(leavesOf({ name: ["head_pan_joint", "tilt"], position: [0.5, -1], effort: [null, null] }, 6)).toEqual([["position", ["head pan 0.50", "tilt \u22121.00"], ""]]);
    expect(leavesOf({ data: [1, 2], many }, 6)).toEqual([["data", [1, 2], ""], ["many", "40 items", ""]]);
  });
});
