/** Data: topics with their types and rates, what they carry, plots of numbers, and publishing. */
import type uPlot from "uplot";
import { whyNot } from "../config";
import { columns, numberAt, Rate, Series, shapeOf, valueAt, writable, type Path } from "../data";
import { disable, emptyCard, h, icon, setText } from "../dom";
import { numberIn } from "../format";
import type { Page, Robot } from "../page";
import { isMessage, type Json, type Message, type Rosbridge } from "../rosbridge";
import "uplot/dist/uPlot.min.css";
import "./data.css";

const LIST = 3_000; // [ms] between two looks for topics
const DRAW = 200; // [ms]
const MOST_ITEMS = 50; // of a list
const PLOTS = 6; // lines at once
const FONT = "12px system-ui, sans-serif"; // of the labels of a plot
const COLOURS = ["#1a7fd0", "#d0651a", "#2a9a4a", "#a83ab0", "#b0162a", "#6a6f00"];

/** What a person has chosen, for when the page is opened again; nothing is subscribed to meanwhile. */
interface Chosen {
  topic: [topic: string, type: string] | null;
  lines: Map<string, [topic: string, type: string, path: Path]>;
}

const choices = new WeakMap<Rosbridge, Chosen>();

export const page: Page = {
  name: "data",
  title: "Data",
  order: 80,
  open(host, robot) {
    const view = new TopicsView(robot);
    host.append(view.element);
    return () => view.close();
  },
};

class TopicsView {
  readonly element = h("div", { class: "data" });
  readonly #robot: Robot;
  readonly #filter = h("input", { type: "search", "aria-label": "Find a topic", placeholder: "Find a topic" });
  readonly #list = h("ul", { class: "topics" });
  readonly #empty = emptyCard("wait", "Asking for the topics\u2026");
  readonly #topic = h("div", { class: "data-topic" }, emptyCard("dot", "Choose a topic to see what it carries."));
  readonly #plot: Plot;
  readonly #timers: ReturnType<typeof setInterval>[];
  readonly #unwatch: () => void;
  #topics = new Map<string, string>();
  /** What says the type and the rate of each topic that is listed. */
  readonly #abouts = new Map<string, HTMLElement>();
  #rates: Message = {};
  readonly #choice: Chosen;
  #chosen: TopicView | null = null;

  constructor(robot: Robot) {
    this.#robot = robot;
    this.#choice = choices.get(robot.link) ?? { topic: null, lines: new Map() };
    choices.set(robot.link, this.#choice);
    this.#plot = new Plot(robot, this.#choice.lines);
    this.#filter.oninput = () => this.#show();
    const side = h("section", { class: "card", "aria-label": "Topics" }, this.#filter, this.#empty, this.#list);
    this.element.append(side, h("div", { class: "data-side" }, this.#plot.element, this.#topic));
    this.#timers = [setInterval(() => void this.#ask(), LIST), setInterval(() => this.#tick(), DRAW)];
    this.#unwatch = robot.link.state.watch(() => void this.#ask());
    if (this.#choice.topic) this.#choose(...this.#choice.topic);
  }

  close(): void {
    this.#timers.forEach((timer) => clearInterval(timer));
    this.#unwatch();
    this.#chosen?.close();
    this.#plot.close();
  }

  #tick(): void {
    this.#chosen?.refresh();
    this.#plot.draw();
  }

  async #ask(): Promise<void> {
    if (this.#robot.link.state.value.is !== "open") return;
    try {
      const answer = await this.#robot.link.call("/rosapi/topics");
      const [topics, types] = isMessage(answer) ? [answer.topics, answer.types] : [];
      if (!Array.isArray(topics) || !Array.isArray(types)) return;
      const found = new Map(topics.map((topic, at) => [String(topic), String(types[at])]));
      const isSame = found.size === this.#topics.size && [...found].every(([topic, type]) => this.#topics.get(topic) === type);
      this.#topics = found;
      this.#empty.hidden = found.size > 0;
      if (found.size === 0) setText(this.#empty.querySelector("p")!, "Nothing publishes or listens.");
      if (!isSame) this.#show();
      const rates = await this.#robot.link.call("/console/rates");
      this.#rates = isMessage(rates) && isMessage(rates.answer) ? rates.answer : {};
      this.#tellRates();
    } catch (error) {
      setText(this.#empty.querySelector("p")!, (error as Error).message);
    }
  }

  #show(): void {
    const wanted = this.#filter.value.trim().toLowerCase();
    this.#abouts.clear();
    const rows = [...this.#topics].sort().filter(([topic, type]) => `${topic} ${type}`.toLowerCase().includes(wanted));
    this.#list.replaceChildren(
      ...rows.map(([topic, type]) => {
        const about = h("small", {});
        this.#abouts.set(topic, about);
        const button = h("button", { type: "button", class: "line" }, h("span", {}, topic), about);
        button.setAttribute("aria-pressed", String(this.#chosen?.topic === topic));
        button.onclick = () => {
          this.#choose(topic, type);
          if (matchMedia("(max-width: 47rem)").matches) this.#topic.scrollIntoView({ block: "start" });
        };
        return h("li", {}, button);
      }),
    );
    this.#tellRates();
  }

  #tellRates(): void {
    for (const [topic, about] of this.#abouts) {
      const rate = this.#rates[topic];
      setText(about, [this.#topics.get(topic), typeof rate === "number" ? `${rate.toFixed(rate < 10 ? 1 : 0)}\u202fHz` : ""].filter(Boolean).join(" \u00b7 "));
    }
  }

  #choose(topic: string, type: string): void {
    this.#chosen?.close();
    this.#chosen = new TopicView(this.#robot, topic, type, (path) => this.#plot.toggle(topic, type, path));
    this.#topic.replaceChildren(this.#chosen.element);
    this.#choice.topic = [topic, type];
    this.#show();
  }
}

/** One topic: its rate, its newest message, and a form that publishes on it. */
class TopicView {
  readonly element: HTMLElement;
  readonly topic: string;
  readonly #type: string;
  readonly #robot: Robot;
  readonly #plot: (path: Path) => void;
  readonly #rate = new Rate();
  readonly #shownRate = h("span", { class: "label", role: "status" });
  readonly #tree = h("div", { class: "echo" }, h("p", { class: "label" }, "No message has come yet."));
  readonly #text = h("textarea", { id: "publish", rows: "6", spellcheck: "false" });
  readonly #again = h("button", { type: "button" });
  readonly #says = h("p", { class: "says", role: "status" });
  readonly #open = new Set<string>();
  /** What shows each value that can be seen: where a message is as the last one, nothing is drawn again under a finger. */
  readonly #leaves = new Map<string, (value: Json) => void>();
  #shape = "";
  readonly #close: () => void;
  #message: Message | null = null;
  #isShown = true;
  #isWritten = false;
  #paused = false;
  #timer: ReturnType<typeof setInterval> | undefined;

  constructor(robot: Robot, topic: string, type: string, plot: (path: Path) => void) {
    [this.#robot, this.topic, this.#type, this.#plot] = [robot, topic, type, plot];
    const pause = h("button", { type: "button" }, icon("pause"), "Pause");
    pause.onclick = () => {
      this.#paused = !this.#paused;
      pause.replaceChildren(icon(this.#paused ? "play" : "pause"), this.#paused ? "Go on" : "Pause");
    };
    this.#text.value = "{}";
    this.#text.oninput = () => (this.#isWritten = true);
    const head = h("div", { class: "data-head" }, h("div", {}, h("h2", {}, topic), h("p", { class: "label" }, type), this.#shownRate), pause);
    const echo = h("section", { class: "card", "aria-label": `Messages of ${topic}` }, head, this.#tree);
    this.element = h("div", { class: "data-topic" }, echo, this.#publisher());
    this.#close = robot.link.subscribe(topic, (message) => this.#arrived(message), { type });
  }

  close(): void {
    this.#close();
    clearInterval(this.#timer);
  }

  refresh(): void {
    const rate = this.#rate.at(performance.now());
    setText(this.#shownRate, rate === null ? "" : `${rate < 100 ? Number(rate.toPrecision(3)) : Math.round(rate)} messages a second`);
    const selection = document.getSelection();
    const isCopying = selection !== null && !selection.isCollapsed && this.#tree.contains(selection.anchorNode);
    if (this.#isShown || this.#paused || !this.#message || isCopying) return;
    this.#isShown = true;
    const shape = shapeOf(this.#message);
    if (shape === this.#shape) {
      for (const [path, show] of this.#leaves) show(valueAt(this.#message, path.split("/")));
    } else {
      this.#shape = shape;
      this.#leaves.clear();
      this.#tree.replaceChildren(this.#branch(this.#message, []));
    }
    if (!this.#isWritten) this.#text.value = writable(this.#message);
  }

  #arrived(message: Message): void {
    this.#rate.count(performance.now());
    if (this.#paused) return;
    this.#message = message;
    this.#isShown = false;
  }

  #branch(value: Json, path: Path): HTMLElement {
    const entries: [string, Json][] = Array.isArray(value) ? value.slice(0, MOST_ITEMS).map((item, at) => [String(at), item]) : Object.entries(value as Message);
    const rows = entries.map(([key, inner]) => this.#leaf(key, inner, [...path, key]));
    if (Array.isArray(value) && value.length > MOST_ITEMS) rows.push(h("li", { class: "label" }, `and ${value.length - MOST_ITEMS} more`));
    return h("ul", {}, ...rows);
  }

  #leaf(key: string, value: Json, path: Path): HTMLElement {
    if (typeof value === "object" && value !== null) {
      const size = Array.isArray(value) ? value.length : Object.keys(value).length;
      if (size === 0) return h("li", {}, h("span", { class: "label" }, `${key}: `), "empty");
      const name = path.join("/");
      const isOpen = this.#open.has(name) || (path.length < 3 && !Array.isArray(value) && !this.#open.has(`-${name}`));
      const summary = h("summary", { "data-path": name }, `${key}${Array.isArray(value) ? ` (${size})` : ""}`);
      const box = h("details", {}, summary);
      box.open = isOpen;
      if (isOpen) box.append(this.#branch(value, path));
      box.ontoggle = () => {
        this.#open.delete(box.open ? `-${name}` : name);
        this.#open.add(box.open ? name : `-${name}`);
        if (box.open && box.childElementCount === 1) box.append(this.#branch(valueAt(this.#message, path), path));
      };
      return h("li", {}, box);
    }
    const label = h("span", { class: "label" }, `${key}: `);
    if (typeof value === "string") {
      const text = h("span");
      this.#keep(path, (next) => setText(text, String(next) || "(empty)"), value);
      return h("li", {}, label, text);
    }
    const button = h("button", { type: "button", class: "number-value", title: "Plot it", "data-path": path.join("/") });
    const show = (next: Json) => {
      const shown = next === null ? "not a number" : String(next);
      setText(button, shown);
      button.setAttribute("aria-label", `${path.join(" ")} ${shown}, plot`);
    };
    this.#keep(path, show, value);
    button.onclick = () => this.#plot(path);
    return h("li", {}, label, button);
  }

  #keep(path: Path, show: (value: Json) => void, value: Json): void {
    show(value);
    this.#leaves.set(path.join("/"), show);
  }

  #publisher(): HTMLElement {
    const rate = h("input", { id: "publish-rate", inputmode: "decimal", value: "10", autocomplete: "off" });
    const once = h("button", {}, icon("skip"), "Publish once");
    disable(whyNot(this.#robot.config, "operate"), once, this.#again);
    this.#stop();
    this.#again.onclick = () => {
      if (this.#timer !== undefined) return this.#stop();
      const hertz = numberIn(rate.value);
      if (!(hertz > 0 && hertz <= 50)) return this.#say("The rate is a number up to 50 Hz.", "bad");
      if (!this.#send()) return;
      this.#timer = setInterval(() => this.#send() || this.#stop(), 1000 / hertz);
      this.#again.replaceChildren(icon("pause"), "Stop publishing");
    };
    const form = h(
      "form",
      { class: "card publish", "aria-label": "Publish" },
      h("label", { for: "publish" }, `A message for ${this.topic}, as JSON; what is left out is zero`),
      this.#text,
      h("div", { class: "row" }, once, this.#again, h("div", { class: "field rate" }, h("label", { for: rate.id }, "Hz"), rate)),
      this.#says,
    );
    form.onsubmit = (event) => {
      event.preventDefault();
      this.#send();
    };
    return h("details", {}, h("summary", {}, "Publish"), form);
  }

  #stop(): void {
    clearInterval(this.#timer);
    this.#timer = undefined;
    this.#again.replaceChildren(icon("play"), "Publish again and again");
  }

  /** Publishes what is written; returns whether that was possible. */
  #send(): boolean {
    let message: Json;
    try {
      message = JSON.parse(this.#text.value || "{}") as Json;
    } catch (error) {
      this.#say(`This is no JSON: ${(error as Error).message}`, "bad");
      return false;
    }
    if (!isMessage(message)) {
      this.#say("A message is written {...}.", "bad");
      return false;
    }
    this.#robot.link.onStatus = ({ level, msg }) => {
      if (level !== "error") return;
      this.#stop();
      this.#say(msg, "bad");
    };
    const isSent = this.#robot.link.publish(this.topic, message, { type: this.#type, id: "data" });
    this.#say(isSent ? "Published." : "Not connected.", isSent ? "good" : "bad");
    return isSent;
  }

  #say(text: string, kind: string): void {
    this.#says.dataset.kind = kind;
    setText(this.#says, text);
  }
}

interface PlotLine {
  name: string;
  series: Series;
  colour: string;
  close: () => void;
}

/** Numbers over the last minute. */
class Plot {
  readonly element = h("section", { class: "card plot", "aria-label": "Plot", hidden: "" });
  readonly #robot: Robot;
  readonly #legend = h("ul", { class: "plot-legend" });
  readonly #host = h("div", { class: "plot-host" });
  readonly #lines = new Map<string, PlotLine>();
  readonly #wanted: Chosen["lines"];
  #chart: uPlot | null = null;
  #library: typeof uPlot | null = null;

  constructor(robot: Robot, wanted: Chosen["lines"]) {
    [this.#robot, this.#wanted] = [robot, wanted];
    this.element.append(this.#host, this.#legend);
    for (const line of [...wanted.values()]) this.toggle(...line);
  }

  close(): void {
    for (const { close } of this.#lines.values()) close();
    this.#chart?.destroy();
  }

  /** Plots a number of a topic, or no longer. */
  toggle(topic: string, type: string, path: Path): void {
    const name = `${topic} ${path.join(" ")}`;
    if (this.#lines.has(name)) {
      this.#remove(name);
      return;
    }
    if (this.#lines.size >= PLOTS) {
      this.#robot.notify(`A plot has ${PLOTS} lines at most: press one below it to remove it.`);
      return;
    }
    const series = new Series();
    const taken = new Set([...this.#lines.values()].map(({ colour }) => colour));
    const colour = COLOURS.find((one) => !taken.has(one))!;
    const close = this.#robot.link.subscribe(topic, (message) => series.add(performance.now(), numberAt(message, path)), { type });
    this.#lines.set(name, { name, series, colour, close });
    this.#wanted.set(name, [topic, type, path]);
    void this.#rebuild();
  }

  #remove(name: string): void {
    this.#lines.get(name)?.close();
    this.#lines.delete(name);
    this.#wanted.delete(name);
    void this.#rebuild();
  }

  async #rebuild(): Promise<void> {
    this.element.hidden = this.#lines.size === 0;
    this.#legend.replaceChildren(
      ...[...this.#lines.values()].map(({ name, colour }) => {
        const button = h("button", { type: "button", "aria-label": `Remove ${name}` }, h("i", {}), name, icon("cross"));
        button.style.setProperty("--colour", colour);
        button.onclick = () => this.#remove(name);
        return h("li", {}, button);
      }),
    );
    if (this.#lines.size === 0) return;
    this.#library ??= (await import("uplot")).default;
    this.#chart?.destroy();
    const style = getComputedStyle(document.documentElement);
    const axis = { stroke: style.getPropertyValue("--faint"), font: FONT, grid: { stroke: style.getPropertyValue("--edge") }, ticks: { stroke: style.getPropertyValue("--edge") } };
    const options: uPlot.Options = {
      width: this.#host.clientWidth || 300,
      height: 220,
      legend: { show: false },
      scales: { x: { time: false, range: [-60, 0] } },
      axes: [{ ...axis, values: (_, ticks) => ticks.map((tick) => `${tick} s`) }, { ...axis, size: roomFor }],
      series: [{}, ...[...this.#lines.values()].map(({ name, colour }) => ({ label: name, stroke: colour, width: 2, spanGaps: false }))],
    };
    this.#chart = new this.#library(options, [[]], this.#host);
    this.draw();
  }

  draw(): void {
    if (!this.#chart || this.element.hidden) return;
    const width = this.#host.clientWidth;
    if (width > 0 && width !== this.#chart.width) this.#chart.setSize({ width, height: 220 });
    this.#chart.setData(columns([...this.#lines.values()].map(({ series }) => series), performance.now()) as uPlot.AlignedData);
    this.#host.dataset.points = String(this.#chart.data[0].length);
  }
}

/** Returns how wide the axis with the values must be [px], so that none of its labels is cut off. */
function roomFor({ ctx, width }: uPlot, labels: readonly string[] | null): number {
  ctx.save();
  ctx.font = FONT;
  const widest = Math.max(0, ...(labels ?? []).map((label) => ctx.measureText(label).width));
  ctx.restore();
  return Math.min(Math.max(60, Math.ceil(widest) + 20), width / 2); // 15 px of them between the labels and the plot
}
