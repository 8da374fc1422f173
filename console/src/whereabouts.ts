/** Where a robot is, by the transforms and the odometry that it publishes. */
import type { Component } from "./description";
import { frameOf, Frames, plain, poseOf, readTransform, readTransforms, type Pose } from "./map";
import { isMessage, type Message, type Rosbridge } from "./rosbridge";

const ODOMETRY = 100; // [ms] between two messages
const BASES = ["base_footprint", "base_link"]; // of robots that publish no odometry

export class Whereabouts {
  readonly frames = new Frames();
  pose: Pose | null = null;
  /** The frame of the pose: `map` if transforms lead there. */
  fixed = "map";
  /** When the pose came [ms]. */
  seenAt = -Infinity;
  /** Of the newest transform [s]. */
  stamp = 0;
  readonly #published = new Set<string>(); // frames whose transforms are published
  readonly #moved: () => void;
  #base = "";
  #odometry = ""; // the topic of the base that drives; there may be others

  /** `moved` is called after each message. */
  constructor(moved: () => void = () => undefined) {
    this.#moved = moved;
  }

  learn(components: readonly Component[]): void {
    const drives = components.flatMap(({ ports, capabilities }) => ports.filter(({ name }) => name === capabilities.Drives?.[0]?.odometry));
    this.#odometry = drives[0]?.topic ?? "";
  }

  /** Subscribes to a topic that tells where the robot is, and returns what ends that; null if it does not tell. */
  follow(link: Rosbridge, topic: string, type: string): (() => void) | null {
    const kind = type.split("/").at(-1);
    if (kind === "TFMessage") return link.subscribe(topic, (message) => this.takeTransforms(topic, message), { type });
    if (kind !== "Odometry") return null;
    return link.subscribe(topic, (message) => this.takeOdometry(topic, message), { type, throttle: ODOMETRY });
  }

  takeTransforms(topic: string, message: Message): void {
    const above = this.frames.above(this.#baseFrame());
    for (const { parent, child, transform, stamp } of readTransforms(message)) {
      if (!topic.endsWith("tf_static")) this.stamp = stamp;
      this.frames.set(parent, child, transform);
      this.#published.add(child);
      if (above.has(child)) this.seenAt = performance.now();
    }
    this.#place();
  }

  /** Takes the pose of an odometry for a transform, unless somebody publishes that as well. */
  takeOdometry(topic: string, message: Message): void {
    const child = plain(String(message.child_frame_id ?? ""));
    const transform = isMessage(message.pose) ? readTransform(message.pose.pose) : null;
    if (!child || !transform) return;
    if (!this.#base || topic === this.#odometry) this.#base = child;
    this.seenAt = performance.now();
    if (!this.#published.has(child)) this.frames.set(frameOf(message), child, transform);
    this.#place();
  }

  #baseFrame(): string {
    return this.#base || (BASES.find((frame) => this.frames.has(frame)) ?? "");
  }

  #place(): void {
    const base = this.#baseFrame();
    if (!this.frames.has(base)) return;
    this.fixed = this.frames.fixedFor(base);
    const transform = this.frames.lookUp(this.fixed, base);
    this.pose = transform && poseOf(transform);
    this.#moved();
  }
}
