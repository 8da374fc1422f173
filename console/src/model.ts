/** The robot's body as its page shows it: joints with limits in units for people, and what moves them. */
import type { Component } from "./description";
import { Sender } from "./parameters";
import { isMessage, SUCCEEDED, type Json, type Message, type Rosbridge } from "./rosbridge";

const PAUSE = 150; // [ms] between two goals of a mover

/** What a URDF says of a joint that can be moved. */
export interface JointLimits {
  name: string;
  kind: "revolute" | "continuous" | "prismatic";
  lower: number;
  upper: number;
}

/** A joint with its slider; values are [deg] or [mm], `scale` times one is [rad] or [m]. */
export interface JointSlider {
  name: string;
  unit: string;
  scale: number;
  least: number;
  most: number;
  step: number;
}

/** Returns the slider of a joint: what turns without end has one from -180 to 180 degrees. */
export function sliderOf({ name, kind, lower, upper }: JointLimits): JointSlider {
  if (kind === "prismatic") return { name, unit: "mm", scale: 0.001, least: lower * 1000, most: upper * 1000, step: 0.5 };
  const scale = Math.PI / 180;
  const endless = kind === "continuous" || !(upper > lower);
  const [least, most] = endless ? [-180, 180] : [lower / scale, upper / scale];
  return { name, unit: "\u00b0", scale, least: rounded(least, Math.ceil), most: rounded(most, Math.floor), step: 0.5 };
}

/** Rounds a limit inwards to a tenth, unless that is only a rounding error. */
function rounded(value: number, to: (value: number) => number): number {
  const near = Math.round(value * 10) / 10;
  return Math.abs(near - value) < 1e-6 ? near : to(value * 10) / 10;
}

/** Returns positions at random within the limits of the sliders [rad, m], a joint by its name. */
export function randomized(sliders: readonly JointSlider[], random: () => number = Math.random): Record<string, number> {
  return Object.fromEntries(sliders.map(({ name, least, most, scale }) => [name, (least + (most - least) * random()) * scale]));
}

/** Returns the middle of each joint's range, or 0 where that is within it, as `joint_state_publisher` does. */
export function centred(sliders: readonly JointSlider[]): Record<string, number> {
  return Object.fromEntries(
    sliders.map(({ name, least, most, scale }) => [name, least <= 0 && most >= 0 ? 0 : ((least + most) / 2) * scale]),
  );
}

/** An action that moves joints, by their names in its goals. */
export interface Mover {
  action: string;
  type: string;
  /** The name of a joint in a goal, by its name in the body. */
  names: Map<string, string>;
}

const MOVES = "rbxcompose_msgs/action/MoveJoints";

/** Returns what moves joints: actions whose bounds say which joints their goals have. */
export function moversOf(components: readonly Component[]): Mover[] {
  return components.flatMap(({ ports, capabilities }) =>
    (capabilities.BoundsGoals ?? []).flatMap(({ goals, joints }) => {
      const port = ports.find(({ name }) => name === goals);
      if (!port || port.type !== MOVES || !isMessage(joints ?? null)) return [];
      const names = Object.entries(joints as Message).map(([argument, joint]) => [String(joint), argument] as const);
      return [{ action: port.topic, type: port.type, names: new Map(names) }];
    }),
  );
}

/** Sends the goals of a mover. The robot ends a goal for a newer one: each has all joints that are still on their way. */
export class JointDrive {
  readonly #sender: Sender<Record<string, number>>;
  #way: Record<string, number> = {};

  /** `ended` takes the joints of the newest goal once it has ended, and why they are not where they were to be, or "". */
  constructor(link: Pick<Rosbridge, "act">, { action, type, names }: Mover, ended: (joints: string[], why: string) => void) {
    this.#sender = new Sender(async (way) => {
      const end = (why: string) => {
        if (this.#way !== way) return; // a newer goal says how it ends
        this.#way = {};
        ended(Object.keys(way), why);
      };
      const goal = { joints: Object.keys(way).map((name) => names.get(name)!), positions: Object.values(way) };
      link.act(action, type, goal).done.then(
        ({ status, values }) => end(status === SUCCEEDED ? "" : reason(values) || "canceled"),
        (error: Error) => end(error.message),
      );
    }, PAUSE);
  }

  /** Moves joints to positions [rad, m], by their names in the body. */
  move(positions: Record<string, number>): void {
    this.#way = { ...this.#way, ...positions };
    this.#sender.put(this.#way);
  }
}

/** Returns why something failed, of a text or of what has one. */
export function reason(answer: Json): string {
  if (typeof answer === "string") return answer;
  if (!isMessage(answer)) return "";
  const code = answer.error_code ?? null;
  return String((isMessage(code) ? code.message : undefined) ?? answer.message ?? "");
}

/** An arm whose tip can be brought to a pose. */
export interface Arm {
  name: string;
  locate: string;
  inverse: string;
  plan: string;
  execute: string;
}

/** Returns the arms: what answers where its tip is, solves for poses, plans and executes. */
export function armsOf(components: readonly Component[]): Arm[] {
  return components.flatMap(({ name, ports }) => {
    const topicOf = (type: string) => ports.find((port) => port.type === type && port.kind.startsWith("serves"))?.topic;
    const [locate, inverse] = [topicOf("rbxcompose_msgs/srv/LocateArm"), topicOf("moveit_msgs/srv/GetPositionIK")];
    const [plan, execute] = [topicOf("moveit_msgs/action/MoveGroup"), topicOf("moveit_msgs/action/ExecuteTrajectory")];
    return locate && inverse && plan && execute ? [{ name, locate, inverse, plan, execute }] : [];
  });
}

/** Returns a goal of MoveGroup that only plans: to positions of joints [rad, m]. */
export function planOf(positions: Record<string, number>): Message {
  const joint_constraints = Object.entries(positions).map(([joint_name, position]) => ({
    joint_name,
    position,
    tolerance_above: 0.001,
    tolerance_below: 0.001,
    weight: 1,
  }));
  return {
    request: { goal_constraints: [{ joint_constraints }], allowed_planning_time: 5, num_planning_attempts: 1 },
    planning_options: { plan_only: true },
  };
}

/** Positions of joints at a time of a trajectory [s]. */
export interface Waypoint {
  time: number;
  positions: Record<string, number>;
}

/** Returns the way of `moveit_msgs/RobotTrajectory`; empty if there is none. */
export function wayOf(trajectory: Json | undefined): Waypoint[] {
  const joint = isMessage(trajectory ?? null) ? (trajectory as Message).joint_trajectory : null;
  if (!isMessage(joint ?? null)) return [];
  const { joint_names, points } = joint as Message;
  if (!Array.isArray(joint_names) || !Array.isArray(points)) return [];
  return points.flatMap((point) => {
    if (!isMessage(point) || !Array.isArray(point.positions) || !isMessage(point.time_from_start ?? null)) return [];
    const { sec, nanosec } = point.time_from_start as Message;
    const values = point.positions;
    return [{ time: Number(sec) + Number(nanosec) / 1e9, positions: Object.fromEntries(joint_names.map((name, at) => [String(name), Number(values[at])])) }];
  });
}

/** Returns where joints are on a way after a time [s], between two waypoints in proportion; null on an empty way. */
export function onWay(way: readonly Waypoint[], time: number): Record<string, number> | null {
  const after = way.findIndex((point) => point.time >= time);
  if (way.length === 0) return null;
  if (after < 0) return way.at(-1)!.positions;
  const [to, from] = [way[after]!, way[after - 1]];
  if (!from || to.time <= from.time) return to.positions;
  const share = (time - from.time) / (to.time - from.time);
  return Object.fromEntries(Object.entries(to.positions).map(([name, value]) => [name, (from.positions[name] ?? value) * (1 - share) + value * share]));
}

/** Returns the positions of `sensor_msgs/JointState`, by name. */
export function positionsOf(state: Json | undefined): Record<string, number> {
  if (!isMessage(state ?? null)) return {};
  const { name, position } = state as Message;
  if (!Array.isArray(name) || !Array.isArray(position)) return {};
  return Object.fromEntries(name.map((joint, at) => [String(joint), position[at]]).filter((pair): pair is [string, number] => typeof pair[1] === "number"));
}

/** `geometry_msgs/Pose`. */
export interface RosPose {
  position: { x: number; y: number; z: number };
  orientation: { x: number; y: number; z: number; w: number };
}

/** A shape of a thing: [m] x, y, z of a box; radius and length of the others. */
export interface Shape {
  kind: string;
  size: number[];
  pose: RosPose;
}

/** A thing of the planning scene, in the frame of a link of the body. */
export interface Thing {
  name: string;
  link: string;
  pose: RosPose;
  shapes: Shape[];
}

/** Returns the things of `rbxcompose_msgs/SceneObjects`. */
export function thingsOf(scene: Json): Thing[] {
  return isMessage(scene) && Array.isArray(scene.objects) ? (scene.objects as unknown as Thing[]) : [];
}
