/** Mission: what the robot is doing and why, live; start, pause, resume, cancel and debug. */
import { byHandText, stoppedText, type Breakpoint, type Datum } from "../debugging";
import { h, emptyCard, icon, setText, type Icon } from "../dom";
import { askEditor } from "../edited";
import { formatName } from "../format";
import { showLeftOver, type LeftOver } from "../left_over";
import { LogTail, type LogNews } from "../log_tail";
import { ACTIVE, isSeen, unseen, type Listed, type Seen, type Tested } from "../mission";
import { MissionData } from "../mission_data";
import { MissionEditor } from "../mission_editor";
import { MissionTree } from "../mission_tree";
import { newMission } from "../new_mission";
import type { Page, Robot } from "../page";
import { isMessage, type Json } from "../rosbridge";
import { TriggerList, type Trigger } from "../triggers";
import "./mission.css";

const LOOK = 250; // [ms] between two looks at a mission, and at the breakpoints
const SELDOM = 2_000; // [ms] between two looks at what changes seldom
const STORY = 200; // lines that are kept
const NONE = /no component|no query/; // of what a robot without missions answers, which may not even know the question

/** What the page shows of a mission that the robot does not have, such as a new one. */
const UNKNOWN = { about: "The running robot does not have this mission.", state: "idle", claims: [], inputs: [], starts: [] };

/** The mission that a person chose: it stays while the page shows something else. */
let chosenByHand = "";

export const page: Page = {
  name: "mission",
  title: "Mission",
  order: 30,
  open(host, robot) {
    const box = h("div", { class: "mission" }, emptyCard("wait", "Asking for the missions\u2026"));
    host.append(box);
    const says = h("p", { class: "mission-silent", role: "status" });
    let view: MissionView | null = null;
    const close = robot.link.watch(
      "mission/ListMissions",
      (answer, refused) => {
        const missions = Array.isArray(answer) ? (answer as unknown as Listed[]) : [];
        const silent = refused && !NONE.test(refused) ? `The missions do not answer now: ${refused}.` : "";
        if (!view && missions.length === 0 && (silent || robot.config.role !== "configure")) {
          const hint = silent ? [] : [h("p", {}, "Missions are written under `missions:` in its manifest.")];
          box.replaceChildren(emptyCard("warning", silent || "This robot has no missions.", ...hint));
          return;
        }
        if (!view) box.replaceChildren(says, (view = new MissionView(robot)).element);
        setText(says, silent);
        if (!silent) view.list(missions); // else what was shown stays, as does an editor
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
  readonly #mayOperate: boolean;
  readonly #list = h("nav", { class: "card mission-list", "aria-label": "Missions" });
  readonly #head = h("section", { class: "card mission-head", "aria-label": "Control" });
  readonly #side = h("div", { class: "mission-side" });
  readonly #data: MissionData;
  readonly #moves = h("div", {});
  readonly #triggers = new TriggerList();
  readonly #story = h("section", { class: "card mission-story", "aria-label": "Story" }, h("h2", {}, "Story"));
  readonly #lines = h("ol", { class: "lines" });
  readonly #noLines = h("p", { role: "status" }, "Reading the log\u2026");
  readonly #closers: (() => void)[] = [];
  #missions: Listed[] = [];
  #saved: string[] = []; // the names of those in the robot's files
  #chosen = "";
  #look: () => void = () => undefined;
  #seen: Seen | null = null;
  #tested: Tested | null = null;
  #tree: MissionTree | null = null;
  #breakpoints: Breakpoint[] = [];
  #leftOver: LeftOver[] = [];
  #headOf = "";
  #controls: Controls | null = null;
  #editor: MissionEditor | null = null;

  constructor(robot: Robot) {
    this.#robot = robot;
    this.#mayOperate = robot.config.role !== "view";
    this.#story.append(this.#noLines, this.#lines);
    this.#data = new MissionData({
      list: async () => (await robot.link.ask({ type: "mission.ListData", mission: this.#chosen })) as unknown as Datum[],
      set: async (name, text) => {
        const answer = await robot.link.ask({ type: "mission.SetMissionData", values: { [name]: text }, mission: this.#chosen });
        robot.notify(String(answer));
      },
    });
    const data = h("section", { class: "card", "aria-label": "Data" }, h("h2", {}, "Data"), this.#data.element, this.#moves);
    this.#side.append(data, this.#triggers.element, this.#story);
    this.element.append(this.#list, this.#head, this.#side);
    const tail = new LogTail(
      robot,
      (news) => this.#tell(news),
      (reason) => setText(this.#noLines, reason),
    );
    this.#closers.push(
      () => tail.close(),
      robot.link.watch(
        "mission/ListBreakpoints",
        (answer) => {
          if (!Array.isArray(answer)) return;
          this.#breakpoints = answer as unknown as Breakpoint[];
          this.#tree?.mark(this.#breakpoints);
        },
        LOOK,
      ),
      robot.link.watch(
        "mission/ListTriggers",
        (answer) => Array.isArray(answer) && this.#triggers.show(answer as unknown as Trigger[]),
        SELDOM,
      ),
      robot.link.watch(
        "mission/ListSnapshots",
        (answer) => {
          if (!Array.isArray(answer)) return;
          this.#leftOver = answer as unknown as LeftOver[];
          this.#headOf = "";
          this.#showHead();
        },
        SELDOM,
      ),
    );
    if (robot.config.role === "configure") {
      this.#closers.push(robot.link.watch("changes", () => void this.#learnSaved()));
      void this.#learnSaved();
    }
  }

  /** Learns which missions are in the robot's files: a new one may wait to be brought to the robot. */
  async #learnSaved(): Promise<void> {
    this.#saved = await askEditor<string[]>(this.#robot.link, "list", "").catch(() => this.#saved);
    if (this.element.isConnected) this.list(this.#missions);
  }

  close(): void {
    this.#look();
    this.#editor?.close();
    for (const close of this.#closers) close();
  }

  list(missions: Listed[]): void {
    this.#missions = missions;
    const active = missions.find(({ state }) => ACTIVE.has(state));
    const wanted = chosenByHand || (active?.name ?? (this.#chosen || missions[0]?.name));
    const waiting = this.#saved.filter((saved) => missions.every(({ name }) => name !== saved));
    this.#list.replaceChildren(
      ...[...missions, ...waiting.map((name) => ({ name, state: "saved, not running yet" }))].map(({ name, state }) => {
        const button = h("button", { type: "button", "data-state": state }, h("span", {}, formatName(name)), h("small", {}, state));
        button.setAttribute("aria-pressed", String(name === wanted));
        button.onclick = () => {
          chosenByHand = name;
          this.#choose(name);
        };
        return button;
      }),
    );
    if (this.#robot.config.role === "configure") {
      const make = h("button", { type: "button", class: "new-mission" }, icon("edit"), "New mission");
      make.onclick = async () => {
        const name = await newMission(this.#robot, this.element);
        if (!name) return;
        this.#choose((chosenByHand = name));
        this.#edit(name);
      };
      this.#list.append(make);
    }
    this.#list.hidden = missions.length === 1 && this.#list.childElementCount === 1;
    if (wanted && wanted !== this.#chosen) this.#choose(wanted);
    this.#showHead();
  }

  #choose(name: string): void {
    this.#look();
    this.#edit("");
    this.#chosen = name;
    this.#seen = null;
    this.#tree?.element.remove();
    this.#tree = new MissionTree(
      name,
      this.#mayOperate,
      (request, button) => this.#ask(request, button),
      async () => {
        const outcomes = await this.#robot.link.ask({ type: "mission.ListOutcomes", mission: name }).catch(() => null);
        return isMessage(outcomes) ? (outcomes as unknown as Record<string, string[]>) : {};
      },
    );
    this.#tree.mark(this.#breakpoints);
    this.#head.after(this.#tree.element);
    this.#data.forget("Nothing yet");
    this.#moves.replaceChildren();
    this.#tested = null;
    void this.#learnTested(name);
    this.#look = this.#robot.link.watch(
      `mission/LookAtAll/mission/${name}`,
      (answer, refused) => {
        if (refused) void this.#showIdle(name);
        else this.#show(answer);
      },
      LOOK,
    );
    for (const button of this.#list.children) {
      button.setAttribute("aria-pressed", String(button.firstChild?.textContent === formatName(name)));
    }
    this.#showHead();
  }

  /** Shows the steps of a mission that has not run, so that breakpoints can be set. */
  async #showIdle(name: string): Promise<void> {
    const picture = await this.#robot.link.ask({ type: "mission.ShowPicture", mission: name }).catch(() => null);
    if (name !== this.#chosen || this.#seen || !isMessage(picture)) return;
    this.#tree?.show(unseen(picture), this.#tested);
  }

  async #learnTested(name: string): Promise<void> {
    const values = await this.#robot.link.call("/console/tested", { mission: name }).catch(() => null);
    if (name !== this.#chosen || !isMessage(values) || !isMessage(values.answer)) return;
    this.#tested = values.answer as unknown as Tested;
    if (this.#seen) this.#show(this.#seen as unknown as Json);
  }

  // Control

  #showHead(): void {
    this.#side.hidden = this.#editor !== null || !this.#chosen;
    if (!this.#chosen) return this.#head.replaceChildren(h("p", {}, "This robot has no missions. A new one begins with a template."));
    const known = this.#missions.find(({ name }) => name === this.#chosen);
    const mission = known ?? { ...UNKNOWN, name: this.#chosen };
    const isActive = ACTIVE.has(mission.state);
    const key = `${mission.name} ${isActive} ${known !== undefined}`;
    if (key !== this.#headOf) {
      this.#headOf = key;
      this.#controls = new Controls(this.#mayOperate, (request, button) => void this.#ask({ type: `mission.${request}`, mission: mission.name }, button));
      const edit = h("button", { type: "button" }, icon("edit"), "Edit");
      edit.onclick = () => this.#edit(mission.name);
      edit.hidden = this.#editor !== null;
      const title = h("div", { class: "mission-title" }, h("h2", {}, formatName(mission.name)), this.#controls.chip, edit);
      this.#head.replaceChildren(title, h("p", { class: "label" }, mission.about), this.#controls.says);
      const left = this.#leftOver.find((one) => one.mission === mission.name);
      if (left) this.#head.append(showLeftOver(left, isActive, this.#mayOperate, (request, button) => this.#ask(request, button)));
      if (isActive) this.#head.append(this.#controls.buttons);
      else if (this.#mayOperate && known) this.#head.append(this.#startForm(mission));
    }
    this.#controls!.show(mission.state, this.#seen?.mission === mission.name ? this.#seen : null);
  }

  /** Shows the editor of a mission in place of its steps; without a name, the steps again. */
  #edit(name: string): void {
    this.#editor?.close();
    this.#editor?.element.remove();
    this.#editor = name ? new MissionEditor(this.#robot, name, () => this.#edit("")) : null;
    if (this.#editor) this.element.append(this.#editor.element);
    chosenByHand ||= name; // another mission that starts does not take the text away
    if (this.#tree) this.#tree.element.hidden = this.#editor !== null;
    this.element.classList.toggle("edits", this.#editor !== null);
    this.#headOf = "";
    this.#showHead();
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

  async #ask(request: { type: string; [key: string]: Json }, button?: HTMLButtonElement): Promise<boolean> {
    const had = button !== undefined && document.activeElement === button;
    if (button) button.disabled = true;
    try {
      const answer = await this.#robot.link.ask(request);
      if (typeof answer === "string") this.#robot.notify(answer);
      return true;
    } catch (error) {
      this.#robot.notify((error as Error).message);
      return false;
    } finally {
      if (button) button.disabled = false;
      if (had && document.activeElement === document.body) button.focus(); // a button that is disabled loses it
    }
  }

  #show(answer: Json): void {
    if (!isSeen(answer)) return;
    const seen = (this.#seen = answer as unknown as Seen);
    this.#tree?.show(seen, this.#tested);
    this.#data.show(seen.shown, this.#mayOperate && ACTIVE.has(seen.state) && seen.state !== "waiting");
    const moves = seen.transitions.slice(-5).map(({ state, to, outcome }) => h("li", {}, `${state} \u2192 ${to} (${outcome})`));
    this.#moves.replaceChildren(...(moves.length > 0 ? [h("h2", {}, "Last transitions"), h("ol", { class: "lines" }, ...moves)] : []));
    this.#showHead();
  }

  #tell({ lines, isNew }: LogNews): void {
    if (isNew) this.#lines.replaceChildren();
    for (const { source, time, text } of lines)
      if (source === "mission") this.#lines.prepend(h("li", {}, h("time", {}, time.toFixed(2)), ` ${text}`));
    while (this.#lines.children.length > STORY) this.#lines.lastChild?.remove();
    this.#noLines.hidden = this.#lines.children.length > 0;
    setText(this.#noLines, "No mission has done anything yet.");
  }
}

/** The state of a mission, with what is to be said of it, and the buttons while it runs. They stay: a key may be on one. */
class Controls {
  readonly chip = h("span", { class: "chip", role: "status" });
  readonly says = h("div", { class: "mission-says", role: "status" });
  readonly buttons = h("div", { class: "row" });
  readonly #stopped = h("p", { class: "mission-stopped" });
  readonly #byHand = h("p", {});
  readonly #hold = h("button", { type: "button" });
  readonly #step = h("button", { type: "button", title: "Go on to the next step or transition, and stop there" });
  #isPaused = false;
  #shown = "";

  constructor(mayOperate: boolean, ask: (request: string, button: HTMLButtonElement) => void) {
    const cancel = h("button", { type: "button" }, icon("cross"), "Cancel");
    this.#step.append(icon("step"), "Step");
    this.#hold.onclick = () => ask(this.#isPaused ? "ResumeMission" : "PauseMission", this.#hold);
    this.#step.onclick = () => ask("StepMission", this.#step);
    cancel.onclick = () => ask("CancelMission", cancel);
    this.buttons.append(this.#hold, this.#step, cancel);
    this.buttons.hidden = !mayOperate;
    this.says.append(this.#stopped, this.#byHand);
  }

  show(state: string, seen: Seen | null): void {
    const stops = state === "paused" ? (seen?.stopped_at ?? []) : [];
    const byHand = byHandText(seen?.by_hand ?? 0);
    const key = JSON.stringify([state, stops, byHand]);
    if (key === this.#shown) return;
    this.#shown = key;
    this.#isPaused = state === "paused";
    this.chip.dataset.state = state;
    const word = stops.length > 0 ? "Stopped" : formatName(state);
    this.chip.replaceChildren(icon(pictureOf(state)), word);
    this.#stopped.replaceChildren(...(stops.length > 0 ? [icon("pause"), stoppedText(stops)] : []));
    this.#byHand.replaceChildren(...(byHand ? [icon("warning"), byHand] : []));
    this.#stopped.hidden = stops.length === 0;
    this.#byHand.hidden = byHand === "";
    this.says.hidden = stops.length === 0 && byHand === "";
    const hold = stops.length > 0 ? "Continue" : this.#isPaused ? "Resume" : "Pause";
    this.#hold.replaceChildren(icon(this.#isPaused ? "play" : "pause"), hold);
    this.#step.disabled = state === "waiting";
  }
}

function pictureOf(state: string): Icon {
  if (state === "paused") return "pause";
  if (ACTIVE.has(state)) return "play";
  return state === "failure" ? "cross" : state === "success" ? "check" : "dot";
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
