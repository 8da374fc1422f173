/** Parameters: what may change while the robot runs, by sliders, boxes and lists; kept in the manifest by Save. */
import { whyNot } from "../config";
import { disable, emptyCard, h, icon, setText } from "../dom";
import { confirmed } from "../edits_bar";
import { formatName } from "../format";
import type { Page, Robot } from "../page";
import {
  Changes,
  isValue,
  limitsOf,
  parameterOf,
  parsed,
  Sender,
  settingOf,
  shownOf,
  slideOf,
  textOf,
  valueOf,
  type Setting,
  type Value,
} from "../parameters";
import { isMessage, LostError, type Json, type Message } from "../rosbridge";
import "./parameters.css";

const PAUSE = 200; // [ms] between two values of a slider
const SAVING = 30_000; // [ms]
const UNSAVABLE = "It cannot be saved now";

/** What `param save` would write. */
interface Saving {
  saved: Unsaved[];
  places: string[];
  difference: string[];
  /** Of what was shown: only that is written. */
  hash: string;
}

/** What a node has, or why that is unknown. */
interface Found {
  node: string;
  settings: { setting: Setting; value: Value }[];
  refused: string;
}

/** A value that is not as in the manifest, in SI. */
interface Unsaved {
  component: string;
  name: string;
  old: Json;
  new: Json;
}

const rows = new Map<string, Row>();

/** What can be taken back: it stays while the page shows something else. */
const changes = new Changes((key) => rows.get(key));

export const page: Page = {
  name: "parameters",
  title: "Parameters",
  order: 50,
  open(host, robot) {
    const view = new ParametersView(robot);
    host.append(view.element);
    const close = robot.link.state.watch(({ is }) => {
      if (is === "open") void view.load();
    });
    return () => {
      close();
      view.close();
    };
  },
};

class ParametersView {
  readonly element = h("div", { class: "parameters" }, emptyCard("wait", "Asking for the parameters\u2026"));
  readonly #robot: Robot;
  readonly #filter = h("input", { type: "search", "aria-label": "Find a parameter", placeholder: "Find a parameter" });
  readonly #undo = h("button", { type: "button" }, icon("undo"), "Undo");
  readonly #save = h("button", { type: "button" }, icon("check"), "Save");
  readonly #says = h("p", { class: "says", role: "status" });
  readonly #cards = h("div", { class: "parameter-cards" });
  readonly #whyNot: string; // it may not be changed by who looks at it
  readonly #close: () => void;
  #looking = false;
  #again = false;

  constructor(robot: Robot) {
    [this.#robot, this.#whyNot] = [robot, whyNot(robot.config, "configure", "Changing them")];
    this.#filter.oninput = () => this.#find();
    this.#undo.onclick = () => this.#takeBack();
    this.#save.onclick = () => void this.#keep();
    this.#undo.disabled = this.#save.disabled = true;
    setText(this.#says, this.#whyNot);
    this.#close = robot.link.subscribe("/parameter_events", (event) => this.#follow(event), {
      type: "rcl_interfaces/msg/ParameterEvent",
    });
  }

  close(): void {
    this.#close();
  }

  /** Asks all nodes for their parameters. */
  async load(): Promise<void> {
    try {
      const answer = await this.#robot.link.call("/rosapi/services");
      const services = isMessage(answer) && Array.isArray(answer.services) ? answer.services.map(String) : [];
      const nodes = services.flatMap((name) => /^(.+)\/describe_parameters$/.exec(name)?.[1] ?? []);
      this.#show(await Promise.all(nodes.map((node) => this.#ask(node))));
      void this.#look();
    } catch (error) {
      this.element.replaceChildren(emptyCard("warning", (error as Error).message));
    }
  }

  async #ask(node: string): Promise<Found> {
    try {
      return { node, settings: await this.#settings(node), refused: "" };
    } catch (error) {
      if (error instanceof LostError) throw error;
      return { node, settings: [], refused: (error as Error).message };
    }
  }

  async #settings(node: string): Promise<Found["settings"]> {
    const listed = await this.#robot.link.call(`${node}/list_parameters`);
    const names = isMessage(listed) && isMessage(listed.result) && Array.isArray(listed.result.names) ? listed.result.names : [];
    if (names.length === 0) return [];
    const [described, got] = await Promise.all([
      this.#robot.link.call(`${node}/describe_parameters`, { names }),
      this.#robot.link.call(`${node}/get_parameters`, { names }),
    ]);
    if (!isMessage(described) || !isMessage(got) || !Array.isArray(described.descriptors) || !Array.isArray(got.values)) return [];
    const values = got.values;
    return described.descriptors.flatMap((descriptor, at) => {
      const setting = settingOf(node, descriptor);
      const value = setting && !setting.isReadOnly ? valueOf(setting, values[at] ?? null) : null;
      return setting && value !== null ? [{ setting, value }] : [];
    });
  }

  #show(found: Found[]): void {
    const told = found.filter(({ settings, refused }) => settings.length > 0 || refused);
    if (told.length === 0) {
      const help = h("p", {}, "What may change while the robot runs is marked in the reference of its components.");
      this.element.replaceChildren(emptyCard("warning", "This robot has no parameters that may change while it runs.", help));
      return;
    }
    rows.clear();
    const cards = told.map(({ node, settings, refused }) => {
      const shown = settings.map(({ setting, value }) => {
        const row = new Row(setting, value, this.#whyNot, (before, after) => this.#set(row, before, after));
        rows.set(row.key, row);
        return row.element;
      });
      if (refused) shown.push(h("p", { class: "parameter", "data-words": node }, `Its parameters are unknown: ${refused}.`));
      return h("section", { class: "card", "aria-label": node.slice(1) }, h("h2", {}, formatName(node)), ...shown);
    });
    this.#cards.replaceChildren(...cards);
    const bar = h("div", { class: "parameter-bar" }, this.#filter, this.#undo, this.#save);
    this.element.replaceChildren(bar, this.#says, this.#cards);
    this.#undo.disabled = changes.isEmpty;
    this.#find();
  }

  #find(): void {
    const wanted = this.#filter.value.trim().toLowerCase();
    for (const row of this.#cards.querySelectorAll<HTMLElement>(".parameter")) row.hidden = !row.dataset.words!.toLowerCase().includes(wanted);
    for (const card of this.#cards.children) (card as HTMLElement).hidden = !card.querySelector(".parameter:not([hidden])");
  }

  #set(row: Row, before: Value, after: Value): void {
    changes.put(row.key, before);
    this.#send(row, after);
  }

  #send(row: Row, value: Value): void {
    row.send(value, (next) => this.#tell(row.setting, next));
    this.#undo.disabled = false;
    void row.settled.then(() => (this.#undo.disabled = changes.isEmpty));
  }

  async #tell(setting: Setting, value: Value): Promise<void> {
    const answer = await this.#robot.link.call(`${setting.node}/set_parameters`, { parameters: [parameterOf(setting, value)] });
    const result = isMessage(answer) && Array.isArray(answer.results) ? answer.results[0] : null;
    if (isMessage(result ?? null) && (result as Message).successful === false) throw new Error(String((result as Message).reason));
    void this.#look();
  }

  #takeBack(): void {
    const last = changes.takeBack();
    if (last) this.#send(rows.get(last.key)!, last.before);
    this.#undo.disabled = changes.isEmpty;
  }

  /** Takes what others have changed, and what the robot made of what was sent. */
  #follow(event: Message): void {
    const changed = [event.changed_parameters, event.new_parameters].flatMap((all) => (Array.isArray(all) ? all : []));
    for (const parameter of changed) {
      if (!isMessage(parameter)) continue;
      const row = rows.get(`${String(event.node)}:${String(parameter.name)}`);
      const value = row ? valueOf(row.setting, parameter.value ?? null) : null;
      if (row && value !== null) row.arrived(value);
    }
    if (changed.length > 0) void this.#look();
  }

  /** Learns what is not as in the manifest: one question at a time, and another if something changed meanwhile. */
  async #look(): Promise<void> {
    if (this.#whyNot) return;
    if (this.#looking) {
      this.#again = true;
      return;
    }
    this.#looking = true;
    do {
      this.#again = false;
      try {
        this.#mark((await this.#saving(true)).saved);
        if (this.#says.textContent?.startsWith(UNSAVABLE)) setText(this.#says, "");
      } catch (error) {
        this.#mark(null);
        setText(this.#says, `${UNSAVABLE}: ${(error as Error).message}`);
        this.#says.dataset.kind = "none";
      }
    } while (this.#again);
    this.#looking = false;
  }

  async #saving(isTry: boolean, hash = ""): Promise<Saving> {
    const given = { names: [], dry_run: isTry, hash };
    const answer = await this.#robot.link.call("/console/save", given, SAVING);
    if (!isMessage(answer) || answer.success !== true) throw new Error(isMessage(answer) ? String(answer.message) : "no answer");
    const told = isMessage(answer.answer ?? null) ? (answer.answer as unknown as Partial<Saving>) : {};
    return { saved: told.saved ?? [], places: told.places ?? [], difference: told.difference ?? [], hash: told.hash ?? "" };
  }

  /** Marks what is not as in the manifest; null if that is not known. */
  #mark(unsaved: Unsaved[] | null): void {
    const old = new Map((unsaved ?? []).map((one) => [`/${one.component}:${one.name}`, one.old]));
    for (const [key, row] of rows) row.mark(old.get(key), unsaved !== null);
    const count = unsaved?.length ?? 0;
    this.#save.disabled = count === 0;
    this.#save.replaceChildren(icon("check"), unsaved === null ? "Save" : count === 0 ? "Saved" : `Save ${count}`);
  }

  async #keep(): Promise<void> {
    this.#save.disabled = true;
    setText(this.#says, "Comparing with the manifest\u2026");
    this.#says.dataset.kind = "none";
    try {
      await Promise.all([...rows.values()].map((row) => row.settled));
      const { difference: diff, hash } = await this.#saving(true);
      if (!(await confirmed(this.element, { diff, findings: [], errors: 0, count: 0 }))) {
        setText(this.#says, "Not saved.");
        return void this.#look();
      }
      setText(this.#says, "Saving\u2026");
      const { saved, places } = await this.#saving(false, hash);
      setText(this.#says, saved.map(({ component, name }, at) => `${component} ${name}: ${places[at] ?? "saved"}`).join(", "));
      this.#says.dataset.kind = "good";
    } catch (error) {
      setText(this.#says, (error as Error).message);
      this.#says.dataset.kind = "bad";
    }
    void this.#look();
  }
}

/** A parameter with its control. */
class Row {
  readonly element: HTMLElement;
  readonly setting: Setting;
  /** The newest, which may be on its way. */
  value: Value;
  readonly #control: Control;
  readonly #note = h("p", { class: "says", role: "status" });
  readonly #mark = h("span", { class: "parameter-mark" });
  readonly #default = h("button", { type: "button", hidden: "" }, "As in the manifest");
  #sender: Sender | null = null;
  #arrived: Value; // at the robot

  constructor(setting: Setting, value: Value, whyNot: string, changed: (before: Value, after: Value) => void) {
    this.setting = setting;
    this.value = this.#arrived = value;
    this.#control = controlOf(setting, value, (next) => {
      this.#say("why" in next ? next.why : "", "bad");
      if ("value" in next && next.value !== this.value) changed(this.#arrived, next.value);
      else this.#control.show(this.value);
    });
    disable(whyNot, ...this.#control.element.querySelectorAll<HTMLInputElement | HTMLSelectElement>("input, select"));
    const label = h("label", { for: this.#control.id }, formatName(setting.name.replaceAll(".", " ")));
    const title = h("div", {}, label, this.#mark);
    const about = h("p", { class: "label" }, setting.about, h("small", {}, ` ${limitsOf(setting)}`));
    this.element = h("div", { class: "parameter", "data-words": `${this.key} ${setting.about}` }, title, this.#control.element, about, this.#default, this.#note);
    this.#default.onclick = () => {
      if (this.#inManifest !== null) changed(this.#arrived, this.#inManifest);
    };
  }

  #inManifest: Value | null = null;

  get key(): string {
    return `${this.setting.node}:${this.setting.name}`;
  }

  get settled(): Promise<void> {
    return this.#sender?.settled ?? Promise.resolve();
  }

  get isSending(): boolean {
    return this.#sender?.isBusy ?? false;
  }

  send(value: Value, tell: (value: Value) => Promise<void>): void {
    this.#sender ??= new Sender(async (next) => {
      try {
        await tell(next);
        this.#arrived = next;
        this.#say("", "");
      } catch (error) {
        if (next === this.value) this.#show(this.#arrived);
        this.#say((error as Error).message, "bad");
      }
    }, PAUSE);
    this.#show(value);
    this.#sender.put(value);
  }

  /** Shows a value that the robot has now, unless a newer one of this page is on its way. */
  arrived(value: Value): void {
    if (this.isSending) return;
    this.#arrived = value;
    this.#show(value);
    this.#say("", "");
  }

  #show(value: Value): void {
    this.value = value;
    this.#control.show(value);
  }

  /** Marks it as being as in the manifest or not, which then has `old`. */
  mark(old: Json | undefined, isKnown: boolean): void {
    this.#inManifest = isValue(old) ? old : null;
    const differs = this.#inManifest !== null;
    const written = isValue(old) ? `${String(shownOf(this.setting, old))} ${this.setting.unit}`.trim() : "";
    const words = differs ? `changed since the start, not saved; the manifest has ${written}` : "as in the manifest";
    setText(this.#mark, isKnown ? ` ${words}` : "");
    this.#mark.classList.toggle("differs", differs);
    this.#default.hidden = !differs;
    this.element.classList.toggle("changed", differs);
  }

  #say(text: string, kind: string): void {
    this.#note.dataset.kind = kind;
    setText(this.#note, text);
  }
}

interface Control {
  id: string;
  element: HTMLElement;
  show(value: Value): void;
}

function controlOf(setting: Setting, value: Value, changed: (next: { value: Value } | { why: string }) => void): Control {
  const id = `parameter${setting.node}-${setting.name}`.replaceAll(/[^\w-]/g, "-");
  if (typeof value === "boolean") {
    const box = h("input", { id, type: "checkbox" });
    box.onchange = () => changed({ value: box.checked });
    const show = (next: Value) => (box.checked = next === true);
    show(value);
    return { id, element: h("div", { class: "parameter-control" }, box), show };
  }
  if (setting.choices.length > 0) {
    const list = h("select", { id }, ...setting.choices.map((choice) => h("option", { value: choice }, formatName(choice))));
    list.onchange = () => changed({ value: list.value });
    const show = (next: Value) => (list.value = String(next));
    show(value);
    return { id, element: h("div", { class: "parameter-control" }, list), show };
  }
  const input = h("input", { id, type: "text", autocomplete: "off", inputmode: typeof value === "number" ? "decimal" : "text" });
  let present: Value = value;
  let isTyped = false; // and not yet taken: it is not replaced
  input.oninput = () => (isTyped = true);
  input.onchange = () => {
    isTyped = false;
    changed(parsed(setting, input.value, present));
  };
  input.onblur = () => {
    if (!isTyped) return; // else what was typed is what stood there before, which is no change
    isTyped = false;
    show(present);
  };
  const parts: Node[] = [h("span", { class: "number" }, input, h("span", { class: "unit" }, setting.unit))];
  const slide = slideOf(setting, value);
  let slider: HTMLInputElement | null = null;
  if (slide) {
    const ends = { min: String(slide.least), max: String(slide.most), step: String(slide.step) };
    slider = h("input", { type: "range", "aria-label": `${formatName(setting.name)}, slider`, ...ends });
    const moved = slider;
    slider.oninput = () => {
      isTyped = false;
      changed({ value: Number(moved.value) * setting.scale });
    };
    parts.unshift(slider);
  }
  const show = (next: Value) => {
    present = next;
    const shown = Number(shownOf(setting, next));
    if (!isTyped) input.value = textOf(setting, next);
    if (!slider || !slide) return;
    slider.value = String(shown);
    slider.style.setProperty("--share", String((shown - slide.least) / (slide.most - slide.least)));
  };
  show(value);
  return { id, element: h("div", { class: "parameter-control" }, ...parts), show };
}
