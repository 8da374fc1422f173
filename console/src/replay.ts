/** A dry run, shown as it went: where the robot was on the map, and which blocks ran. */
import { h, icon } from "./dom";
import { MapCanvas, type ShownPlace } from "./elements/map_canvas";
import { formatName } from "./format";
import { poseAt, statusesAt, timeAt, type DryRun, type Statuses } from "./trial";
import "./replay.css";

const FRAME = 50; // [ms] between two pictures
const LONGEST = 20; // [s] that a whole run takes to play, however long it was
const FASTEST = 1 / 4; // [s] of a second of robot time: what is short plays four times as fast
const EMPTY = { grids: [], areas: [], labels: [], outlines: [], paths: [], scans: [], goal: null, isOld: false };

export class Replay {
  readonly element = h("section", { class: "replay", "aria-label": "The dry run as it went" });
  readonly #run: DryRun;
  readonly #show: (statuses: Statuses) => void;
  readonly #map = new MapCanvas();
  readonly #slider: HTMLInputElement;
  readonly #time = h("output", {});
  readonly #play = h("button", { type: "button" });
  #timer: ReturnType<typeof setInterval> | undefined;

  /** `show` gets the statuses of the blocks at the time that is shown. */
  constructor(run: DryRun, show: (statuses: Statuses) => void) {
    [this.#run, this.#show] = [run, show];
    const share = { min: "0", max: "1", step: "any", value: "1" }; // of the run: a browser rounds what is no whole number
    this.#slider = h("input", { type: "range", "aria-label": "Time of the dry run", ...share });
    this.#slider.oninput = () => {
      this.#stop();
      this.#draw();
    };
    this.#play.onclick = () => (this.#timer === undefined ? this.#start() : this.#stop());
    this.element.append(h("div", { class: "replay-bar" }, this.#play, this.#slider, this.#time));
    if (run.track.length > 0) this.element.prepend(this.#map);
    this.#stop();
    this.#draw();
  }

  /** Shows the statuses once more, since what they are shown on has changed. */
  colour(): void {
    this.#show(statusesAt(this.#run, timeAt(this.#run, this.#share)));
  }

  close(): void {
    clearInterval(this.#timer);
  }

  get #share(): number {
    return Number(this.#slider.value);
  }

  #start(): void {
    if (this.#share === 1) this.#slider.value = "0";
    const length = Math.min(this.#run.time * FASTEST, LONGEST); // [s] that it takes to play
    let last = performance.now();
    this.#timer = setInterval(() => {
      const now = performance.now();
      this.#slider.value = String(Math.min(1, this.#share + (now - last) / 1000 / length));
      last = now;
      this.#draw();
      if (this.#share === 1) this.#stop();
    }, FRAME);
    this.#play.replaceChildren(icon("pause"), "Hold");
  }

  #stop(): void {
    clearInterval(this.#timer);
    this.#timer = undefined;
    this.#play.replaceChildren(icon("play"), "Play");
  }

  #draw(): void {
    const time = timeAt(this.#run, this.#share);
    const words = `${time.toFixed(1)} s of ${this.#run.time.toFixed(1)} s`;
    this.#time.textContent = words;
    this.#slider.setAttribute("aria-valuetext", words);
    this.#slider.style.setProperty("--share", this.#slider.value);
    this.colour();
    const at = poseAt(this.#run, time);
    const places = this.#run.places.map((place) => ({ ...place, label: formatName(place.name), isDock: false }) satisfies ShownPlace);
    this.#map.show({ ...EMPTY, robot: at?.robot ?? null, trail: at?.trail ?? [], places });
    const { x, y } = at?.robot ?? { x: 0, y: 0 };
    this.#map.dataset.robot = at ? `${x.toFixed(2)} ${y.toFixed(2)}` : "";
  }
}
