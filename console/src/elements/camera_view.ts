/** What a camera of the robot sees, with what is found in it, and with an arrow that shows where it is being driven. */
import { h, icon, setText, svg } from "../dom";
import type { Rosbridge } from "../rosbridge";
import { SeenOverlay } from "./seen_overlay";

const WIDTH = 640; // [px] that are asked for
const QUALITY = 60; // of JPEG
const AGAIN = 3_000; // [ms] until a picture that failed is asked for again

export class CameraView {
  readonly element: HTMLElement;
  readonly #image = h("img", { alt: "What the robot's camera sees" });
  readonly #says = h("p", { class: "label", role: "status" }, "Waiting for a picture\u2026");
  readonly #arrow = svg("path", { class: "motion-arrow", d: "" });
  readonly #url: string;
  readonly #seen: SeenOverlay;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #tries = 0;

  constructor(link: Rosbridge, topic: string) {
    this.#seen = new SeenOverlay(link, topic);
    this.#url = `stream?topic=${encodeURIComponent(topic)}&width=${WIDTH}&quality=${QUALITY}`;
    const overlay = svg("svg", { viewBox: "0 0 100 75", "aria-hidden": "true" }, this.#arrow);
    this.element = h("section", { class: "card camera", "aria-label": "Camera" }, this.#image, overlay, this.#says, this.#seen.element);
    this.#image.onload = () => this.#says.replaceChildren();
    this.#image.onerror = () => {
      this.#says.replaceChildren(icon("unlink"), "No picture. Trying again\u2026");
      this.#timer = setTimeout(() => this.#ask(), AGAIN);
    };
    this.#ask();
  }

  /** Shows how it is driven: forward and turn from -1 to 1. */
  point(forward: number, turn: number): void {
    const still = Math.abs(forward) < 0.01 && Math.abs(turn) < 0.01;
    const [x, y] = [50 - 40 * turn, 72 - 60 * Math.abs(forward) * Math.cos(turn)];
    this.#arrow.setAttribute("d", still ? "" : `M50 72L${x.toFixed(1)} ${y.toFixed(1)}`);
    this.#arrow.classList.toggle("back", forward < 0);
  }

  close(): void {
    this.#seen.close();
    clearTimeout(this.#timer);
    this.#image.onerror = null;
    this.#image.removeAttribute("src"); // ends the stream
    setText(this.#says, "");
  }

  #ask(): void {
    this.#tries += 1;
    this.#image.src = `${this.#url}&try=${this.#tries}`; // browsers do not load the same address again
  }
}
