/** What stands around every editor of the robot: undo, save with what changes, what is wrong. */
import { askInDialog, h, icon, type Icon } from "./dom";
import { kindOf, verdict } from "./edited";
import { LiveChanges } from "./live_changes";
import type { Robot } from "./page";
import type { Entry, RobotEdits, RobotFound, SaveTrial } from "./robot_edits";
import "./mission_editor.css";
import "./edits_bar.css";

const MOST_OLD = 3; // findings shown that were there before

export class EditsBar<E extends Entry> {
  readonly element = h("div", { class: "edits-bar" });
  readonly #robot: Robot;
  readonly #edits: RobotEdits<E>;
  readonly #says = h("p", { class: "editor-says", role: "status" });
  readonly #verdict = h("span", { class: "chip", role: "status" });
  readonly #list = h("ul", { class: "findings", tabindex: "0", "aria-label": "Mistakes" });
  readonly #undo = barButton("undo", "Undo", () => void this.#edits.undo());
  readonly #redo = barButton("redo", "Redo", () => void this.#edits.redo());
  readonly #save = barButton("check", "Save", () => void this.#offer());
  readonly #load = barButton("undo", "Load it again", () => void this.#edits.reload());
  readonly #live: LiveChanges;
  readonly #closers: (() => void)[];

  constructor(robot: Robot, edits: RobotEdits<E>, done: () => void) {
    [this.#robot, this.#edits] = [robot, edits];
    const close = barButton("cross", "Close", () => {
      done();
      if (this.#live.isChanged) window.dispatchEvent(new HashChangeEvent("hashchange")); // the page opens again
    });
    const bar = h("div", { class: "editor-bar" }, this.#undo, this.#redo, this.#save, close, this.#verdict);
    this.#live = new LiveChanges(robot);
    this.element.append(bar, this.#says, this.#live.element, this.#list);
    this.#closers = [
      edits.robot.watch(() => this.#show()),
      edits.says.watch(() => this.#show()),
      edits.isStale.watch(() => this.#show()),
      robot.link.state.watch(({ is }) => {
        if (is === "open") void edits.open().then(() => this.#live.lookAgain());
        this.#show();
      }),
    ];
  }

  close(): void {
    for (const close of this.#closers) close();
    this.#live.close();
  }

  /** Whether this visitor may change and save anything. */
  get canSave(): boolean {
    return this.#robot.config.role === "configure";
  }

  #show(): void {
    const edits = this.#edits;
    const robot = edits.robot.value;
    this.#undo.disabled = !edits.canUndo;
    this.#redo.disabled = !edits.canRedo;
    this.#save.disabled = !edits.canUndo || !this.canSave || this.#robot.link.state.value.is !== "open";
    const why = this.canSave ? (robot?.why_not ?? "") : "To change it, open the link of the role configure.";
    const text = edits.says.value || why || (robot ? "" : "Reading the robot\u2026");
    if (this.#says.firstChild?.textContent !== text || edits.isStale.value !== this.#says.contains(this.#load)) {
      this.#says.replaceChildren(...(text ? [h("span", {}, text)] : []), ...(edits.isStale.value ? [this.#load] : []));
    }
    if (!robot) return;
    this.#verdict.dataset.state = robot.errors > 0 ? "failure" : robot.count > 0 ? "waiting" : "success";
    this.#verdict.replaceChildren(icon(robot.count > 0 ? "warning" : "check"), verdict(robot));
    const fresh = robot.findings.filter((found) => found.is_new);
    const old = robot.findings.filter((found) => !found.is_new);
    this.#list.replaceChildren(...findingRows([...fresh, ...old.slice(0, MOST_OLD)], old.length - MOST_OLD));
    this.#list.hidden = this.#list.childElementCount === 0;
  }

  async #offer(): Promise<void> {
    this.#save.disabled = true;
    const trial = await this.#edits.compare();
    if (trial && (await confirmed(this.element, trial))) await this.#edits.save();
    this.#show();
  }
}

function findingRows(findings: readonly RobotFound[], left: number): HTMLElement[] {
  const rows = findings.map((found) => {
    const words = h("span", { class: "finding-words" }, found.message);
    if (found.help) words.append(h("span", { class: "label" }, ` ${found.help}`));
    const since = found.is_new ? "by your changes" : "was there before";
    words.append(h("span", { class: "label" }, ` ${found.code}, ${since}`));
    const place = h("span", { class: "label finding-file" }, found.place || "The robot");
    return h("li", { class: "finding", "data-severity": found.severity }, icon("warning"), words, place);
  });
  return left > 0 ? [...rows, h("li", { class: "label" }, `and ${left} more that were there before`)] : rows;
}

/** Shows what would change in the files, and returns whether a person wants that. */
export async function confirmed(host: HTMLElement, trial: SaveTrial): Promise<boolean> {
  const names = { old: "removed", new: "added", place: "", same: "" };
  const lines = trial.diff.map((line) => {
    const kind = kindOf(line);
    const row = h("li", { "data-kind": kind }, line);
    if (names[kind]) row.setAttribute("aria-label", `${names[kind]}: ${line.slice(1)}`);
    return row;
  });
  const fresh = trial.findings.filter(({ is_new }) => is_new);
  const warning =
    trial.errors > 0
      ? [h("p", { class: "finding" }, icon("warning"), h("span", { class: "finding-words" }, `It has ${verdict(trial)}: the robot does not come up with it.`))]
      : [];
  const list = fresh.length > 0 ? [h("ul", { class: "findings", tabindex: "0", "aria-label": "What is wrong then" }, ...findingRows(fresh, 0))] : [];
  const yes = h("button", { type: "submit", value: "yes" }, icon("check"), "Write it");
  const no = h("button", { type: "submit", value: "no" }, icon("cross"), "Not now");
  const shown = h("ol", { class: "difference", tabindex: "0", "aria-label": "What changes" }, ...lines);
  const title = h("h2", { id: "save-title" }, "Save these changes?");
  const form = h("form", { method: "dialog" }, title, ...warning, ...list, shown, h("div", { class: "row" }, yes, no));
  const dialog = h("dialog", { class: "save-dialog", "aria-labelledby": "save-title" }, form);
  return (await askInDialog(host, dialog)) === "yes";
}

export function barButton(picture: Icon, text: string, act: () => void): HTMLButtonElement {
  const made = h("button", { type: "button" }, icon(picture), text);
  made.onclick = act;
  return made;
}

/** A field for a text, such as a number with its unit; `set` gets what was typed when a person is done with it. */
export class TextField {
  readonly element: HTMLLabelElement;
  readonly input: HTMLInputElement;
  #shown = "";

  constructor(words: string, set: (text: string) => void, more: Record<string, string> = {}) {
    this.input = h("input", { autocomplete: "off", spellcheck: "false", ...more });
    this.element = h("label", { class: "field" }, words, this.input);
    this.input.onchange = () => {
      if (this.input.value.trim() !== this.#shown) set(this.input.value.trim());
    };
  }

  show(text: string, isEnabled: boolean): void {
    this.#shown = text;
    if (this.input.value !== text) this.input.value = text;
    this.input.disabled = !isEnabled;
    this.input.removeAttribute("aria-invalid");
  }

  /** Shows what was typed once more, to be corrected, and that it was refused. */
  refuse(text: string): void {
    this.input.value = text;
    this.input.setAttribute("aria-invalid", "true");
  }
}

/** Returns a number with a unit, if it was typed without one. */
export function withUnit(text: string, unit: string): string {
  return /^[-+\u2212]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(text) ? `${text.replace("\u2212", "-")} ${unit}` : text;
}
