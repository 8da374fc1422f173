/** Draws state machines: their boxes are buttons that choose the state. */
import { h, svg } from "./dom";
import { isSame, type Block, type Path } from "./edited";
import { arrowWords, namesOf, type MachineGraph, type StateBox } from "./machines";

const LETTER = 8.6; // [px] of a wide letter
const SMALL = 7.2; // [px] of a letter of a label
const [HIGH, LOW] = [52, 22]; // [px] of a box and of a label

/** How states ended in a dry run, and those in which the robot is now. */
export interface Progress {
  statuses: readonly { path: Path; status: string }[];
  active: ReadonlySet<string>;
}

export class MachineView {
  readonly element = h("div", { class: "machines" });
  readonly #choose: (block: Block) => void;
  #boxes: { box: StateBox; button: HTMLElement }[] = [];
  #shown = "";
  #turn = 0;

  constructor(choose: (block: Block) => void) {
    this.#choose = choose;
  }

  /** Draws machines, if they are others than before, and marks the chosen state. */
  async show(graphs: readonly MachineGraph[], chosen: Block | null, { statuses, active }: Progress): Promise<void> {
    const key = JSON.stringify(graphs.map(({ title, boxes, arrows }) => [title, arrows, boxes.map(({ block, ...box }) => [box, block?.path])]));
    const turn = (this.#turn += 1);
    if (key !== this.#shown) {
      const { Graph, layout } = await import("@dagrejs/dagre");
      if (turn !== this.#turn) return; // another one was asked for meanwhile
      this.#shown = key;
      this.#boxes = [];
      const none = h("p", { class: "label" }, "There is no state machine here.");
      this.element.replaceChildren(...(graphs.length > 0 ? graphs.map((graph) => this.#draw(graph, new Graph({ multigraph: false }), layout)) : [none]));
    }
    for (const { box, button } of this.#boxes) {
      const { block } = box;
      const isChosen = block !== null && chosen !== null && isSame(chosen.path.slice(0, block.path.length), block.path);
      button.setAttribute("aria-pressed", String(isChosen));
      const status = statuses.find(({ path }) => block && isSame(path, block.path))?.status ?? "";
      const isActive = block !== null && active.has(namesOf(block.path));
      button.dataset.status = isActive ? "running" : status;
      button.title = isActive ? `${box.name}: the robot is in it now` : status ? `${box.name}: ${status} in the dry run` : box.name;
    }
  }

  #draw({ title, boxes, arrows }: MachineGraph, graph: DagreGraph, layout: (graph: DagreGraph) => void): HTMLElement {
    graph.setGraph({ rankdir: "TB", nodesep: 28, ranksep: 34, edgesep: 18, marginx: 12, marginy: 12 });
    for (const box of boxes) {
      const width = Math.max(88, 36 + LETTER * box.name.length, 28 + SMALL * moreOf(box).length);
      graph.setNode(box.name, { width, height: HIGH });
    }
    for (const { from, to, outcomes } of arrows) {
      graph.setEdge(from, to, { width: SMALL * outcomes.join(", ").length + 12, height: outcomes.length > 0 ? LOW : 0, labelpos: "c" });
    }
    layout(graph);
    const { width = 0, height = 0 } = graph.graph() as { width?: number; height?: number };
    const size = { viewBox: `0 0 ${width} ${height}`, width: String(width), height: String(height) };
    const lines = svg("svg", { ...size, role: "img", "aria-label": arrows.map(arrowWords).join("; ") || "No transitions" });
    const id = `machine-tip-${title.replaceAll(/\W/g, "-")}`;
    const tip = { id, viewBox: "0 0 8 8", refX: "7", refY: "4", markerWidth: "9", markerHeight: "9", markerUnits: "userSpaceOnUse", orient: "auto" };
    lines.append(svg("defs", {}, svg("marker", tip, svg("path", { d: "M0 0 8 4 0 8z" }))));
    const labels: SVGElement[] = [];
    for (const { from, to, outcomes } of arrows) {
      const { points, x, y } = graph.edge({ v: from, w: to }) as unknown as { points: At[]; x: number; y: number };
      lines.append(svg("path", { class: "machine-arrow", d: curve(points), "marker-end": `url(#${id})` }));
      if (outcomes.length === 0) continue;
      const text = svg("text", { x: String(x), y: String(y + 5), class: "machine-outcome" });
      text.textContent = outcomes.join(", ");
      labels.push(text);
    }
    lines.append(...labels); // over all arrows
    const canvas = h("div", { class: "machine-canvas" });
    canvas.append(lines, ...boxes.map((box) => this.#box(box, graph.node(box.name) as unknown as At & { width: number })));
    return h("section", { class: "machine", "aria-label": `Machine: ${title}` }, h("h3", {}, title), h("div", { class: "machine-scroll", tabindex: "0", role: "group", "aria-label": `Graph of ${title}` }, canvas));
  }

  #box(box: StateBox, { x, y, width }: At & { width: number }): HTMLElement {
    const { name, block, isStart } = box;
    const more = moreOf(box);
    const words = [h("span", {}, name), ...(more ? [h("small", {}, more)] : [])];
    const element = block ? h("button", { type: "button", class: "machine-state" }, ...words) : h("div", { class: "machine-end" }, ...words);
    if (isStart) element.classList.add("start");
    element.style.setProperty("left", `${x - width / 2}px`);
    element.style.setProperty("top", `${y - HIGH / 2}px`);
    element.style.setProperty("width", `${width}px`);
    element.style.setProperty("height", `${HIGH}px`);
    if (block) {
      element.onclick = () => this.#choose(box.block!);
      this.#boxes.push({ box, button: element });
    }
    return element;
  }
}

/** Returns what a box says below its name. */
function moreOf({ block, isStart, isNested }: StateBox): string {
  return [isStart ? "start" : "", isNested ? "machine inside" : "", block ? "" : "end"].filter(Boolean).join(", ");
}

interface At {
  x: number;
  y: number;
}

type DagreGraph = InstanceType<(typeof import("@dagrejs/dagre"))["Graph"]>;

/** Returns the path of a smooth line through points. */
function curve(points: readonly At[]): string {
  const [first, ...rest] = points;
  const last = rest.at(-1)!;
  const middles = rest.slice(0, -1).map(({ x, y }, turn) => {
    const next = rest[turn + 1]!;
    const end = turn === rest.length - 2 ? next : { x: (x + next.x) / 2, y: (y + next.y) / 2 };
    return `Q${x} ${y} ${end.x} ${end.y}`;
  });
  return `M${first!.x} ${first!.y}${middles.length > 0 ? middles.join("") : `L${last.x} ${last.y}`}`;
}
