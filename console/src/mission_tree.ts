/** The steps of a mission as a tree: how far each is, where the mission stops, and what may be done with a step. */
import { breakpointsAt, machineOf, spotOf, stoppedHere, type Breakpoint } from "./debugging";
import { h, icon, setText, type Icon } from "./dom";
import { ACTIVE, activeNode, statusOf, testedText, titleOf, untried, type Drawn, type Seen, type Status, type Tested } from "./mission";
import type { Json } from "./rosbridge";

const ICONS: Record<Status, Icon> = { idle: "dot", running: "play", success: "check", failure: "cross", skipped: "skip" };
const WORDS: Record<Status, string> = {
  idle: "not yet",
  running: "running",
  success: "done",
  failure: "failed",
  skipped: "skipped",
};
const KEYS = "The circles are breakpoints. Choose a step to see what can be done with it. Keys: arrows, Enter, b for a breakpoint.";
const USUAL = ["success", "failure"];

/** Sends a request about the mission, tells the person what came of it, and returns whether it was done. */
export type AskMission = (request: { type: string; [key: string]: Json }, button?: HTMLButtonElement) => Promise<boolean>;
/** Returns the outcomes in which nodes may be forced to end, by number. */
export type LearnOutcomes = () => Promise<Record<string, string[]>>;

interface Row {
  item: HTMLElement;
  node: Drawn;
  parent: Row | null;
  mark: HTMLElement;
  status: HTMLElement;
  stop: HTMLElement;
  /** The button, or for who only looks the sign, of its breakpoint; null if nothing stops there. */
  point: HTMLElement | null;
  arrows: { outcome: string; to: string; point: HTMLElement }[];
  fold: (folded: boolean) => void;
}

export class MissionTree {
  readonly element = h("section", { class: "card mission-tree", "aria-label": "Steps" });
  readonly #mission: string;
  readonly #mayOperate: boolean;
  readonly #ask: AskMission;
  readonly #learn: LearnOutcomes;
  #seen: Seen | null = null;
  #drawn = "";
  #rows: Row[] = [];
  #untried = new Map<number, string[]>();
  readonly #folded = new Set<string>();
  #listed: Breakpoint[] = [];
  #points = new Map<string, string[]>();
  #chosen: Row | null = null;
  #actions: HTMLElement | null = null;
  #actionsOf = "";
  #outcomes: Record<string, string[]> | null = null;
  #stops = new Set<string>();

  constructor(mission: string, mayOperate: boolean, ask: AskMission, learn: LearnOutcomes) {
    this.#mission = mission;
    this.#mayOperate = mayOperate;
    this.#ask = ask;
    this.#learn = learn;
    this.element.append(h("p", { class: "label" }, "It has not run yet since the robot came up."));
    this.element.onkeydown = (event) => this.#key(event);
  }

  /** Shows how far the mission is; of one that has not run, only its steps. */
  show(seen: Seen, tested: Tested | null): void {
    this.#seen = seen;
    const picture = JSON.stringify([seen.picture, tested]);
    if (picture !== this.#drawn) {
      this.#drawn = picture;
      this.#draw(seen, tested);
    }
    this.#paint();
  }

  /** Marks where there are breakpoints. */
  mark(listed: Breakpoint[]): void {
    this.#listed = listed;
    this.#points = breakpointsAt(listed, this.#mission);
    this.#paintPoints();
  }

  #draw(seen: Seen, tested: Tested | null): void {
    this.#untried = tested && tested.count === seen.picture.count ? untried(tested) : new Map();
    this.#rows = [];
    this.#outcomes = null;
    this.#choose(null);
    const roots = [seen.picture.main, ...seen.picture.interrupts].map((root, turn) => this.#row(root, null, String(turn)));
    this.#rows[0]?.item.setAttribute("tabindex", "0");
    this.element.replaceChildren(h("ul", { role: "tree", "aria-label": "Steps of the mission" }, ...roots));
    if (this.#mayOperate) this.element.append(h("p", { class: "label keys" }, KEYS));
    if (tested) this.element.append(h("p", { class: "label tested" }, testedText(tested, seen.picture)));
    this.#points = breakpointsAt(this.#listed, this.#mission);
    this.#paintPoints();
  }

  #row(node: Drawn, parent: Row | null, path: string): HTMLElement {
    const { role, name, what } = titleOf(node);
    const line = h("div", { class: "node" });
    const words = h("span", { class: "node-words" });
    if (role) words.append(h("span", { class: "label" }, `${role}: `));
    if (name) words.append(h("strong", {}, name), " ");
    words.append(what);
    if (node.is_start) words.append(h("span", { class: "note" }, "start"));
    words.append(...node.notes.map((note) => h("span", { class: "note" }, note)));
    const untried = this.#untried.get(node.number ?? node.children[0]?.number ?? -1);
    const isReaction = node.number === null && node.children.length > 0; // its own row says it
    if (untried && !isReaction) {
      words.append(h("span", { class: "note untried" }, icon("warning"), ` not tested: ${untried.join(", ")}`));
    }
    const item = h("li", { role: "treeitem", tabindex: "-1", "data-form": node.number === null ? "interrupt" : node.form }, line);
    const [mark, status, stop] = [h("span", { class: "mark" }), h("span", { class: "node-status" }), h("strong", { class: "node-stop" })];
    const row: Row = { item, node, parent, mark, status, stop, point: null, arrows: [], fold: () => undefined };
    this.#rows.push(row);
    if (node.number !== null) {
      row.point = this.#point(`Breakpoint at ${name || what}`, () => this.#toggle(row));
      row.point.tabIndex = -1; // the key `b` does the same
      line.append(row.point);
    }
    line.append(mark, words, stop, status);
    if (this.#mayOperate && node.number !== null) {
      item.setAttribute("aria-selected", "false");
      line.classList.add("chooses");
      line.onclick = (event) => {
        if (!(event.target as Element).closest("button")) this.#choose(this.#chosen === row ? null : row);
      };
    }
    if (node.children.length > 0) {
      const inner = h("ul", { role: "group" }, ...node.children.map((child, turn) => this.#row(child, row, `${path}.${turn}`)));
      const fold = h("button", { type: "button", class: "fold" }, icon("down"));
      row.fold = (folded) => {
        if (folded) this.#folded.add(path);
        else this.#folded.delete(path);
        inner.hidden = folded;
        item.setAttribute("aria-expanded", String(!folded));
        fold.setAttribute("aria-label", `${folded ? "Show" : "Hide"} the steps of ${name || what}`);
      };
      fold.onclick = () => row.fold(!inner.hidden);
      row.fold(this.#folded.has(path));
      line.append(fold);
      item.append(inner);
    }
    if (node.arrows.length > 0) item.append(this.#arrows(row));
    return item;
  }

  #arrows(row: Row): HTMLElement {
    return h(
      "ul",
      { class: "arrows" },
      ...row.node.arrows.map(({ outcome, to }) => {
        const text = `${outcome || "then"} \u2192 ${to}`;
        const point = this.#point(`Breakpoint at ${row.node.name}: ${text}`, () => this.#toggle(row, outcome, to));
        row.arrows.push({ outcome, to, point });
        return h("li", { "data-outcome": outcome }, point, text);
      }),
    );
  }

  #point(label: string, toggle: () => void): HTMLElement {
    if (!this.#mayOperate) return h("span", { class: "point", role: "img", "aria-label": label });
    const button = h("button", { type: "button", class: "point", "aria-pressed": "false", "aria-label": label, title: label });
    button.onclick = toggle;
    return button;
  }

  /** Sets a breakpoint at the start of a node, or at a transition; or clears those that stop there. */
  #toggle({ node }: Row, outcome: string | null = null, to = ""): void {
    const mission = this.#mission;
    const there = this.#points.get(spotOf(node.number!, outcome));
    const where = outcome === null ? `${node.number}` : `${node.number}->${to}`;
    if (!there) void this.#ask({ type: "mission.SetBreakpoint", where, mission });
    for (const written of there ?? []) void this.#ask({ type: "mission.ClearBreakpoints", where: written, mission });
  }

  #paintPoints(): void {
    const paint = (point: HTMLElement | null, spot: string) => {
      if (!point) return;
      const isSet = this.#points.has(spot);
      point.classList.toggle("set", isSet);
      if (this.#mayOperate) point.setAttribute("aria-pressed", String(isSet));
      else point.hidden = !isSet;
    };
    for (const { node, point, arrows } of this.#rows) {
      if (node.number === null) continue;
      paint(point, spotOf(node.number));
      for (const arrow of arrows) paint(arrow.point, spotOf(node.number, arrow.outcome));
    }
    this.#showActions();
  }

  #paint(): void {
    const seen = this.#seen;
    if (!seen) return;
    const active = activeNode(seen.picture, seen.statuses);
    const stops = new Set<string>();
    for (const row of this.#rows) {
      const { node, item } = row;
      const status = statusOf(node, seen.statuses);
      if (item.dataset.status !== status) {
        item.dataset.status = status;
        row.mark.replaceChildren(icon(ICONS[status]));
      }
      const stop = (seen.stopped_at ?? []).find((one) => one.node === node.number);
      item.classList.toggle("stopped", stop !== undefined);
      setText(row.stop, stop ? stoppedHere(stop) : "");
      setText(row.status, stop ? "" : WORDS[status]);
      if (stop) {
        stops.add(`${stop.node} ${stop.after}`);
        if (!this.#stops.has(`${stop.node} ${stop.after}`)) reveal(row);
      }
      const isActive = node === active && ACTIVE.has(seen.state);
      if (item.classList.toggle("active", isActive) && isActive && item.dataset.wasActive !== "yes" && !stop) {
        item.scrollIntoView({ block: "nearest" });
      }
      item.dataset.wasActive = isActive ? "yes" : "";
    }
    this.#stops = stops;
    this.#showActions();
  }

  // What may be done with the chosen step

  #choose(row: Row | null): void {
    this.#chosen?.item.setAttribute("aria-selected", "false");
    this.#actions?.remove();
    this.#actions = null;
    this.#actionsOf = "";
    this.#chosen = row;
    if (!row) return;
    this.#moveTo(row);
    row.item.setAttribute("aria-selected", "true");
    const name = row.node.name || titleOf(row.node).what;
    this.#actions = h("div", { class: "node-actions", role: "group", "aria-label": `What can be done with ${name}` });
    row.item.firstElementChild!.after(this.#actions);
    this.#showActions();
  }

  #showActions(): void {
    const [row, seen, box] = [this.#chosen, this.#seen, this.#actions];
    if (!row || !seen || !box) return;
    const number = row.node.number!;
    const runs = ACTIVE.has(seen.state) && statusOf(row.node, seen.statuses) === "running";
    const machine = machineOf(row.node, seen.picture);
    const mayJump = machine !== null && ACTIVE.has(seen.state) && statusOf(machine, seen.statuses) === "running";
    const isSet = this.#points.has(spotOf(number));
    if (runs && !this.#outcomes) {
      this.#outcomes = {};
      void this.#learn().then((outcomes) => {
        this.#outcomes = outcomes;
        this.#showActions();
      });
    }
    const ends = runs ? (this.#outcomes?.[number] ?? []) : [];
    const key = JSON.stringify([runs, mayJump, isSet, ends]);
    if (key === this.#actionsOf) return;
    this.#actionsOf = key;
    const had = box.contains(document.activeElement) ? document.activeElement?.textContent : null;
    const breakpoint = h("button", { type: "button", "aria-pressed": String(isSet) }, isSet ? "Clear breakpoint" : "Set breakpoint");
    breakpoint.onclick = () => this.#toggle(row);
    box.replaceChildren(breakpoint, ...this.#endings(number, ends));
    if (mayJump) {
      const jump = h("button", { type: "button" }, "Jump to this state");
      jump.onclick = () => void this.#ask({ type: "mission.JumpMission", state: `${number}`, mission: this.#mission }, jump);
      box.append(jump);
    }
    if (!runs) box.append(h("p", { class: "label" }, "It does not run now. While it runs, it can be ended by hand."));
    if (had != null) ([...box.querySelectorAll("button")].find((one) => one.textContent === had) ?? breakpoint).focus();
  }

  #endings(number: number, ends: string[]): HTMLElement[] {
    const force = (outcome: string, button: HTMLButtonElement) =>
      void this.#ask({ type: "mission.ForceNode", where: `${number}`, outcome, mission: this.#mission }, button);
    const usual = USUAL.filter((outcome) => ends.includes(outcome)).map((outcome) => {
      const button = h("button", { type: "button" }, `Force ${outcome}`);
      button.onclick = () => force(outcome, button);
      return button;
    });
    const own = ends.filter((outcome) => !USUAL.includes(outcome));
    if (own.length === 0) return usual;
    const pick = h("select", { "aria-label": "Outcome of its own" }, ...own.map((outcome) => h("option", {}, outcome)));
    const button = h("button", { type: "button" }, "Force outcome");
    button.onclick = () => force(pick.value, button);
    return [...usual, h("span", { class: "row" }, pick, button)];
  }

  // Keys

  #moveTo(row: Row): void {
    for (const { item } of this.#rows) item.setAttribute("tabindex", "-1");
    row.item.setAttribute("tabindex", "0");
    row.item.focus({ preventScroll: true });
    row.item.firstElementChild!.scrollIntoView({ block: "nearest" });
  }

  #key(event: KeyboardEvent): void {
    const target = event.target as Element;
    if (event.ctrlKey || event.altKey || event.metaKey || target.closest("select, input")) return;
    const row = this.#rows.find(({ item }) => item === target.closest("[role='treeitem']"));
    if (!row) return;
    const inRow = target === row.item;
    const shown = this.#rows.filter(({ item }) => item.getClientRects().length > 0);
    const at = shown.indexOf(row);
    const isOpen = row.item.getAttribute("aria-expanded");
    const steps: Record<string, number> = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: shown.length - 1 };
    if (event.key === "b" && this.#mayOperate) {
      const arrow = row.arrows.find(({ point }) => point === target);
      if (arrow) this.#toggle(row, arrow.outcome, arrow.to);
      else if (row.node.number !== null) this.#toggle(row);
    } else if (event.key === "Escape" && this.#chosen) {
      const chosen = this.#chosen;
      this.#choose(null);
      this.#moveTo(chosen);
    } else if (!inRow) return;
    else if (event.key in steps) {
      const next = shown[steps[event.key]!];
      if (next) this.#moveTo(next);
    } else if (event.key === "ArrowRight" && isOpen === "false") row.fold(false);
    else if (event.key === "ArrowLeft" && isOpen === "true") row.fold(true);
    else if (event.key === "ArrowLeft" && row.parent) this.#moveTo(row.parent);
    else if ((event.key === "Enter" || event.key === " ") && row.item.hasAttribute("aria-selected")) {
      this.#choose(this.#chosen === row ? null : row);
    } else return;
    event.preventDefault();
  }
}

/** Unfolds what hides a row, and scrolls to it. */
function reveal(row: Row): void {
  for (let around = row.parent; around; around = around.parent) around.fold(false);
  row.item.firstElementChild!.scrollIntoView({ block: "center" });
}
