/** The editor of muxes: who goes before whom, and how long each is waited for. */
import { barButton, EditsBar, TextField, withUnit } from "./edits_bar";
import { h, setText } from "./dom";
import { formatName } from "./format";
import type { Robot } from "./page";
import { editsOf, type Entry, type RobotEdits } from "./robot_edits";
import type { Message } from "./rosbridge";

export interface RankedRow extends Entry {
  group: "inputs" | "locks";
  /** The component whose output it is; empty if it is open to the outside. */
  source: string;
  priority: number | null;
  /** As it is written, with its unit; empty if there is none. */
  timeout: string;
}

export interface EditedMux extends Entry {
  has_priorities: boolean;
  rows: RankedRow[];
}

const SECTION = "muxes";
const GAP = 10; // between two priorities that were the same

/** Returns rows with the highest priority first. */
export function byPriority(rows: readonly RankedRow[]): RankedRow[] {
  return [...rows].sort((one, other) => (other.priority ?? -Infinity) - (one.priority ?? -Infinity));
}

/** Returns the values that put a row one place higher or lower among those of its mux; null if it is there already. */
export function swapped(rows: readonly RankedRow[], row: RankedRow, way: -1 | 1): Message | null {
  const sorted = byPriority(rows);
  const other = sorted[sorted.findIndex(({ group, name }) => group === row.group && name === row.name) + way];
  if (!other || row.priority === null || other.priority === null) return null;
  if (row.priority === other.priority) return { [keyOf(row, "priority")]: other.priority - way * GAP };
  return { [keyOf(row, "priority")]: other.priority, [keyOf(other, "priority")]: row.priority };
}

function keyOf({ group, name }: RankedRow, field: "priority" | "timeout"): string {
  return `${group}.${name}.${field}`;
}

export class MuxesEditor {
  readonly element = h("section", { class: "card muxes-editor", "aria-label": "Edit priorities" });
  readonly #edits: RobotEdits<EditedMux>;
  readonly #bar: EditsBar<EditedMux>;
  readonly #body = h("div", { class: "muxes-forms" });
  readonly #close: () => void;
  #rows = new Map<string, RankedForm>();

  constructor(robot: Robot, done: () => void) {
    this.#edits = editsOf<EditedMux>(robot.link, SECTION);
    this.#bar = new EditsBar(robot, this.#edits, done);
    const help = "Of those that send, the one with the highest priority commands. One that was silent for its timeout does not count.";
    this.element.append(h("h2", {}, "Edit priorities"), h("p", { class: "label" }, help), this.#bar.element, this.#body);
    this.#close = this.#edits.robot.watch(() => this.#show());
  }

  close(): void {
    this.#bar.close();
    this.#close();
  }

  #show(): void {
    const muxes = this.#edits.robot.value?.entries ?? [];
    const before = this.#rows;
    this.#rows = new Map();
    const had = document.activeElement;
    const forms = muxes.map((mux) => {
      const rows = byPriority(mux.rows).map((row) => this.#form(mux, row, before));
      const list = h("ol", { class: "ranked" }, ...rows.map(({ element }) => element));
      return h("section", { "aria-label": formatName(mux.name) }, h("h3", {}, formatName(mux.name)), list);
    });
    this.#body.replaceChildren(...forms);
    if (had instanceof HTMLElement && this.#body.contains(had)) had.focus(); // it was moved with its row
  }

  #form(mux: EditedMux, row: RankedRow, known: ReadonlyMap<string, RankedForm>): RankedForm {
    const key = `${mux.name} ${row.group} ${row.name}`;
    const set = (field: "priority" | "timeout", value: string) => this.#set(mux.name, { [keyOf(row, field)]: value });
    const form = known.get(key) ?? new RankedForm(row, set);
    form.move = (way) => {
      const current = this.#edits.robot.value?.entries.find(({ name }) => name === mux.name);
      const now = current?.rows.find(({ group, name }) => group === row.group && name === row.name);
      const values = now ? swapped(current!.rows, now, way) : null;
      if (values) void this.#set(mux.name, values);
    };
    const mayEdit = this.#bar.canSave && row.why_not === "";
    form.show(row, mux.has_priorities, mayEdit, [-1, 1].map((way) => swapped(mux.rows, row, way as -1 | 1) !== null));
    this.#rows.set(key, form);
    return form;
  }

  #set(mux: string, values: Message): Promise<boolean> {
    return this.#edits.change({ op: "set", path: [SECTION, mux], values });
  }
}

class RankedForm {
  readonly element: HTMLElement;
  move: (way: -1 | 1) => void = () => undefined;
  readonly #priority: TextField;
  readonly #timeout: TextField;
  readonly #up: HTMLButtonElement;
  readonly #down: HTMLButtonElement;
  readonly #note = h("small", { class: "label" });

  constructor({ group, name }: RankedRow, set: (field: "priority" | "timeout", value: string) => Promise<boolean>) {
    const title = formatName(name);
    const typed = async (field: "priority" | "timeout", text: string) => {
      const value = field === "timeout" ? withUnit(text, "s") : text;
      if (!(await set(field, value))) (field === "timeout" ? this.#timeout : this.#priority).refuse(text);
    };
    this.#priority = new TextField("Priority", (text) => void typed("priority", text), { inputmode: "numeric" });
    this.#timeout = new TextField("Timeout", (text) => void typed("timeout", text));
    this.#up = barButton("up", "", () => this.move(-1));
    this.#down = barButton("down", "", () => this.move(1));
    this.#up.setAttribute("aria-label", `${title}: one place higher`);
    this.#down.setAttribute("aria-label", `${title}: one place lower`);
    const words = h("div", { class: "ranked-name" }, h("strong", {}, title), this.#note);
    const group_ = { role: "group", "aria-label": group === "locks" ? `Lock ${name}` : name };
    this.element = h("li", {}, h("div", { class: "ranked-row", ...group_ }, words, this.#priority.element, this.#timeout.element, this.#up, this.#down));
  }

  show(row: RankedRow, hasPriorities: boolean, mayEdit: boolean, mayMove: readonly boolean[]): void {
    const what = row.group === "locks" ? "Lock" : row.source ? `From ${row.source}` : "From outside";
    setText(this.#note, row.why_not ? `${what}. It cannot be changed here: ${row.why_not}.` : what);
    this.#priority.element.hidden = this.#up.hidden = this.#down.hidden = !hasPriorities;
    this.#priority.show(row.priority === null ? "" : String(row.priority), mayEdit);
    this.#timeout.show(row.timeout, mayEdit && row.timeout !== "");
    this.#up.disabled = !mayEdit || !mayMove[0];
    this.#down.disabled = !mayEdit || !mayMove[1];
  }
}
