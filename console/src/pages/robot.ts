/** Robot: a card for every component, drawn from what it declares; the processes; and how all are wired. */
import { fillCard } from "../cards";
import { watchComponents, type Component } from "../description";
import { levelOf, type Tree } from "../diagnostics";
import { emptyCard, h, icon, setText, svg } from "../dom";
import { formatName } from "../format";
import type { Page, Robot } from "../page";
import { isMessage, type Json } from "../rosbridge";
import { wiresOf } from "../wiring";
import "./robot.css";

const LOOK = 1_000; // [ms]
const VIEWS = { cards: "Components", wiring: "Wiring", processes: "Processes" } as const;
type View = keyof typeof VIEWS;
/** Who gives or takes everything is drawn for nobody: it would hide the rest. */
const EVERYBODYS = /^\/(diagnostics|tf|tf_static|rosout)$/;

export const page: Page = {
  name: "robot",
  title: "Robot",
  order: 10,
  open(host, robot) {
    const view = new RobotView(robot);
    const box = h("div", {}, emptyCard("wait", "Asking the robot what it is made of\u2026"));
    host.append(box);
    const closers = [
      watchComponents(robot.link, (components, refused) => {
        if (refused) box.replaceChildren(emptyCard("warning", refused));
        else if (components.length === 0) box.replaceChildren(emptyCard("warning", "This robot has no components."));
        else {
          if (!view.element.isConnected) box.replaceChildren(view.element);
          view.show(components);
        }
      }),
      robot.link.watch("robot/RobotStatus", (answer) => view.showStates(answer)),
      robot.link.watch("diagnostics/ShowDiagnostics", (answer) => view.showLevels(answer), LOOK),
    ];
    return () => {
      closers.forEach((close) => close());
      view.close();
    };
  },
};

/** What is known of a component from outside. */
interface State {
  name: string;
  state: string;
  process: string;
  pid: number | null;
  restarts: number;
  waits_for: string | null;
  note: string;
}

class RobotView {
  readonly element = h("div", { class: "robot" });
  readonly #robot: Robot;
  readonly #host = h("div", {});
  readonly #filter = h("input", { type: "search", "aria-label": "Find a component", placeholder: "Find a component" });
  readonly #views = new Map<View, HTMLButtonElement>();
  readonly #statuses = new Map<string, HTMLElement>();
  #view: View = "cards";
  #components: Component[] = [];
  #states = new Map<string, State>();
  #levels = new Map<string, [number, string]>();
  #drawn = "";
  #close: () => void = () => undefined;

  constructor(robot: Robot) {
    this.#robot = robot;
    const bar = h("div", { class: "robot-bar" });
    for (const [name, title] of Object.entries(VIEWS) as [View, string][]) {
      const button = h("button", { type: "button" }, title);
      button.onclick = () => this.#choose(name);
      this.#views.set(name, button);
      bar.append(button);
    }
    this.#filter.oninput = () => this.#find();
    bar.append(this.#filter);
    this.element.append(bar, this.#host);
    this.#choose("cards");
  }

  close(): void {
    this.#close();
  }

  show(components: Component[]): void {
    this.#components = components;
    const drawn = JSON.stringify(components);
    if (drawn === this.#drawn) return;
    this.#drawn = drawn;
    this.#draw();
  }

  showStates(answer: Json): void {
    const states = isMessage(answer) && Array.isArray(answer.components) ? (answer.components as unknown as State[]) : [];
    this.#states = new Map(states.map((state) => [state.name, state]));
    this.#showStatuses();
  }

  showLevels(answer: Json): void {
    const lines = isMessage(answer) ? (answer as unknown as Tree).lines : [];
    this.#levels = new Map();
    for (const { is_group, name, level, message } of lines) {
      const own = name.split(": ")[0]!;
      if (!is_group && level >= (this.#levels.get(own)?.[0] ?? 0)) this.#levels.set(own, [level, message]);
    }
    this.#showStatuses();
  }

  #choose(view: View): void {
    this.#view = view;
    for (const [name, button] of this.#views) button.setAttribute("aria-pressed", String(name === view));
    this.#filter.hidden = view === "wiring";
    this.#draw();
  }

  #draw(): void {
    this.#close();
    this.#close = () => undefined;
    this.#statuses.clear();
    if (this.#components.length === 0) return;
    if (this.#view === "cards") this.#drawCards();
    else if (this.#view === "processes") this.#drawProcesses();
    else void this.#drawWiring();
    this.#showStatuses();
    this.#find();
  }

  #drawCards(): void {
    const closers: (() => void)[] = [];
    const cards = this.#components.map((component) => {
      const status = h("p", { class: "chip", role: "status" });
      this.#statuses.set(component.name, status);
      const head = h("header", {}, h("h2", {}, formatName(component.name)), status);
      const about = h("p", { class: "label" }, component.about.replaceAll("`", ""), h("small", {}, ` ${component.type}`));
      const card = h("article", { class: "card component", "aria-label": component.name }, head, about);
      closers.push(fillCard(card, component, this.#robot));
      return card;
    });
    this.#host.replaceChildren(h("div", { class: "components" }, ...cards));
    this.#close = () => closers.forEach((close) => close());
  }

  #drawProcesses(): void {
    const rows = this.#components.map(({ name, type, process }) => {
      const status = h("span", { class: "chip" });
      this.#statuses.set(name, status);
      const row = h("tr", { "aria-label": name }, h("th", { scope: "row" }, name), h("td", {}, status));
      row.append(h("td", {}, process, h("small", { class: "pid" })), h("td", { class: "restarts" }), h("td", {}, type));
      return row;
    });
    const head = ["Component", "State", "Process", "Restarts", "Type"].map((title) => h("th", { scope: "col" }, title));
    const table = h("table", {}, h("thead", {}, h("tr", {}, ...head)), h("tbody", {}, ...rows));
    this.#host.replaceChildren(h("div", { class: "card wide", tabindex: "0", role: "region", "aria-label": "Processes" }, table));
  }

  async #drawWiring(): Promise<void> {
    const box = h("div", { class: "card wide", tabindex: "0", role: "region", "aria-label": "Wiring" });
    this.#host.replaceChildren(box);
    const drawing = await draw(this.#components);
    const note = h("p", { class: "label" }, "Arrows go from who publishes or calls to who listens or answers; thick ones move the robot.");
    box.replaceChildren(note, drawing);
  }

  #showStatuses(): void {
    for (const [name, status] of this.#statuses) {
      const state = this.#states.get(name);
      const [level, message] = this.#levels.get(name) ?? [0, ""];
      const isUp = state === undefined || state.state === "active";
      const look = levelOf(isUp ? level : 1);
      const word = !state ? "\u2026" : isUp ? (level > 0 ? `${look.word}: ${message}` : "Active") : formatName(state.state);
      const why = state?.waits_for ? ` (waits for ${state.waits_for})` : state?.note ? ` (${state.note})` : "";
      const text = word + why;
      if (status.textContent !== text) {
        status.dataset.kind = state ? look.kind : "none";
        status.replaceChildren(icon(state ? look.icon : "wait"), text);
      }
      const row = status.closest("tr");
      if (!row || !state) continue;
      setText(row.querySelector(".pid")!, state.pid === null ? "" : ` ${state.pid}`);
      setText(row.querySelector(".restarts")!, String(state.restarts));
    }
  }

  #find(): void {
    const wanted = this.#filter.value.trim().toLowerCase();
    for (const card of this.#host.querySelectorAll<HTMLElement>("article, tbody tr")) {
      card.hidden = !(card.textContent ?? "").toLowerCase().includes(wanted);
    }
  }
}

/** Draws the components as boxes, grouped in ranks by what flows between them. */
async function draw(components: readonly Component[]): Promise<SVGSVGElement> {
  const { Graph, layout } = await import("@dagrejs/dagre");
  const graph = new Graph({ multigraph: false });
  graph.setGraph({ rankdir: "LR", nodesep: 18, ranksep: 90, marginx: 8, marginy: 24 });
  graph.setDefaultEdgeLabel(() => ({}));
  for (const { name, type } of components) graph.setNode(name, { width: 24 + 9 * Math.max(name.length, type.length * 0.85), height: 48 });
  const wires = wiresOf(components, (topic) => !EVERYBODYS.test(topic));
  for (const { from, to } of wires) graph.setEdge(from, to);
  layout(graph);
  const { width = 0, height = 0 } = graph.graph() as { width?: number; height?: number };
  const drawing = svg("svg", { class: "wiring", viewBox: `0 0 ${width} ${height}`, width: String(width), height: String(height), role: "img" });
  drawing.setAttribute("aria-label", wires.map(({ from, to, names }) => `${from} to ${to}: ${names.join(", ")}`).join("; "));
  const tip = svg("path", { d: "M0 0 8 4 0 8z" });
  drawing.append(svg("defs", {}, svg("marker", { id: "tip", viewBox: "0 0 8 8", refX: "7", refY: "4", markerWidth: "9", markerHeight: "9", markerUnits: "userSpaceOnUse", orient: "auto" }, tip)));
  for (const { from, to, names, isCommand } of wires) {
    const points = (graph.edge({ v: from, w: to }) as unknown as { points: { x: number; y: number }[] }).points;
    const path = svg("path", { class: isCommand ? "wire command" : "wire", d: `M${points.map(({ x, y }) => `${x} ${y}`).join("L")}`, "marker-end": "url(#tip)" });
    const title = svg("title");
    title.textContent = `${from} \u2192 ${to}\n${names.join("\n")}`;
    path.append(title);
    drawing.append(path);
  }
  for (const { name, type, process } of components) {
    const { x, y, width, height } = graph.node(name) as unknown as { x: number; y: number; width: number; height: number };
    const box = svg("rect", { x: String(x - width / 2), y: String(y - height / 2), width: String(width), height: String(height), rx: "8" });
    const title = svg("text", { x: String(x), y: String(y - 4), class: "node-name" });
    const below = svg("text", { x: String(x), y: String(y + 14), class: "node-type" });
    title.textContent = name;
    below.textContent = type;
    const tooltip = svg("title");
    tooltip.textContent = `${name}: ${type}, in process ${process}`;
    drawing.append(svg("g", {}, tooltip, box, title, below));
  }
  return drawing;
}
