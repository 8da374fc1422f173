/** `<drive-pad>`: a square to hold and drag; says where as `pad` events, whose detail is a Point or null. */
import { h, svg } from "../dom";
import type { Point } from "../driving";

const REACH = 0.76; // of the pad, from its middle

export class DrivePad extends HTMLElement {
  #pointer: number | null = null;
  readonly #knob = h("div", { class: "pad-knob" });

  connectedCallback(): void {
    if (this.childElementCount > 0) return;
    const lines = svg("path", { d: "M50 12v76M12 50h76M31 31h38v38H31zM12 12h76v76H12z" });
    const arrows = svg("path", {
      class: "pad-arrows",
      d: "m47 8 3-3.500 3 3.500zm0 84 3 3.500 3-3.500zM8 47l-3.500 3 3.500 3zm84 0 3.500 3-3.500 3z",
    });
    this.append(svg("svg", { viewBox: "0 0 100 100", "aria-hidden": "true" }, lines, arrows), this.#knob);
    this.addEventListener("pointerdown", (event) => this.#press(event));
    this.addEventListener("pointermove", (event) => {
      if (event.pointerId === this.#pointer) this.#report(this.#pointOf(event));
    });
    this.addEventListener("pointerup", (event) => this.#end(event, "pad"));
    this.addEventListener("pointercancel", (event) => this.#end(event, "padlost"));
    this.addEventListener("lostpointercapture", (event) => this.#end(event, "padlost"));
    this.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  /** Shows where the command stands, whoever gave it: the pad or the keys. */
  show(at: Point, live: boolean): void {
    this.#knob.style.setProperty("--x", String(at.x));
    this.#knob.style.setProperty("--y", String(at.y));
    this.classList.toggle("live", live);
  }

  #press(event: PointerEvent): void {
    if (this.#pointer !== null || event.button !== 0 || this.getAttribute("aria-disabled") === "true") return;
    event.preventDefault();
    this.focus({ preventScroll: true });
    this.#pointer = event.pointerId;
    this.setPointerCapture(event.pointerId);
    this.#report(this.#pointOf(event));
  }

  #end(event: PointerEvent, name: "pad" | "padlost"): void {
    if (event.pointerId !== this.#pointer) return;
    this.#pointer = null;
    this.dispatchEvent(new CustomEvent(name, { detail: null }));
  }

  #report(at: Point): void {
    this.dispatchEvent(new CustomEvent("pad", { detail: at }));
  }

  /** The whole speed is reached at the outer line. */
  #pointOf(event: PointerEvent): Point {
    const box = this.getBoundingClientRect();
    const clip = (place: number) => Math.max(-1, Math.min(1, place / REACH));
    return {
      x: clip((2 * (event.clientX - box.left)) / box.width - 1),
      y: clip(1 - (2 * (event.clientY - box.top)) / box.height),
    };
  }
}

customElements.define("drive-pad", DrivePad);
