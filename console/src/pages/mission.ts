/** Mission: what the robot is doing and why, live; start, pause, resume and cancel. */
import { h, emptyCard, icon, setText, type Icon } from "../dom";
import { formatName } from "../format";
import {
  ACTIVE,
  activeNode,
  isSeen,
  shownValue,
  statusOf,
  testedText,
  titleOf,
  untried,
  type Drawn,
  type Listed,
  type Seen,
  type Status,
  type Tested,
} from "../mission";
import { MissionEditor } from "../mission_editor";
import { newMission } from "../new_mission";
import type { Page, Robot } from "../page";
import { isMessage, type Json } from "../rosbridge";
import "./mission.css";

const LOOK = 250; // [ms] between two looks at a mission
const STORY = 200; // lines that are kept
const ICONS: Record<Status, Icon> = { idle: "dot", running: "play", success: "check", failure: "cross", skipped: "skip" };
const WORDS: Record<Status, string> = {
  idle: "not yet",
  running: "running",
  success: "done",
  failure: "failed",
  skipped: "skipped",
};

export const page: Page = {
  name: "mission",
  title: "Mission",
  order: 30,
  open(host, robot) {
    const box = h("div", { class: "mission" }, emptyCard("wait", "Asking for the missions\u2026"));
    host.append(box);
    let view: MissionView | null = null;
    const close = robot.link.watch(
      "mission/ListMissions",
      (answer, refused) => {
        const missions = Array.isArray(answer) ? (answer as unknown as Listed[]) : [];
        if (refused || missions.length === 0) {
          view?.close();
          view = null;
          const why = refused && !/no component/.test(refused) ? refused : "This robot has no missions.";
          box.replaceChildren(emptyCard("warning", why, h("p", {}, "Missions are written under `missions:` in its manifest.")));
          return;
        }
        if (!view) box.replaceChildren((view = new MissionView(robot)).element);
        view.list(missions);
      },
      500,
    );
    return () => {
      close();
      view?.close();
    };
  },
};

/** The list of missions, and the one that is looked at. */
class MissionView {
  readonly element = h("div", { class: "mission-view" });
  readonly #robot: Robot;
  readonly #list = h("nav", { class: "card mission-list", "aria-label": "Missions" });
  readonly #head = h("section", { class: "card mission-head", "aria-label": "Control" });
  readonly #tree = h("section", { class: "card mission-tree", "aria-label": "Steps" });
  readonly #side = h("div", { class: "mission-side" });
  readonly #data = h("section", { class: "card", "aria-label": "Data" });
  readonly #story = h("section", { class: "card mission-story", "aria-label": "Story" }, h("h2", {}, "Story"));
  readonly #lines = h("ol", { class: "lines" });
  readonly #closers: (() => void)[] = [];
  #missions: Listed[] = [];
  #chosen = "";
  #isChosenByHand = false;
  #look: () => void = () => undefined;
  #seen: Seen | null = null;
  #tested: Tested | null = null;
  #drawn = "";
  #rows = new Map<Drawn, HTMLElement>();
  #folded = new Set<string>();
  #untried = new Map<number, string[]>();
  #headOf = "";
  #editor: MissionEditor | null = null;

  constructor(robot: Robot) {
    this.#robot = robot;
    this.#story.append(this.#lines);
    this.#side.append(this.#data, this.#story);
    this.element.append(this.#list, this.#head, this.#tree, this.#side);
    this.#closers.push(
      robot.link.subscribe("/rosout", (log) => this.#tell(log.name, log.msg, log.stamp), { type: "rcl_interfaces/msg/Log" }),
    );
  }

  close(): void {
    this.#look();
    this.#editor?.close();
    for (const close of this.#closers) close();
  }

  list(missions: Listed[]): void {
    this.#missions = missions;
    const active = missions.find(({ state }) => ACTIVE.has(state));
    const wanted = this.#isChosenByHand ? this.#chosen : (active?.name ?? (this.#chosen || missions[0]?.name));
    this.#list.replaceChildren(
      ...missions.map(({ name, state }) => {
        const button = h("button", { type: "button", "data-state": state }, h("span", {}, formatName(name)), h("small", {}, state));
        button.setAttribute("aria-pressed", String(name === wanted));
        button.onclick = () => {
          this.#isChosenByHand = true;
          this.#choose(name);
        };
        return button;
      }),
    );
    if (this.#robot.config.role === "configure") {
      const make = h("button", { type: "button", class: "new-mission" }, icon("edit"), "New mission");
      make.onclick = async () => {
        const name = await newMission(this.#robot, this.element);
        if (name) this.#edit(name);
      };
      this.#list.append(make);
    }
    this.#list.hidden = this.#list.childElementCount < 2;
    if (wanted && wanted !== this.#chosen) this.#choose(wanted);
    this.#showHead();
  }

  #choose(name: string): void {
    this.#look();
    this.#edit("");
    this.#chosen = name;
    this.#seen = null;
    this.#drawn = "";
    this.#tree.replaceChildren(h("p", { class: "label" }, "It has not run yet since the robot came up."));
    this.#data.replaceChildren(h("h2", {}, "Data"), h("p", { class: "label" }, "Nothing yet"));
    this.#tested = null;
    void this.#learnTested(name);
    this.#look = this.#robot.link.watch(`mission/LookAtAll/mission/${name}`, (answer) => this.#show(answer), LOOK);
    for (const button of this.#list.children) {
      button.setAttribute("aria-pressed", String(button.firstChild?.textContent === formatName(name)));
    }
    this.#showHead();
  }

  async #learnTested(name: string): Promise<void> {
    const values = await this.#robot.link.call("/console/tested", { mission: name }).catch(() => null);
    if (name !== this.#chosen || !isMessage(values) || !isMessage(values.answer)) return;
    this.#tested = values.answer as unknown as Tested;
    this.#drawn = "";
    if (this.#seen) this.#show(this.#seen as unknown as Json);
  }

  // Control

  #showHead(): void {
    const mission = this.#missions.find(({ name }) => name === this.#chosen);
    if (!mission) return;
    const isActive = ACTIVE.has(mission.state);
    const key = `${mission.name} ${isActive} ${mission.state}`;
    if (key === this.#headOf) return;
    this.#headOf = key;
    const edit = h("button", { type: "button" }, icon("edit"), "Edit");
    edit.onclick = () => this.#edit(mission.name);
    edit.hidden = this.#editor !== null;
    const title = h("div", { class: "mission-title" }, h("h2", {}, formatName(mission.name)), stateChip(mission.state), edit);
    this.#head.replaceChildren(title, h("p", { class: "label" }, mission.about));
    if (isActive) {
      const paused = mission.state === "paused";
      this.#head.append(
        h(
          "div",
          { class: "row" },
          this.#button(paused ? "play" : "pause", paused ? "Resume" : "Pause", paused ? "ResumeMission" : "PauseMission"),
          this.#button("cross", "Cancel", "CancelMission"),
        ),
      );
    } else {
      this.#head.append(this.#startForm(mission));
    }
  }

  /** Shows the editor of a mission in place of its steps; without a name, the steps again. */
  #edit(name: string): void {
    this.#editor?.close();
    this.#editor?.element.remove();
    this.#editor = name ? new MissionEditor(this.#robot, name, () => this.#edit("")) : null;
    if (this.#editor) this.element.append(this.#editor.element);
    this.#isChosenByHand ||= this.#editor !== null; // another mission that starts does not take the text away
    this.#tree.hidden = this.#side.hidden = this.#editor !== null;
    this.element.classList.toggle("edits", this.#editor !== null);
    this.#headOf = "";
    this.#showHead();
  }

  #button(picture: Icon, text: string, request: string): HTMLElement {
    const button = h("button", { type: "button" }, icon(picture), text);
    button.onclick = () => void this.#ask({ type: `mission.${request}`, mission: this.#chosen }, button);
    return button;
  }

  #startForm(mission: Listed): HTMLElement {
    const form = h("form", { class: "mission-start" });
    for (const input of mission.inputs) form.append(inputField(input.name, input.about, input.choices, input.default));
    if (mission.starts.length > 0) form.append(inputField("", "where it begins", ["", ...mission.starts], "", "Start in"));
    form.append(h("button", {}, icon("play"), "Start"));
    form.onsubmit = (event) => {
      event.preventDefault();
      const values = [...new FormData(form)].map(([name, value]) => [name, String(value).trim()] as const);
      const inputs = Object.fromEntries(values.filter(([name, value]) => name && value));
      const start = values.find(([name]) => name === "")?.[1] ?? "";
      void this.#ask({ type: "mission.RunMission", mission: mission.name, inputs, start }, form.querySelector("button")!);
    };
    return form;
  }

  async #ask(request: { type: string; [key: string]: Json }, button: HTMLButtonElement): Promise<void> {
    button.disabled = true;
    try {
      const answer = await this.#robot.link.ask(request);
      if (typeof answer === "string") this.#robot.notify(answer);
    } catch (error) {
      this.#robot.notify((error as Error).message);
    } finally {
      button.disabled = false;
    }
  }

  // The tree

  #show(answer: Json): void {
    if (!isSeen(answer)) return;
    const seen = (this.#seen = answer as unknown as Seen);
    const picture = JSON.stringify(seen.picture);
    if (picture !== this.#drawn) {
      this.#drawn = picture;
      this.#rows.clear();
      const tested = this.#tested;
      this.#untried = tested && tested.count === seen.picture.count ? untried(tested) : new Map();
      const roots = [seen.picture.main, ...seen.picture.interrupts].map((root, turn) => this.#row(root, String(turn)));
      this.#tree.replaceChildren(h("ul", { role: "tree", "aria-label": "Steps of the mission" }, ...roots));
      if (tested) this.#tree.append(h("p", { class: "label tested" }, testedText(tested, seen.picture)));
    }
    this.#paint();
    this.#showData();
  }

  #row(node: Drawn, path: string): HTMLElement {
    const { role, name, what } = titleOf(node);
    const row = h("div", { class: "node" });
    const mark = h("span", { class: "mark" });
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
    row.append(mark, words, h("span", { class: "node-status" }));
    const item = h("li", { role: "treeitem", "data-form": node.number === null ? "interrupt" : node.form }, row);
    this.#rows.set(node, item);
    if (node.children.length > 0) {
      const inner = h("ul", { role: "group" }, ...node.children.map((child, turn) => this.#row(child, `${path}.${turn}`)));
      const fold = h("button", { type: "button", class: "fold" }, icon("down"));
      const show = () => {
        const folded = this.#folded.has(path);
        inner.hidden = folded;
        item.setAttribute("aria-expanded", String(!folded));
        fold.setAttribute("aria-label", `${folded ? "Show" : "Hide"} the steps of ${name || what}`);
      };
      fold.onclick = () => {
        if (!this.#folded.delete(path)) this.#folded.add(path);
        show();
      };
      show();
      row.prepend(fold);
      item.append(inner);
    }
    if (node.arrows.length > 0) {
      item.append(
        h("ul", { class: "arrows" }, ...node.arrows.map(({ outcome, to }) => h("li", {}, `${outcome || "then"} \u2192 ${to}`))),
      );
    }
    return item;
  }

  #paint(): void {
    const seen = this.#seen;
    if (!seen) return;
    const active = activeNode(seen.picture, seen.statuses);
    for (const [node, item] of this.#rows) {
      const status = statusOf(node, seen.statuses);
      const isActive = node === active && ACTIVE.has(seen.state);
      if (item.dataset.status !== status) {
        item.dataset.status = status;
        item.querySelector(":scope > .node > .mark")!.replaceChildren(icon(ICONS[status]));
        setText(item.querySelector(":scope > .node > .node-status")!, WORDS[status]);
      }
      if (item.classList.toggle("active", isActive) && isActive && item.dataset.wasActive !== "yes") {
        item.scrollIntoView({ block: "nearest" });
      }
      item.dataset.wasActive = isActive ? "yes" : "";
    }
  }

  #showData(): void {
    const seen = this.#seen!;
    const rows = Object.entries(seen.data).map(([name, value]) =>
      h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, shownValue(value))),
    );
    const moves = seen.transitions.slice(-5).map(({ state, to, outcome }) => h("li", {}, `${state} \u2192 ${to} (${outcome})`));
    this.#data.replaceChildren(
      h("h2", {}, "Data"),
      rows.length > 0 ? h("table", {}, ...rows) : h("p", { class: "label" }, "This mission keeps no data."),
      ...(moves.length > 0 ? [h("h2", {}, "Last transitions"), h("ol", { class: "lines" }, ...moves)] : []),
    );
  }

  #tell(name: Json | undefined, text: Json | undefined, stamp: Json | undefined): void {
    if (name !== "mission" || typeof text !== "string") return;
    const seconds = isMessage(stamp) ? Number(stamp.sec) + Number(stamp.nanosec) / 1e9 : 0;
    const time = new Date(seconds * 1000).toLocaleTimeString();
    this.#lines.prepend(h("li", {}, h("time", {}, time), ` ${text}`));
    while (this.#lines.children.length > STORY) this.#lines.lastChild?.remove();
  }
}

function stateChip(state: string): HTMLElement {
  const picture: Icon = state === "paused" ? "pause" : ACTIVE.has(state) ? "play" : state === "failure" ? "cross" : state === "success" ? "check" : "dot";
  return h("span", { class: "chip", "data-state": state, role: "status" }, icon(picture), formatName(state));
}

function inputField(name: string, about: string, choices: string[], value: string | null, title = formatName(name)): HTMLElement {
  const id = `input-${name || "start"}`;
  const field = choices.length > 0 ? h("select", { id, name }) : h("input", { id, name, placeholder: about });
  if (field instanceof HTMLSelectElement) {
    field.append(...choices.map((choice) => h("option", { value: choice }, choice ? formatName(choice) : "Its first state")));
  }
  if (value !== null) field.value = value;
  field.required = value === null;
  const label = h("label", { for: id }, title, h("span", { class: "label" }, ` ${about}`));
  return h("div", { class: "field" }, label, field);
}
