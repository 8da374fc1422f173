/** The editor of one mission: its text, what is wrong with it, undo, and saving it on the robot. */
import { askInDialog, emptyCard, h, icon, setText } from "./dom";
import {
  askEditor,
  kindOf,
  partsOf,
  placeBehind,
  RefusedError,
  verdict,
  type Block,
  type Changed,
  type Elsewhere,
  type Found,
  type Looked,
  type Path,
  type ReadText,
} from "./edited";
import { MachineView } from "./machine_view";
import { activeStates, machinesAround } from "./machines";
import { isSeen, type Seen } from "./mission";
import { OutlineView, type Operation } from "./outline";
import type { Robot } from "./page";
import { LiveChanges } from "./live_changes";
import { LostError, type Message } from "./rosbridge";
import { ReadView, type Sentence } from "./read_view";
import { Palette, StepForm, type Form, type Offered } from "./step_form";
import { Replay } from "./replay";
import { showDryRun, showTests, type DryRun, type Statuses, type TestReport } from "./trial";
import type { TextEditor } from "./text_editor";
import "./mission_editor.css";

const PAUSE = 20; // [ms] after a key, until the text is looked at; what is typed meanwhile waits for the answer
const TRYING = 95_000; // [ms] for a dry run
const FORM = 150; // [ms] after a choice, until its form is drawn
const LOOK = 500; // [ms] between two looks at the mission on the robot
const REST = 1_000; // [ms] after that, until the whole robot is checked with it

const VIEWS = { text: "Text", read: "Read", graph: "Graph" } as const; // beside the outline
type View = keyof typeof VIEWS;

/** What was typed and not saved, by mission: it stays while the page shows something else. */
const drafts = new Map<string, { text: string; hash: string; saved: string }>();

window.addEventListener("beforeunload", (event) => {
  if ([...drafts.values()].some(({ text, saved }) => text !== saved)) event.preventDefault();
});

export class MissionEditor {
  readonly element = h("section", { class: "card mission-editor", "aria-label": "Editor" });
  readonly #robot: Robot;
  readonly #mission: string;
  readonly #done: () => void;
  readonly #says = h("p", { class: "editor-says", role: "status" }); // of a save: it stays until something else is done
  readonly #unchecked = h("p", { class: "editor-says", role: "status" });
  readonly #verdict = h("span", { class: "chip", role: "status" });
  readonly #list = h("ul", { class: "findings", "aria-label": "Mistakes" });
  readonly #tools = h("div", { class: "editor-tools" });
  readonly #panes = h("div", { class: "editor-panes" });
  readonly #file = h("p", { class: "label" });
  readonly #undo = button("undo", "Undo", () => this.#text?.undo());
  readonly #redo = button("redo", "Redo", () => this.#text?.redo());
  readonly #save = button("check", "Save", () => void this.#offer());
  readonly #try = button("play", "Dry run", () => void this.#run("try"));
  readonly #test = button("check", "Test", () => void this.#run("test"));
  readonly #trial = h("div", {});
  readonly #live: LiveChanges;
  readonly #closers: (() => void)[] = [];
  readonly #outline = new OutlineView(
    (operation) => void this.#change(operation),
    (block, isByHand) => this.#chose(block, isByHand),
    () => this.#text?.focus(),
  );
  readonly #palette = new Palette(
    (offered) => this.#add(offered),
    ({ path, index }) => void this.#change({ op: "add", path, index }),
  );
  readonly #form = new StepForm(
    ({ key, within, shape }, value) => this.#set({ op: "set", key, within, shape, value }),
    (name) => this.#set({ op: "rename", name }),
  );
  readonly #read = new ReadView((path) => this.#outline.choose(path));
  readonly #graph = new MachineView(({ path }) => this.#outline.choose(path));
  readonly #views = new Map<View, HTMLButtonElement>();
  #view: View = "text";
  #isReading = false;
  #active: ReadonlySet<string> = new Set();
  #stopLooking: () => void = () => undefined;
  #text: TextEditor | null = null;
  #formTimer: ReturnType<typeof setTimeout> | undefined;
  #wanted: Path | null = null; // the block to choose in the next outline
  #isChanging = false;
  #isTrying = false;
  #replay: Replay | null = null;
  #ran: { text: string; run: DryRun } | null = null; // the last dry run, and the text that ran
  #saved = "";
  #hash = "";
  #canSave = false;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #version = 0;
  #isAsking = false;
  #isUnchecked = false; // it was asked, and not answered
  #isLost = false; // while it was saved
  #isClosed = false;

  constructor(robot: Robot, mission: string, done: () => void) {
    this.#robot = robot;
    this.#live = new LiveChanges(robot);
    this.#mission = mission;
    this.#done = done;
    this.element.append(emptyCard("wait", "Reading the mission\u2026"));
    this.#closers.push(robot.link.state.watch(({ is }) => is === "open" && this.#isBack()));
    void this.#open();
  }

  /** Asks again what was not answered, since the connection is back. */
  #isBack(): void {
    if (this.#isLost) void this.#learnSaved();
    if (this.#isUnchecked) void this.#ask("look");
    if (this.#text) this.#live.lookAgain();
  }

  close(): void {
    this.#isClosed = true;
    clearTimeout(this.#timer);
    clearTimeout(this.#formTimer);
    this.#stopLooking();
    this.#replay?.close();
    for (const close of this.#closers) close();
    this.#live.close();
    this.#keepDraft();
    this.#text?.close();
  }

  async #open(): Promise<void> {
    try {
      const [read, { TextEditor }] = await Promise.all([this.#load(), import("./text_editor")]);
      if (this.#isClosed) return;
      const draft = drafts.get(this.#mission);
      this.#text = new TextEditor(
        "Text of the mission",
        read.text,
        () => this.#changed(),
        (at) => this.#outline.follow(at),
      );
      this.#text.element.className = "editor-text";
      this.#take(read);
      if (draft) this.#text.replace(draft.text);
      if (draft && draft.hash !== read.hash) this.#offerTheirs(`'${read.file}' has changed on disk since you began.`);
      if (draft) this.#hash = draft.hash;
      this.#canSave = this.#robot.config.role === "configure" && !read.why_not;
      this.#text.allow(this.#canSave);
      this.#outline.allow(this.#canSave);
      const why = read.why_not || (this.#canSave ? "" : "To change it, open the link of the role configure.");
      setText(this.#file, `${this.#mission} in ${read.file}${why ? `: ${why}` : ""}`);
      this.#draw();
      void this.#fillPalette();
      void this.#live.look();
      if (!draft) {
        this.#show(read);
        void this.#ask("check");
      }
      this.#mayUndo();
    } catch (error) {
      if (this.#isClosed) return;
      const back = button("cross", "Close", this.#done);
      const again = button("undo", "Try again", () => {
        this.element.replaceChildren(emptyCard("wait", "Reading the mission\u2026"));
        void this.#open();
      });
      this.element.replaceChildren(emptyCard("warning", (error as Error).message, h("div", { class: "row" }, again, back)));
    }
  }

  #draw(): void {
    const close = button("cross", "Close", this.#done);
    const bar = h("div", { class: "editor-bar" }, this.#undo, this.#redo, this.#save, this.#try, this.#test, this.#verdict, close);
    this.element.replaceChildren(bar, this.#file, this.#says, this.#unchecked, this.#live.element, this.#panes, this.#list, this.#trial, this.#tools);
    this.#tools.replaceChildren(this.#palette.element, this.#form.element);
    const views = (Object.keys(VIEWS) as View[]).map((view) => {
      const choose = h("button", { type: "button" }, VIEWS[view]);
      choose.onclick = () => this.#see(view);
      this.#views.set(view, choose);
      return choose;
    });
    const which = h("div", { class: "outline-bar", role: "group", "aria-label": "Beside the outline" }, ...views);
    const side = h("div", { class: "editor-side" }, which, this.#text!.element, this.#read.element, this.#graph.element);
    this.#panes.replaceChildren(this.#outline.element, side);
    this.#see("text");
  }

  /** Shows the text, the mission in sentences, or the graph of its machines beside the outline. */
  #see(view: View): void {
    this.#view = view;
    const elements = { text: this.#text!.element, read: this.#read.element, graph: this.#graph.element };
    for (const [one, button] of this.#views) {
      elements[one].hidden = one !== view;
      button.setAttribute("aria-pressed", String(one === view));
    }
    this.#stopLooking();
    this.#stopLooking = view === "graph" ? this.#lookAtRobot() : () => undefined;
    this.#fillView();
  }

  /** Follows the states in which the robot is; they are known by their names, since it may run an older text. */
  #lookAtRobot(): () => void {
    return this.#robot.link.watch(
      `mission/LookAtAll/mission/${this.#mission}`,
      (answer) => {
        this.#active = isSeen(answer) ? activeStates(answer as unknown as Seen) : new Set();
        if (!this.#isClosed && this.#view === "graph") this.#drawGraph();
      },
      LOOK,
    );
  }

  #fillView(): void {
    if (this.#view === "read") void this.#readAloud();
    if (this.#view === "graph") this.#drawGraph();
  }

  async #readAloud(): Promise<void> {
    if (this.#isReading) return;
    this.#isReading = true;
    const { text } = this.#text!;
    try {
      const sentences = await askEditor<Sentence[]>(this.#robot.link, "aloud", this.#mission, { text });
      if (!this.#isClosed) this.#read.show(sentences, this.#outline.chosen);
    } catch (error) {
      this.#read.tell((error as Error).message);
    }
    this.#isReading = false;
  }

  #drawGraph(): void {
    const { outline, chosen } = this.#outline;
    const statuses = this.#ran?.text === this.#text!.text ? this.#ran.run.statuses : [];
    void this.#graph.show(machinesAround(outline, chosen), chosen, { statuses, active: this.#active });
  }

  #load(): Promise<ReadText> {
    return askEditor<ReadText>(this.#robot.link, "read", this.#mission);
  }

  #take(read: ReadText): void {
    this.#saved = read.text;
    this.#hash = read.hash;
  }

  #keepDraft(): void {
    const text = this.#text?.text;
    if (text === undefined || text === this.#saved) drafts.delete(this.#mission);
    else drafts.set(this.#mission, { text, hash: this.#hash, saved: this.#saved });
  }

  // What is wrong

  #changed(): void {
    this.#version += 1;
    this.#keepDraft();
    this.#mayUndo();
    if (!this.#isLost && !this.#says.querySelector("button")) setText(this.#says, ""); // an offer stays until it is taken
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => void this.#ask("look"), PAUSE);
  }

  /** Asks what is wrong; what is typed meanwhile is asked afterwards. */
  async #ask(what: "look" | "check"): Promise<void> {
    if (this.#isAsking || this.#isClosed) return;
    this.#isAsking = true;
    const version = this.#version;
    try {
      const looked = await askEditor<Looked>(this.#robot.link, what, this.#mission, { text: this.#text!.text });
      this.#isUnchecked = false;
      setText(this.#unchecked, "");
      if (version === this.#version && !this.#isClosed) this.#show(looked);
    } catch (error) {
      this.#isUnchecked = true;
      setText(this.#verdict, "Not checked");
      setText(this.#unchecked, `It could not be checked: ${(error as Error).message}`);
    }
    this.#isAsking = false;
    clearTimeout(this.#timer);
    if (version !== this.#version) this.#timer = setTimeout(() => void this.#ask("look"), PAUSE);
    else if (what === "look") this.#timer = setTimeout(() => void this.#ask("check"), REST);
  }

  #show(looked: Looked): void {
    if (looked.outline) {
      this.#outline.show(looked.outline, this.#wanted, this.#text!.cursor);
      // What added the block may be gone from the page: whoever works by keys goes on at the block.
      if (this.#wanted && document.activeElement === document.body) this.#outline.focus();
      this.#wanted = null;
      this.#replay?.colour();
      this.#fillView();
    }
    this.#text!.mark(looked.findings);
    const isFine = looked.count === 0;
    const isChecked = !looked.outline || !isFine; // a look does not see all that a check finds
    this.#verdict.dataset.state = looked.errors > 0 ? "failure" : isFine && isChecked ? "success" : "waiting";
    this.#verdict.replaceChildren(icon(!isFine ? "warning" : isChecked ? "check" : "wait"), isChecked ? verdict(looked) : "Checking\u2026");
    const left = looked.count - looked.findings.length;
    this.#list.replaceChildren(
      ...looked.findings.map((found) => this.#row(found)),
      ...(left > 0 ? [h("li", { class: "label" }, `and ${left} more`)] : []),
      ...looked.elsewhere.map((found) => rowElsewhere(found)),
    );
    this.#list.hidden = this.#list.childElementCount === 0;
  }

  #row(found: Found): HTMLElement {
    const place = h("button", { type: "button", class: "finding-place" }, `Line ${found.line}`);
    place.onclick = () => {
      this.#text!.show(found.from);
      this.#text!.focus();
    };
    const row = h("li", { class: "finding", "data-severity": found.severity }, icon("warning"), place, wordsOf(found));
    const { fix } = found;
    if (fix && this.#canSave) {
      row.append(
        button("check", fix.title, () => {
          this.#text!.edit(fix.edits);
          this.#text!.focus();
        }),
      );
    }
    return row;
  }

  // The outline

  #chose(block: Block | null, isByHand: boolean): void {
    if (block && isByHand) this.#text?.show(block.from, block.to);
    else this.#text?.hideBlock();
    this.#palette.showParts(partsOf(this.#outline.outline, block));
    this.#read.mark(block);
    if (this.#view === "graph") this.#drawGraph();
    clearTimeout(this.#formTimer);
    this.#formTimer = setTimeout(() => void this.#fillForm(block), FORM);
  }

  async #fillPalette(): Promise<void> {
    const offered = await askEditor<Offered[]>(this.#robot.link, "palette", this.#mission).catch(() => []);
    this.#palette.show(offered, this.#canSave);
  }

  async #fillForm(block: Block | null): Promise<void> {
    if (this.#isClosed) return;
    if (!block) return this.#form.hide("Choose a step to see its options.");
    const { text } = this.#text!;
    try {
      const form = await askEditor<Form>(this.#robot.link, "form", this.#mission, { text, path: block.path });
      if (block === this.#outline.chosen && text === this.#text!.text) this.#form.show(form, this.#canSave);
    } catch (error) {
      if (block === this.#outline.chosen) this.#form.hide((error as Error).message);
    }
  }

  #add(offered: Offered): void {
    const place = placeBehind(this.#outline.outline, this.#outline.chosen);
    if (place) void this.#change({ op: "insert", yaml: offered.yaml, ...place });
    else this.#robot.notify("Choose a step first: the new one goes behind it.");
  }

  #set(operation: { op: string; [key: string]: string | Path }): void {
    const block = this.#outline.chosen;
    if (block) void this.#change({ ...operation, path: block.path } as Operation);
  }

  /** Has the robot say how a change of the outline changes the text. */
  async #change(operation: Operation): Promise<void> {
    if (this.#isChanging || this.#isClosed) return;
    this.#isChanging = true;
    const { text } = this.#text!;
    try {
      const made = await askEditor<Changed>(this.#robot.link, "edit", this.#mission, { text, operation });
      if (this.#isClosed || this.#text!.text !== text) return; // it was typed meanwhile: that counts
      this.#wanted = made.chosen;
      this.#text!.edit(made.edits);
      clearTimeout(this.#timer);
      void this.#ask("look");
    } catch (error) {
      this.#robot.notify((error as Error).message);
    } finally {
      this.#isChanging = false;
    }
  }

  // Trying it

  /** Runs the text as it is here on the simulated robot, or the tests of the mission with it. */
  async #run(what: "try" | "test"): Promise<void> {
    const { text } = this.#text!;
    this.#isTrying = true;
    this.#mayUndo();
    this.#trial.replaceChildren(h("p", { role: "status" }, what === "try" ? "Running on the simulated robot\u2026" : "Running its tests\u2026"));
    try {
      if (what === "test") this.#trial.replaceChildren(showTests(await this.#askLong<TestReport>(what, { text }), text !== this.#saved));
      else {
        const run = await this.#askLong<DryRun>(what, { text });
        this.#replay?.close();
        this.#ran = { text, run };
        this.#replay = new Replay(run, (statuses) => this.#colour(statuses));
        const isWhole = run.outcome !== "" && text === this.#saved && this.#robot.config.role === "configure";
        const keep = button("check", "Keep as a test", () => void this.#keepAsTest(keep));
        this.#trial.replaceChildren(showDryRun(run, this.#replay.element, ...(isWhole ? [h("div", { class: "row" }, keep)] : [])));
        this.#fillView();
      }
    } catch (error) {
      this.#trial.replaceChildren(h("p", { role: "status" }, icon("warning"), ` ${(error as Error).message}`));
    }
    this.#isTrying = false;
    this.#mayUndo();
  }

  async #keepAsTest(keep: HTMLButtonElement): Promise<void> {
    keep.disabled = true;
    try {
      const { file } = await this.#askLong<{ file: string }>("test_new", {});
      this.#robot.notify(`The test '${file}' expects that it ends as here, by the same steps.`);
    } catch (error) {
      this.#robot.notify(`Not kept: ${(error as Error).message}`);
    }
  }

  /** Colours the outline as it was in the dry run; a text that has changed since has other blocks. */
  #colour(statuses: Statuses): void {
    if (this.#ran?.text === this.#text!.text) this.#outline.colour(statuses);
  }

  #askLong<T>(what: string, given: Message): Promise<T> {
    return askEditor<T>(this.#robot.link, what, this.#mission, given, TRYING);
  }

  #mayUndo(): void {
    this.#try.disabled = this.#test.disabled = this.#isTrying || this.#robot.config.role === "view";
    this.#undo.disabled = !this.#text?.canUndo;
    this.#redo.disabled = !this.#text?.canRedo;
    this.#save.disabled = !this.#canSave || this.#text?.text === this.#saved;
  }

  // Saving

  async #offer(): Promise<void> {
    const text = this.#text!.text;
    this.#save.disabled = true;
    setText(this.#says, "Comparing with the file\u2026");
    try {
      const given = { text, hash: this.#hash, dry_run: true };
      const trial = await askEditor<Looked & { diff: string[] }>(this.#robot.link, "save", this.#mission, given);
      if (this.#isClosed) return;
      setText(this.#says, "");
      if (text === this.#text!.text) this.#show(trial);
      if (await confirmed(this.element, trial, this.#file.textContent ?? "")) await this.#keep(text);
      else setText(this.#says, "Not saved.");
    } catch (error) {
      this.#notSaved(error as Error);
    }
    this.#mayUndo();
  }

  async #keep(text: string): Promise<void> {
    setText(this.#says, "Saving\u2026");
    const done = await askEditor<{ hash: string; file: string }>(this.#robot.link, "save", this.#mission, { text, hash: this.#hash });
    this.#hash = done.hash;
    this.#saved = text;
    this.#keepDraft();
    setText(this.#says, `Saved in '${done.file}'.`);
  }

  #notSaved(error: Error): void {
    if (error instanceof LostError) {
      this.#isLost = true;
      setText(this.#says, "The connection was lost: whether it was saved is known when it is back.");
    } else if (error instanceof RefusedError && /changed on disk/.test(error.message)) {
      this.#offerTheirs(`Not saved: ${error.message}.`);
    } else {
      setText(this.#says, `Not saved: ${error.message}.`);
    }
  }

  /** Learns after a lost connection whether the text was saved. */
  async #learnSaved(): Promise<void> {
    this.#isLost = false;
    try {
      const read = await this.#load();
      if (read.text === this.#text!.text) {
        this.#take(read);
        this.#keepDraft();
        setText(this.#says, "The connection is back: it was saved.");
      } else if (read.hash === this.#hash) setText(this.#says, "The connection is back: it was not saved. Save it again.");
      else this.#offerTheirs("The connection is back: the file has changed on disk meanwhile.");
    } catch (error) {
      setText(this.#says, (error as Error).message);
    }
    this.#mayUndo();
  }

  #offerTheirs(why: string): void {
    const load = button("undo", "Load it", () => void this.#loadTheirs());
    this.#says.replaceChildren(h("span", {}, `${why} Undo brings your text back after loading it.`), load);
  }

  async #loadTheirs(): Promise<void> {
    try {
      const read = await this.#load();
      this.#take(read);
      this.#text!.replace(read.text);
      this.#show(read);
      setText(this.#says, "This is the file as it is on disk.");
    } catch (error) {
      setText(this.#says, (error as Error).message);
    }
    this.#mayUndo();
  }
}

function button(picture: "undo" | "redo" | "check" | "cross" | "play", text: string, act: () => void): HTMLButtonElement {
  const made = h("button", { type: "button" }, icon(picture), text);
  made.onclick = act;
  return made;
}

function wordsOf(found: Found | Elsewhere): HTMLElement {
  const words = h("span", { class: "finding-words" }, found.message);
  if (found.help) words.append(h("span", { class: "label" }, ` ${found.help}`));
  words.append(h("span", { class: "label" }, ` ${found.code}`));
  return words;
}

function rowElsewhere(found: Elsewhere): HTMLElement {
  const place = h("span", { class: "label" }, found.place || "The robot");
  return h("li", { class: "finding", "data-severity": found.severity }, icon("warning"), place, wordsOf(found));
}

/** Shows what would change in the file, and returns whether a person wants that. */
async function confirmed(host: HTMLElement, trial: Looked & { diff: string[] }, file: string): Promise<boolean> {
  const names = { old: "removed", new: "added", place: "", same: "" };
  const lines = trial.diff.map((line) => {
    const kind = kindOf(line);
    const row = h("li", { "data-kind": kind }, line);
    if (names[kind]) row.setAttribute("aria-label", `${names[kind]}: ${line.slice(1)}`);
    return row;
  });
  const title = h("h2", { id: "save-title" }, `Save ${file}?`);
  const warning = trial.errors > 0 ? [h("p", { class: "finding" }, icon("warning"), `It has ${verdict(trial)}: the robot will not come up with it.`)] : [];
  const yes = h("button", { type: "submit", value: "yes" }, icon("check"), "Write it");
  const no = h("button", { type: "submit", value: "no" }, icon("cross"), "Not now");
  const shown = h("ol", { class: "difference", tabindex: "0", "aria-label": "What changes" }, ...lines);
  const form = h("form", { method: "dialog" }, title, ...warning, shown, h("div", { class: "row" }, yes, no));
  const dialog = h("dialog", { class: "save-dialog", "aria-labelledby": "save-title" }, form);
  return (await askInDialog(host, dialog)) === "yes";
}
