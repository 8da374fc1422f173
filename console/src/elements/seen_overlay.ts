/** Outlines and names of what is seen, over the picture of a camera. */
import { watchComponents, type Component } from "../description";
import { svg } from "../dom";
import { frameOf } from "../map";
import type { Message, Rosbridge } from "../rosbridge";
import { outlineIn, readBoxes, readCamera, readThings, type PinholeCamera } from "../seen";

const OLD = 1_000; // [ms] after which something is not shown any more
const BETWEEN = 100; // [ms] between two messages
const BOXES = "vision_msgs/msg/Detection2DArray";
const THINGS = "vision_msgs/msg/Detection3DArray";

interface Shown {
  at: number;
  message: Message;
  type: string;
}

export class SeenOverlay {
  readonly element = svg("svg", { class: "seen", "aria-hidden": "true" });
  readonly #link: Rosbridge;
  readonly #seen = new Map<string, Shown>();
  readonly #open = new Map<string, () => void>();
  readonly #closers: (() => void)[] = [];
  #camera: PinholeCamera | null = null;

  constructor(link: Rosbridge, topic: string) {
    this.#link = link;
    const info = topic.replace(/[^/]+$/, "camera_info");
    const timer = setInterval(() => this.#paint(), OLD / 2);
    this.#closers.push(
      link.subscribe(info, (message) => (this.#camera = readCamera(message)), { type: "sensor_msgs/msg/CameraInfo", throttle: OLD }),
      watchComponents(link, (components) => this.#learn(components)),
      () => clearInterval(timer),
    );
  }

  close(): void {
    for (const close of [...this.#closers, ...this.#open.values()]) close();
  }

  #learn(components: readonly Component[]): void {
    for (const { kind, type, topic } of components.flatMap(({ ports }) => ports)) {
      if (kind !== "out" || (type !== BOXES && type !== THINGS) || this.#open.has(topic)) continue;
      const close = this.#link.subscribe(topic, (message) => this.#take(topic, type, message), { type, throttle: BETWEEN });
      this.#open.set(topic, close);
    }
  }

  #take(topic: string, type: string, message: Message): void {
    this.#seen.set(topic, { at: performance.now(), message, type });
    this.#paint();
  }

  #paint(): void {
    const [camera, now] = [this.#camera, performance.now()];
    const shown = camera ? [...this.#seen.values()].filter(({ at, message }) => now - at < OLD && frameOf(message) === camera.frame) : [];
    this.element.replaceChildren(...shown.flatMap((one) => drawn(camera!, one)));
    if (camera) this.element.setAttribute("viewBox", `0 0 ${camera.width} ${camera.height}`);
    this.element.dataset.seen = shown.flatMap(({ message, type }) => (type === THINGS ? readThings(message) : readBoxes(message)).map(({ name }) => name)).join(" ");
  }
}

function drawn(camera: PinholeCamera, { message, type }: Shown): SVGElement[] {
  const outlines =
    type === THINGS
      ? readThings(message).map((thing) => ({ name: thing.name, points: outlineIn(camera, thing) }))
      : readBoxes(message).map(({ name, left, top, width, height }) => ({
          name,
          points: [
            { x: left, y: top },
            { x: left + width, y: top },
            { x: left + width, y: top + height },
            { x: left, y: top + height },
          ],
        }));
  return outlines.flatMap(({ name, points }) => {
    if (!points) return [];
    const places = points.map(({ x, y }) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ");
    const [left, top] = [Math.min(...points.map(({ x }) => x)), Math.min(...points.map(({ y }) => y))];
    const size = String(camera.height / 20);
    const label = svg("text", { x: String(left), y: String(Math.max(top - 4, camera.height / 20)), "font-size": size });
    label.textContent = name;
    return [svg("polygon", { points: places }), label];
  });
}
