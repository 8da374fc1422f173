import { afterEach, describe, expect, it, vi } from "vitest";
import type { Component } from "./description";
import { armsOf, centred, JointDrive, moversOf, onWay, planOf, positionsOf, randomized, sliderOf, wayOf } from "./model";
import type { Message, Outcome } from "./rosbridge";

const port = (name: string, kind: string, topic: string, type: string) =>
  ({ name, kind, topic, type, unit: "", skill: "", is_command: false, claims: "", is_pausable: false, measures: {}, choices: {}, outcomes: {} }) as const;
const SERVOS: Component = {
  name: "servos",
  type: "servo_bus",
  about: "",
  process: "servos",
  ports: [port("head_move", "serves_action", "/head/move", "rbxcompose_msgs/action/MoveJoints")],
  capabilities: { BoundsGoals: [{ goals: "head_move", joints: { pan: "head_pan_joint" } }, { goals: "grip", joints: null }] },
  requests: {},
};

describe("a joint's slider", () => {
  it("is in degrees within the limits", () => {
    const slider = sliderOf({ name: "pan", kind: "revolute", lower: -1.75, upper: Math.PI / 2 });
    expect(slider).toMatchObject({ unit: "\u00b0", least: -100.2, most: 90 });
    expect(slider.least * slider.scale).toBeGreaterThanOrEqual(-1.75);
  });
  it("is in millimetres where a joint slides, and a whole turn where it has no end", () => {
    expect(sliderOf({ name: "a", kind: "prismatic", lower: 0, upper: 0.05 })).toMatchObject({ unit: "mm", least: 0, most: 50 });
    expect(sliderOf({ name: "a", kind: "continuous", lower: 0, upper: 0 })).toMatchObject({ least: -180, most: 180 });
  });
  it("knows a middle and random places", () => {
    const sliders = [sliderOf({ name: "a", kind: "revolute", lower: -1, upper: 1 }), sliderOf({ name: "b", kind: "prismatic", lower: 0.1, upper: 0.3 })];
    expect(centred(sliders)).toEqual({ a: 0, b: expect.closeTo(0.2) });
    expect(randomized(sliders, () => 1).b).toBeCloseTo(0.3);
  });
});

describe("what moves", () => {
  it("is found by what components declare", () => {
    const [mover] = moversOf([SERVOS]);
    expect(mover).toMatchObject({ action: "/head/move" });
    expect(mover!.names.get("head_pan_joint")).toBe("pan");
  });
  it("is an arm only if it can be located, solved, planned and executed", () => {
    const ports = [
      port("locate", "serves", "/arm/locate", "rbxcompose_msgs/srv/LocateArm"),
      port("ik", "serves", "/arm/ik", "moveit_msgs/srv/GetPositionIK"),
      port("plan", "serves_action", "/arm/plan", "moveit_msgs/action/MoveGroup"),
      port("go", "serves_action", "/arm/go", "moveit_msgs/action/ExecuteTrajectory"),
    ];
    expect(armsOf([{ ...SERVOS, name: "arm", ports }])).toEqual([{ name: "arm", locate: "/arm/locate", inverse: "/arm/ik", plan: "/arm/plan", execute: "/arm/go" }]);
    expect(armsOf([{ ...SERVOS, ports: ports.slice(1) }])).toEqual([]);
  });
});

describe("joints that are moved by goals", () => {
  afterEach(() => vi.useRealTimers());
  const mover = { action: "/head/move", type: "rbxcompose_msgs/action/MoveJoints", names: new Map([["pan_joint", "pan"], ["tilt_joint", "tilt"]]) };

  function make() {
    vi.useFakeTimers();
    const goals: { goal: Message; end(outcome: Outcome): void }[] = [];
    const act = (_action: string, _type: string, goal: Message) => {
      const done = new Promise<Outcome>((end) => goals.push({ goal, end }));
      return { done, cancel: () => undefined };
    };
    const ended: [joints: string[], why: string][] = [];
    const drive = new JointDrive({ act }, mover, (joints, why) => void ended.push([joints, why]));
    return { drive, goals, ended, later: () => vi.advanceTimersByTimeAsync(1000) };
  }

  it("go in one goal, and a newer goal keeps those that are still on their way", async () => {
    const { drive, goals, ended, later } = make();
    drive.move({ pan_joint: 1, tilt_joint: 0.5 });
    await later();
    expect(goals.map(({ goal }) => goal)).toEqual([{ joints: ["pan", "tilt"], positions: [1, 0.5] }]);
    drive.move({ tilt_joint: -0.5 });
    goals[0]!.end({ status: 6, values: "replaced by a newer goal" });
    await later();
    expect(goals[1]!.goal).toEqual({ joints: ["pan", "tilt"], positions: [1, -0.5] });
    expect(ended).toEqual([]);
    goals[1]!.end({ status: 4, values: {} });
    await later();
    expect(ended).toEqual([[["pan_joint", "tilt_joint"], ""]]);
    drive.move({ tilt_joint: 0 });
    await later();
    expect(goals[2]!.goal).toEqual({ joints: ["tilt"], positions: [0] });
  });

  it("say which of them are not where they were to be, and why", async () => {
    const { drive, goals, ended, later } = make();
    drive.move({ pan_joint: 1 });
    goals[0]!.end({ status: 6, values: { message: "blocked" } });
    await later();
    expect(ended).toEqual([[["pan_joint"], "blocked"]]);
  });
});

describe("a way", () => {
  const way = wayOf({
    joint_trajectory: {
      joint_names: ["a"],
      points: [
        { positions: [0], time_from_start: { sec: 0, nanosec: 0 } },
        { positions: [1], time_from_start: { sec: 2, nanosec: 0 } },
      ],
    },
  });
  it("is between its waypoints", () => {
    expect(onWay(way, 0.5)).toEqual({ a: 0.25 });
    expect(onWay(way, 9)).toEqual({ a: 1 });
    expect(onWay([], 0)).toBeNull();
    expect(wayOf({})).toEqual([]);
  });
});

it("plans to joints without moving", () => {
  const goal = planOf({ a: 0.5 }) as { planning_options: { plan_only: boolean } };
  expect(goal.planning_options.plan_only).toBe(true);
});

it("reads joint states, and leaves out what is unknown", () => {
  expect(positionsOf({ name: ["a", "b"], position: [1, null] })).toEqual({ a: 1 });
  expect(positionsOf(null)).toEqual({});
});
