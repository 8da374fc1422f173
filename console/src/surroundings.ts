/** The robot in its world, on its page in 3D: a switch, and what is fetched and drawn while it is on. */
import type { Component } from "./description";
import { h } from "./dom";
import type { RobotScene } from "./elements/robot_scene";
import { applied, composed, frameOf, Frames, poseOf, readScan, readTransforms } from "./map";
import { remember, wasOn } from "./remembered";
import type { Message, Rosbridge } from "./rosbridge";
import { readThings } from "./seen";
import { movedTopicOf, readRobots, readWorld, robotsTopicOf, worldTopicOf, type World } from "./world";

const SWITCH = "model.world";
const SCAN = "sensor_msgs/msg/LaserScan";
const THINGS = "vision_msgs/msg/Detection3DArray";
const ROBOTS = "rbxcompose_msgs/msg/WorldRobots";
const TRANSFORMS = "tf2_msgs/msg/TFMessage";
const SCANS = 100; // [ms] between two scans
const MAP = "map";

export class Surroundings {
  /** A switch and a view, hidden if the robot has no world. */
  readonly element = h("div", { class: "row" });
  readonly #link: Rosbridge;
  readonly #scene: RobotScene;
  readonly #isOn = h("input", { id: "world", type: "checkbox" });
  readonly #whole = h("button", { type: "button", "aria-label": "All of the world" }, "All");
  #topics = { world: "", moved: "", robots: "", scans: [] as string[], things: [] as string[] };
  #frames = new Frames();
  #world: World | null = null;
  #closers: (() => void)[] = [];

  constructor(link: Rosbridge, scene: RobotScene) {
    this.#link = link;
    this.#scene = scene;
    this.element.hidden = true;
    this.#isOn.checked = wasOn(SWITCH);
    this.#isOn.onchange = () => {
      remember(SWITCH, String(this.#isOn.checked));
      this.#switch();
    };
    this.#whole.onclick = () => scene.look("All");
  }

  /** Takes what the robot is made of: whether it has a world, and what sees it. */
  learn(components: readonly Component[]): void {
    const lasers = components.flatMap(({ ports }) => ports.filter(({ kind, type }) => kind === "out" && type === SCAN));
    const scans = lasers.map(({ topic }) => topic);
    const seeing = components.flatMap(({ ports }) => ports.filter(({ kind, type }) => kind === "out" && type === THINGS));
    const things = seeing.map(({ topic }) => topic);
    const robots = robotsTopicOf(components);
    const topics = { world: worldTopicOf(components), moved: movedTopicOf(components), robots, scans, things };
    if (JSON.stringify(topics) === JSON.stringify(this.#topics)) return;
    this.#topics = topics;
    const field = h("div", { class: "field check" }, this.#isOn, h("label", { for: this.#isOn.id }, "World"));
    this.element.replaceChildren(field, this.#whole);
    this.element.hidden = !topics.world;
    this.#switch();
  }

  close(): void {
    this.#closers.forEach((close) => close());
    this.#closers = [];
  }

  #switch(): void {
    this.close();
    const isOn = this.#isOn.checked && this.#topics.world !== "";
    this.#whole.hidden = !isOn;
    this.#frames = new Frames();
    if (this.#world) this.#show(null);
    if (!isOn) return;
    const { world, moved, robots, scans, things } = this.#topics;
    const type = { type: TRANSFORMS };
    this.#closers.push(
      this.#link.subscribe(world, (message) => this.#show(readWorld(message)), { type: "rbxcompose_msgs/msg/World" }),
      ...(robots ? [this.#link.subscribe(robots, (message) => this.#met(message), { type: ROBOTS, throttle: SCANS })] : []),
      ...["/tf_static", "/tf"].map((topic) => this.#link.subscribe(topic, (message) => this.#moved(message, topic), type)),
      ...(moved ? [this.#link.subscribe(moved, (message) => this.#pushed(message), { ...type, throttle: SCANS })] : []),
      ...things.map((topic) =>
        this.#link.subscribe(topic, (seen) => this.#recognised(topic, seen), { type: THINGS, throttle: SCANS }),
      ),
      ...scans.map((topic) =>
        this.#link.subscribe(topic, (scan) => this.#saw(topic, scan), { type: SCAN, throttle: SCANS }),
      ),
    );
  }

  #show(world: World | null): void {
    this.#world = world;
    this.#scene.setWorld(world);
    this.#scene.element.dataset.world = world ? String(world.shapes.length) : "";
    this.#place();
  }

  /** Takes transforms: the newest says where the robot is, and what time it is for all that moves. */
  #moved(message: Message, topic: string): void {
    const transforms = readTransforms(message);
    for (const { parent, child, transform } of transforms) this.#frames.set(parent, child, transform);
    this.#place();
    if (!this.#world || topic !== "/tf") return;
    const stamp = Math.max(...transforms.map((stamped) => stamped.stamp));
    if (!Number.isFinite(stamp)) return;
    this.#scene.moveShapes(this.#world.epoch + stamp);
    this.#scene.element.dataset.time = String(this.#world.epoch + stamp);
  }

  #pushed(message: Message): void {
    const places = new Map(readTransforms(message).map(({ child, transform }) => [child, transform]));
    this.#scene.pushShapes(places);
    this.#scene.element.dataset.pushed = JSON.stringify([...places].map(([name, { translation: { x, y } }]) => [name, x, y]));
  }

  #met(message: Message): void {
    const places = readRobots(message);
    this.#scene.moveRobots(places);
    this.#scene.element.dataset.robots = JSON.stringify([...places].map(([name, { x, y }]) => [name, x, y]));
  }

  #place(): void {
    const place = this.#world && this.#frames.lookUp(MAP, this.#scene.root);
    if (!place) return;
    this.#scene.place(place);
    const { x, y, heading } = poseOf(place);
    this.#scene.element.dataset.place = JSON.stringify([x, y, heading]);
  }

  #recognised(topic: string, message: Message): void {
    const place = this.#world && this.#frames.lookUp(MAP, frameOf(message));
    if (!place) return;
    const things = readThings(message).map((thing) => ({ ...thing, pose: composed(place, thing.pose) }));
    this.#scene.setSeen(topic, things);
    this.#scene.element.dataset.seen = things.map(({ name }) => name).join(" ");
  }

  #saw(topic: string, scan: Message): void {
    const place = this.#world && this.#frames.lookUp(MAP, frameOf(scan));
    if (place) this.#scene.setScan(topic, readScan(scan).map((point) => applied(place, point)));
  }
}
