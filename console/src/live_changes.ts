/** Brings what was saved to the robot that runs, as `rbxcompose apply` does, and takes it back. */
import { fetchConfig, whyNot } from "./config";
import { askInDialog, disable, h, icon } from "./dom";
import { RefusedError } from "./edited";
import type { Robot } from "./page";
import { askRobotEditor } from "./robot_edits";
import { LostError } from "./rosbridge";
import "./live_changes.css";

interface Reason {
  key: string;
  before: string | null;
  after: string | null;
}

/** What would change in the robot that runs. */
export interface LiveDifference {
  generation: number;
  is_empty: boolean;
  why_not: string;
  components: { name: string; fate: string; reasons: Reason[] }[];
  said: string[];
}

const MOST_REASONS = 4; // shown for one component

/** A line that says whether the robot that runs is what its files say; empty as long as it is. Others may change both. */
export class LiveChanges {
  readonly element = h("div", { class: "live-changes", role: "status" });
  /** Whether the robot was changed, so that pages show something else when they open. */
  isChanged = false;
  readonly #robot: Robot;
  /** Follows no more what others change. */
  readonly close: () => void;
  #newest = 0;
  #isActing = false; // something is offered or done, after which it looks by itself

  constructor(robot: Robot) {
    this.#robot = robot;
    this.close = robot.link.watch("changes", () => this.lookAgain());
  }

  /** Compares again, since something may have changed. */
  lookAgain(): void {
    if (!this.#isActing) void this.look();
  }

  /** Compares the robot that runs with its files; `done` was done just before. */
  async look(done = "", applied: number | null = null): Promise<void> {
    const number = ++this.#newest;
    let found: LiveDifference | Error;
    try {
      found = await askRobotEditor<LiveDifference>(this.#robot.link, "compare", {});
    } catch (error) {
      found = error as Error;
    }
    if (number === this.#newest) this.#show(found, done, applied);
  }

  #show(found: LiveDifference | Error, done: string, applied: number | null): void {
    const words: Node[] = done ? [h("span", {}, icon("check"), ` ${done}`)] : [];
    if (applied !== null) words.push(this.#button("undo", "Take it back", () => this.#revert(applied)));
    if (found instanceof Error) {
      const what = found instanceof RefusedError ? "What is saved cannot run" : "It is not known whether the robot runs what is saved";
      words.push(h("span", {}, icon("warning"), ` ${what}: ${found.message}`));
    } else if (!found.is_empty) {
      words.push(h("span", {}, icon("warning"), ` The robot runs without what is saved: ${fates(found)}.`));
      const change = this.#button("play", "Change the running robot\u2026", () => this.#offer(found));
      if (found.why_not) {
        disable(found.why_not, change);
        words.push(h("span", { class: "label" }, `Not now: ${found.why_not}.`), this.#button("undo", "Look again", () => this.look()));
      }
      words.push(change);
    }
    this.element.replaceChildren(...words);
  }

  #button(picture: "undo" | "play", text: string, act: () => Promise<void>): HTMLButtonElement {
    const made = h("button", { type: "button" }, icon(picture), text);
    disable(whyNot(this.#robot.config, "configure"), made);
    made.onclick = () => {
      made.disabled = this.#isActing = true;
      void act().finally(() => (this.#isActing = false));
    };
    return made;
  }

  async #offer(found: LiveDifference): Promise<void> {
    if ((await askInDialog(this.element, dialogOf(found))) !== "yes") return this.look();
    await this.#do("apply", found.generation, "The robot is changed.", found.generation);
  }

  async #revert(generation: number): Promise<void> {
    await this.#do("revert", generation, "The robot runs as before; the files stay as they are.", null);
  }

  async #do(what: string, generation: number, done: string, applied: number | null): Promise<void> {
    try {
      await askRobotEditor(this.#robot.link, what, { generation });
      Object.assign(this.#robot.config, await fetchConfig());
      this.isChanged = true;
      await this.look(done, applied);
    } catch (error) {
      // Where the console itself starts again, it is done when the connection is back: the next look says so.
      if (error instanceof LostError) return;
      await this.look();
      this.element.prepend(h("span", { class: "live-refused" }, icon("cross"), ` Not done: ${(error as Error).message}`));
    }
  }
}

/** Says what would happen to which components: `mission would be changed live`. */
export function fates(found: LiveDifference): string {
  return found.components.map(({ name, fate }) => `${name} would be ${fate}`).join(", ");
}

function dialogOf(found: LiveDifference): HTMLDialogElement {
  const rows = found.components.flatMap(({ name, fate, reasons }) => [
    h("li", { "data-kind": "place" }, `${name}: ${fate}`),
    ...reasons.slice(0, MOST_REASONS).map((reason) => h("li", {}, words(reason))),
    ...(reasons.length > MOST_REASONS ? [h("li", {}, `and ${reasons.length - MOST_REASONS} more`)] : []),
  ]);
  const said = found.said.map((text) => h("li", {}, text));
  const title = h("h2", { id: "live-title" }, "Change the robot while it runs?");
  const yes = h("button", { type: "submit", value: "yes" }, icon("play"), "Change it");
  const no = h("button", { type: "submit", value: "no" }, icon("cross"), "Not now");
  const form = h(
    "form",
    { method: "dialog" },
    title,
    h("ol", { class: "difference", tabindex: "0", "aria-label": "What changes" }, ...rows),
    ...(said.length > 0 ? [h("ul", { class: "live-said", "aria-label": "What happens to what runs" }, ...said)] : []),
    h("div", { class: "row" }, yes, no),
  );
  return h("dialog", { class: "save-dialog", "aria-labelledby": "live-title" }, form);
}

function words({ key, before, after }: Reason): string {
  if (before === null) return `${key}: ${after} (new)`;
  return after === null ? `${key}: ${before} (gone)` : `${key}: ${before} \u2192 ${after}`;
}
