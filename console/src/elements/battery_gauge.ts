/** `<battery-gauge>`: a named value with its unit; one in percent has a battery and a word beside it. */
import { h, setText, svg } from "../dom";
import { chargeOf, formatAge, formatName, formatValue } from "../format";
import type { Value } from "../config";

const STALE = 15_000; // [ms] after which a value says how old it is
const SHELL =
  "M3.500 7h15a1.500 1.500 0 0 1 1.500 1.500v7a1.500 1.500 0 0 1-1.500 1.500h-15A1.500 1.500 0 0 1 2 15.500v-7A1.500 1.500 0 0 1 3.500 7M22.500 10.500v3";
const BOLT = "M13 3 6 13.500h5L10 21l7-10.500h-5z";
const WORDS = { good: "Good", fair: "Fair", low: "Low" };

export class BatteryGauge extends HTMLElement {
  #unit = "";
  #value: number | null = null;
  #at = 0;
  readonly #level = svg("rect", { x: "4", y: "9", width: "0", height: "6", rx: "0.5", class: "battery-level" });
  readonly #number = h("span", { class: "value" }, formatValue(null, ""));
  readonly #word = h("span", { class: "battery-word" });

  describe(value: Value): this {
    this.#unit = value.unit;
    const shell = svg("path", { d: SHELL });
    const parts = this.#unit === "%" ? [shell, this.#level] : [svg("path", { d: BOLT })];
    this.append(svg("svg", { viewBox: "0 0 24 24", class: "icon battery", "aria-hidden": "true" }, ...parts));
    const name = h("span", { class: "label" }, formatName(value.name));
    this.append(h("div", { class: "battery-text" }, name, this.#number, this.#word));
    this.show(null, 0);
    return this;
  }

  show(value: number | null, now: number): void {
    this.#value = value;
    this.#at = now;
    setText(this.#number, formatValue(value, this.#unit));
    const percent = this.#unit === "%" && value !== null ? Math.max(0, Math.min(100, value)) : null;
    this.#level.setAttribute("width", String((14 * (percent ?? 0)) / 100));
    this.dataset.charge = percent === null ? "" : chargeOf(percent);
    this.refresh(now);
  }

  /** Says so when the value is old or never came. */
  refresh(now: number): void {
    const stale = this.#value === null || now - this.#at > STALE;
    this.classList.toggle("stale", stale);
    if (this.#value === null) setText(this.#word, "No data yet");
    else if (stale) setText(this.#word, `${formatAge(now - this.#at)} old`);
    else setText(this.#word, this.#unit === "%" ? WORDS[chargeOf(this.#value)] : "");
  }
}

customElements.define("battery-gauge", BatteryGauge);
