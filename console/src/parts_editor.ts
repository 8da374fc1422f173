/** The editor of parts beside the model: added from a palette, attached to links, seen as a ghost before they are saved. */
import { barButton, EditsBar, TextField, withUnit } from "./edits_bar";
import { h, setText } from "./dom";
import type { Pose, RobotScene } from "./elements/robot_scene";
import { formatName } from "./format";
import type { Robot } from "./page";
import { askRobotEditor, editsOf, type EditedRobot, type Entry, type RobotEdits } from "./robot_edits";
import type { Message } from "./rosbridge";

type PoseKey = keyof Pose;
const UNITS: Record<PoseKey, string> = { x: "m", y: "m", z: "m", roll: "deg", pitch: "deg", yaw: "deg" };
const KEYS = Object.keys(UNITS) as PoseKey[];
const STEPS: Record<PoseKey, number> = { x: 1e-3, y: 1e-3, z: 1e-3, roll: Math.PI / 180, pitch: Math.PI / 180, yaw: Math.PI / 180 };
const SECTION = "include";

/** An instance of a part. */
export interface EditedPart extends Entry {
  /** Its file. */
  part: string;
  /** The link that carries it; empty for the base, and for what has no body. */
  to: string;
  /** As it is written, with units. */
  pose: Record<PoseKey, string>;
  /** The same in SI. */
  numbers: Pose;
}

interface BuiltRobot extends EditedRobot<EditedPart> {
  links: string[];
  /** The URDF with the changes. */
  model: string;
  /** Links that the changes bring or move. */
  ghosts: string[];
  gone: string[];
}

export interface OfferedPart {
  name: string;
  about: string;
  file: string;
  has_body: boolean;
  /** Arguments that must be given. */
  needs: string[];
}

/** Returns the parts with all words of a search in their name or what is said of them. */
export function matchingParts(parts: readonly OfferedPart[], search: string): OfferedPart[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  return parts.filter(({ name, about }) => words.every((word) => `${name} ${formatName(name)} ${about}`.toLowerCase().includes(word)));
}

/** Returns a name that no part has: that of the part itself, else with a number. */
export function freePartName(taken: readonly string[], part: string): string {
  for (let number = 1; ; number += 1) {
    const name = number === 1 ? part : `${part}_${number}`;
    if (!taken.includes(name)) return name;
  }
}

/** Returns what a dragged handle changes of a pose: whole millimetres and degrees. */
export function draggedTo(before: Pose, after: Pose): Message {
  const changed = KEYS.filter((key) => Math.abs(after[key] - before[key]) > STEPS[key] / 2);
  return Object.fromEntries(changed.map((key) => [key, (Math.round(after[key] / STEPS[key]) || 0) * STEPS[key]]));
}

export class PartsEditor {
  readonly element = h("section", { class: "card parts-editor", "aria-label": "Edit parts" });
  readonly #scene: RobotScene;
  readonly #edits: RobotEdits<EditedPart>;
  readonly #bar: EditsBar<EditedPart>;
  readonly #list = h("div", { class: "row parts-list", role: "group", "aria-label": "Parts of the robot" });
  readonly #form = h("form", { class: "part-form", "aria-label": "The chosen part" });
  readonly #what = h("p", { class: "label" });
  readonly #to = linkList("Attached to", () => void this.#set({ to: this.#to.list.value }));
  readonly #fields: Record<PoseKey, TextField>;
  readonly #delete = barButton("cross", "Delete this part", () => void this.#remove());
  readonly #handles = h("div", { class: "row" });
  readonly #palette: PartPalette;
  readonly #showMissing: () => void;
  readonly #closers: (() => void)[] = [];
  #chosen = "";

  constructor(robot: Robot, scene: RobotScene, showMissing: () => void, done: () => void) {
    [this.#scene, this.#showMissing] = [scene, showMissing];
    this.#edits = editsOf<EditedPart>(robot.link, SECTION);
    this.#bar = new EditsBar(robot, this.#edits, done);
    this.#palette = new PartPalette(robot, (name, values) => this.#add(name, values));
    const field = (key: PoseKey) => new TextField(formatName(key), (text) => void this.#type(key, text));
    this.#fields = Object.fromEntries(KEYS.map((key) => [key, field(key)])) as Record<PoseKey, TextField>;
    for (const mode of ["translate", "rotate"] as const) {
      const button = h("button", { type: "button" }, mode === "translate" ? "Arrows move it" : "Rings turn it");
      button.onclick = () => scene.setHandleMode(mode);
      this.#handles.append(button);
    }
    const pose = h("div", { class: "part-pose" }, ...KEYS.map((key) => this.#fields[key].element));
    this.#form.append(this.#what, this.#to.element, pose, this.#handles, this.#delete);
    this.#form.onsubmit = (event) => event.preventDefault();
    const help = h("p", { class: "label" }, "What is new or elsewhere is seen as a ghost on the robot; what is deleted fades.");
    this.element.append(h("h2", {}, "Edit parts"), help, this.#bar.element, this.#list, this.#form, this.#palette.element);
    scene.onDrag = (after) => {
      const part = this.#current();
      const values = part ? draggedTo(part.numbers, after) : {};
      if (Object.keys(values).length > 0) void this.#set(values);
    };
    this.#closers.push(this.#edits.robot.watch(() => this.#show()));
  }

  close(): void {
    this.#bar.close();
    for (const close of this.#closers) close();
    this.#scene.onDrag = () => undefined;
    this.#scene.setHandle(null);
    this.#preview("", [], []);
  }

  get #built(): BuiltRobot | null {
    return this.#edits.robot.value as BuiltRobot | null;
  }

  #current(): EditedPart | undefined {
    return this.#built?.entries.find(({ name }) => name === this.#chosen);
  }

  #choose(name: string): void {
    this.#chosen = name;
    this.#show();
  }

  async #add(name: string, values: Message): Promise<boolean> {
    const isDone = await this.#edits.change({ op: "add", path: [SECTION, name], values });
    if (isDone) this.#choose(name);
    return isDone;
  }

  #set(values: Message): Promise<boolean> {
    return this.#edits.change({ op: "set", path: [SECTION, this.#chosen], values });
  }

  async #type(key: PoseKey, text: string): Promise<void> {
    if (!(await this.#set({ [key]: withUnit(text, UNITS[key]) }))) this.#fields[key].refuse(text);
  }

  async #remove(): Promise<void> {
    if (await this.#edits.change({ op: "remove", path: [SECTION, this.#chosen] })) this.#list.querySelector("button")?.focus();
  }

  #show(): void {
    const built = this.#built;
    const names = built?.entries.map(({ name }) => name) ?? [];
    const buttons = [...this.#list.querySelectorAll("button")];
    if (buttons.map(({ value }) => value).join() !== names.join()) {
      this.#list.replaceChildren(
        ...names.map((name) => {
          const button = h("button", { type: "button", value: name }, formatName(name));
          button.onclick = () => this.#choose(name);
          return button;
        }),
      );
    }
    for (const button of this.#list.querySelectorAll("button")) {
      button.setAttribute("aria-pressed", String(button.value === this.#chosen));
    }
    const part = this.#current();
    this.#form.hidden = !part;
    const mayEdit = this.#bar.canSave && part?.why_not === "";
    if (part && built) {
      const why = part.why_not ? ` It cannot be changed here: ${part.why_not}.` : "";
      setText(this.#what, `${part.part}, written in ${part.file}.${why}`);
      const own = new Set(built.links.filter((link) => link.startsWith(`${part.name}_`)));
      this.#to.show(built.links.filter((link) => !own.has(link)), part.to, mayEdit);
      for (const key of KEYS) this.#fields[key].show(part.pose[key], mayEdit && part.to !== "");
      this.#delete.disabled = !mayEdit;
      this.#handles.hidden = part.to === "";
    }
    if (!built) return;
    this.#palette.learn(built.links, names, this.#bar.canSave && built.why_not === "");
    const known = new Set(this.#scene.frames);
    this.#preview(built.model, [...built.ghosts, ...built.links.filter((link) => !known.has(link))], built.gone);
    this.#scene.setHandle(part && mayEdit && part.to ? part.numbers : null, part?.to);
  }

  #preview(urdf: string, ghosts: readonly string[], gone: readonly string[]): void {
    const shown = [...new Set(ghosts)].sort();
    this.#scene.preview(urdf, new Set(shown), gone, this.#showMissing);
    this.#scene.element.dataset.draft = JSON.stringify(shown);
    this.#scene.element.dataset.gone = JSON.stringify(gone);
  }
}

interface LinkList {
  element: HTMLElement;
  list: HTMLSelectElement;
  show(links: readonly string[], chosen: string, isEnabled: boolean): void;
}

/** A list of links to choose from. */
function linkList(words: string, chosen: () => void): LinkList {
  const list = h("select", {});
  const element = h("label", { class: "field" }, words, list);
  list.onchange = chosen;
  let shown = "";
  return {
    element,
    list,
    show(links, link, isEnabled) {
      const all = ["", ...links, ...(link && !links.includes(link) ? [link] : [])];
      if (all.join() !== shown) {
        shown = all.join();
        list.replaceChildren(...all.map((one) => h("option", { value: one }, one || "nothing: it has no body, or is the base")));
      }
      list.value = link;
      list.disabled = !isEnabled;
    },
  };
}

/** What can be added, with a search, and the form of the one that is chosen. */
class PartPalette {
  readonly element = h("details", { class: "part-palette" }, h("summary", {}, "Add a part"));
  readonly #robot: Robot;
  readonly #add: (name: string, values: Message) => Promise<boolean>;
  readonly #search = h("input", { type: "search", "aria-label": "Find a part", placeholder: "Find a part" });
  readonly #list = h("ul", { class: "part-offers" });
  readonly #form = h("form", { class: "part-form", "aria-label": "The new part" });
  readonly #says = h("p", { class: "says", role: "status" });
  #offered: OfferedPart[] = [];
  #links: readonly string[] = [];
  #taken: readonly string[] = [];
  #isEnabled = false;

  constructor(robot: Robot, add: (name: string, values: Message) => Promise<boolean>) {
    [this.#robot, this.#add] = [robot, add];
    this.element.append(this.#search, this.#says, this.#list, this.#form);
    this.#search.oninput = () => this.#find();
    this.#form.hidden = true;
    this.element.ontoggle = () => {
      if (this.element.open && this.#offered.length === 0) void this.#load();
    };
  }

  learn(links: readonly string[], taken: readonly string[], isEnabled: boolean): void {
    [this.#links, this.#taken, this.#isEnabled] = [links, taken, isEnabled];
  }

  async #load(): Promise<void> {
    setText(this.#says, "Asking for the parts\u2026");
    try {
      const offered = await askRobotEditor<OfferedPart[]>(this.#robot.link, "palette", {});
      this.#offered = offered.map((part) => ({ ...part, about: part.about.replaceAll("`", "") }));
      setText(this.#says, "");
      this.#find();
    } catch (error) {
      setText(this.#says, (error as Error).message);
    }
  }

  #find(): void {
    const found = matchingParts(this.#offered, this.#search.value);
    setText(this.#says, found.length === 0 ? "No part has these words." : "");
    this.#list.replaceChildren(
      ...found.map((part) => {
        const about = h("small", { class: "label" }, part.about);
        const button = h("button", { type: "button" }, h("strong", {}, formatName(part.name)), about);
        button.onclick = () => this.#choose(part);
        return h("li", {}, button);
      }),
    );
  }

  #choose(part: OfferedPart): void {
    const name = h("input", { autocomplete: "off", spellcheck: "false", value: freePartName(this.#taken, part.name) });
    const to = linkList("Attached to", () => undefined);
    const top = this.#links.filter((link) => link.endsWith("_top")).at(-1) ?? this.#links[0] ?? "";
    to.show(this.#links, part.has_body ? top : "", true);
    const needs = part.needs.map((need) => ({ need, input: h("input", { autocomplete: "off", required: "" }) }));
    const fields = needs.map(({ need, input }) => h("label", { class: "field" }, formatName(need), input));
    const show = h("button", {}, "Show it on the robot");
    show.disabled = !this.#isEnabled;
    this.#form.replaceChildren(
      h("h3", {}, `New part: ${formatName(part.name)}`),
      h("p", { class: "label" }, part.about),
      h("label", { class: "field" }, "Name", name),
      ...fields,
      to.element,
      show,
    );
    this.#form.onsubmit = async (event) => {
      event.preventDefault();
      const given = Object.fromEntries(needs.map(({ need, input }) => [need, input.value.trim()]));
      const where: Message = to.list.value ? { to: to.list.value } : {};
      const values: Message = { part: part.file, ...where, ...(needs.length > 0 ? { with: given } : {}) };
      if (!(await this.#add(name.value.trim(), values))) return name.setAttribute("aria-invalid", "true");
      this.#form.hidden = true;
      this.element.open = false;
    };
    this.#form.hidden = false;
    name.focus();
    name.select();
  }
}
