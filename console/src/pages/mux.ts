/** Mux: who may command, who does and why; select, lock and unlock. */
import { whyNot } from "../config";
import { watchComponents } from "../description";
import { disable, emptyCard, h, icon, setText, type Icon } from "../dom";
import { formatName } from "../format";
import { MuxesEditor } from "../muxes_editor";
import type { Page, Robot } from "../page";
import { isMessage, type Json, type Message } from "../rosbridge";
import "./mux.css";

const LOOK = 250; // [ms]
type Asked = Message & { type: string };

const NONE = "__none";

interface Input {
  name: string;
  topic: string;
  priority: number | null;
  state: string;
  why: string;
  silent_for: number | null;
}

interface Mux {
  name: string;
  output: string;
  mode: string;
  why: string;
  holder: string | null;
  selected: string | null;
  inputs: Input[];
  locks: { name: string; priority: number | null; why: string }[];
}

const LOOKS: Record<string, { icon: Icon; kind: string; word: string }> = {
  holds: { icon: "check", kind: "good", word: "Commands" },
  waits: { icon: "pause", kind: "fair", word: "Waits" },
  locked: { icon: "stop", kind: "bad", word: "Locked" },
  "must rest": { icon: "wait", kind: "fair", word: "Must rest first" },
  silent: { icon: "dot", kind: "none", word: "Silent" },
};

export const page: Page = {
  name: "mux",
  title: "Mux",
  order: 70,
  open(host, robot) {
    const box = h("div", { class: "muxes" }, emptyCard("wait", "Asking for the muxes\u2026"));
    const editing = editorBox(robot);
    host.append(box, editing.element);
    let closers: (() => void)[] = [];
    let shown = "";
    const close = watchComponents(robot.link, (components, refused) => {
      const names = components.filter(({ requests }) => "mux.LookAtMux" in requests).map(({ name }) => name);
      if (names.join() === shown && names.length > 0) return;
      shown = names.join();
      closers.forEach((end) => end());
      const views = names.map((name) => new MuxView(robot, name));
      closers = views.map((view) => () => view.close());
      const help = h("p", {}, "Muxes choose who commands a base or another part; they are written under `muxes:`.");
      editing.element.hidden = views.length === 0;
      box.replaceChildren(...(views.length > 0 ? views.map(({ element }) => element) : [emptyCard("warning", refused || "This robot has no mux.", ...(refused ? [] : [help]))]));
    });
    return () => {
      close();
      editing.close();
      closers.forEach((end) => end());
    };
  },
};

/** The editor of what the manifest says, which is opened by a button. */
function editorBox(robot: Robot): { element: HTMLElement; close: () => void } {
  const element = h("div", { class: "muxes" });
  const edit = h("button", { type: "button", class: "muxes-edit" }, icon("edit"), "Edit priorities and timeouts");
  let editor: MuxesEditor | null = null;
  const close = () => {
    editor?.close();
    editor = null;
  };
  edit.onclick = () => {
    editor = new MuxesEditor(robot, () => {
      close();
      element.replaceChildren(edit);
      edit.focus();
    });
    element.replaceChildren(editor.element);
  };
  element.hidden = true;
  if (robot.config.role === "configure") element.append(edit);
  return { element, close };
}

class MuxView {
  readonly element: HTMLElement;
  readonly #robot: Robot;
  readonly #name: string;
  readonly #why = h("p", { class: "chip", role: "status" });
  readonly #body = h("tbody", {});
  readonly #locks = h("p", { class: "label" });
  readonly #buttons = h("div", { class: "row" });
  readonly #close: () => void;
  readonly #whyNot: string; // it may not be commanded by who looks at it
  #shape = "";
  #rows = new Map<string, Row>();

  constructor(robot: Robot, name: string) {
    [this.#robot, this.#name, this.#whyNot] = [robot, name, whyNot(robot.config, "operate")];
    const head = ["Input", "Priority", "State", "Last heard", "Control"].map((title) => h("th", { scope: "col" }, title));
    const table = h("table", {}, h("thead", {}, h("tr", {}, ...head)), this.#body);
    const wide = h("div", { class: "wide", tabindex: "0", role: "region", "aria-label": `Inputs of ${name}` }, table);
    this.element = h("section", { class: "card mux", "aria-label": name }, h("h2", {}, formatName(name)), this.#why, wide, this.#locks, this.#buttons);
    this.#close = robot.link.watch(`mux/LookAtMux/component/${name}`, (answer, refused) => this.#show(answer, refused), LOOK);
  }

  close(): void {
    this.#close();
  }

  #show(answer: Json, refused: string): void {
    if (!isMessage(answer)) {
      if (refused) setText(this.#why, refused);
      return;
    }
    const mux = answer as unknown as Mux;
    const shape = `${mux.mode} ${mux.inputs.map(({ name }) => name).join()}`;
    if (shape !== this.#shape) {
      this.#shape = shape;
      this.#rows = new Map(mux.inputs.map(({ name, topic }) => [name, new Row(name, topic, mux.mode === "select", this.#whyNot, (request) => this.#ask(request))]));
      this.#body.replaceChildren(...[...this.#rows.values()].map(({ element }) => element));
      this.#buttons.replaceChildren(...this.#commands(mux));
    }
    this.#why.dataset.kind = mux.holder ? "good" : "none";
    const words = mux.holder ? `${formatName(mux.holder)} commands` : "Nobody commands";
    const text = mux.why && mux.why !== `${mux.holder} holds` && mux.why !== "no input" ? `${words}: ${mux.why}` : words;
    if (this.#why.textContent !== text) this.#why.replaceChildren(icon(mux.holder ? "check" : "dot"), text);
    for (const input of mux.inputs) this.#rows.get(input.name)?.show(input, mux.selected === input.name);
    const engaged = mux.locks.filter(({ why }) => why).map(({ name, why }) => `${name}: ${why}`);
    setText(this.#locks, engaged.length > 0 ? `Locks: ${engaged.join("; ")}` : mux.locks.length > 0 ? "No lock is engaged." : "");
  }

  #commands(mux: Mux): HTMLElement[] {
    const button = (text: string, request: Asked) => {
      const made = h("button", { type: "button" }, text);
      made.onclick = () => void this.#ask(request);
      disable(this.#whyNot, made);
      return made;
    };
    const all = [button("Lock all", { type: "mux.LockMuxInputs" }), button("Unlock all", { type: "mux.UnlockMuxInputs" })];
    return mux.mode === "select" ? [...all, button("Select none", { type: "mux.SelectMuxInput", input: NONE })] : all;
  }

  async #ask(request: Asked): Promise<void> {
    try {
      const answer = await this.#robot.link.ask({ component: this.#name, ...request });
      if (typeof answer === "string") this.#robot.notify(answer);
    } catch (error) {
      this.#robot.notify((error as Error).message);
    }
  }
}

class Row {
  readonly element: HTMLElement;
  readonly #priority = h("td", { class: "value" });
  readonly #state = h("td", {});
  readonly #heard = h("td", { class: "value" });
  readonly #lock = h("button", { type: "button" });
  readonly #select = h("button", { type: "button" }, "Select");
  readonly #whyNot: string;
  #isLocked = false;

  constructor(name: string, topic: string, isSelected: boolean, whyNot: string, ask: (request: Asked) => Promise<void>) {
    this.#whyNot = whyNot;
    disable(whyNot, this.#lock, this.#select);
    this.#lock.onclick = () => void ask({ type: this.#isLocked ? "mux.UnlockMuxInputs" : "mux.LockMuxInputs", inputs: [name] });
    this.#select.onclick = () => void ask({ type: "mux.SelectMuxInput", input: name });
    const buttons = h("td", {}, h("div", { class: "row" }, ...(isSelected ? [this.#select] : []), this.#lock));
    const title = h("th", { scope: "row", title: topic }, formatName(name));
    this.#select.setAttribute("aria-label", `Select ${name}`);
    this.element = h("tr", { "aria-label": name }, title, this.#priority, this.#state, this.#heard, buttons);
  }

  show(input: Input, isSelected: boolean): void {
    const look = LOOKS[input.state] ?? LOOKS.silent!;
    const text = input.why && input.state !== "holds" && input.state !== "silent" ? `${look.word}: ${input.why}` : look.word;
    if (this.#state.textContent !== text) {
      this.#state.dataset.kind = look.kind;
      this.#state.replaceChildren(h("span", { class: "chip" }, icon(look.icon), text));
    }
    setText(this.#priority, input.priority === null ? "" : String(input.priority));
    setText(this.#heard, input.silent_for === null ? "never" : `${input.silent_for.toFixed(1)}\u202fs ago`);
    this.#isLocked = input.state === "locked";
    setText(this.#lock, this.#isLocked ? "Unlock" : "Lock");
    this.#lock.setAttribute("aria-label", `${this.#isLocked ? "Unlock" : "Lock"} ${input.name}`);
    this.#select.disabled = isSelected || this.#whyNot !== "";
    setText(this.#select, isSelected ? "Selected" : "Select");
  }
}
