/** The editor of places beside the map: a list, a form with exact numbers, and what drags and keys on the map mean. */
import { barButton, EditsBar, TextField, withUnit } from "./edits_bar";
import { h, setText } from "./dom";
import type { MapGesture, ShownPlace } from "./elements/map_canvas";
import { formatName } from "./format";
import type { Pose } from "./map";
import type { Robot } from "./page";
import { editsOf, type Entry, type RobotChange, type RobotEdits } from "./robot_edits";
import type { Message } from "./rosbridge";

export interface EditedPlace extends Entry, Pose {
  colour: string;
  /** The numbers as the file has them, with units. */
  written: { x: string; y: string; heading: string };
}

const UNITS = { x: "m", y: "m", heading: "deg" } as const;
type Field = keyof typeof UNITS;
const STEP = 0.05; // [m] by an arrow key
const FINE = 0.01; // [m] with Shift
const TURN = 5; // [°] by Page Up and Page Down
const SECTION = "places";
const RADIANS = Math.PI / 180;

/** Returns numbers as a hand means them: centimetres and degrees. */
export function rounded({ x, y, heading }: Pose): Pose {
  const [right, up] = [x, y].map((number) => Math.round(number * 100) / 100 || 0);
  return { x: right!, y: up!, heading: (Math.round(heading / RADIANS) || 0) * RADIANS };
}

/** Returns a name that no place has. */
export function freshName(names: readonly string[], stem = "place"): string {
  for (let number = 1; ; number += 1) if (!names.includes(`${stem}_${number}`)) return `${stem}_${number}`;
}

/** Returns which values a pose changes. */
export function differing(place: Pose, pose: Pose): Message {
  const apart = (Object.keys(UNITS) as Field[]).filter((key) => Math.abs(place[key] - pose[key]) > 1e-9);
  return Object.fromEntries(apart.map((key) => [key, pose[key]]));
}

export class PlacesEditor {
  readonly element = h("section", { class: "card places-editor", "aria-label": "Edit places" });
  /** The place that is chosen; empty if none is. */
  chosen = "";
  readonly #edits: RobotEdits<EditedPlace>;
  readonly #bar: EditsBar<EditedPlace>;
  readonly #changed: () => void;
  readonly #list = h("div", { class: "places-list", role: "group", "aria-label": "Places of the robot" });
  readonly #add: HTMLButtonElement;
  readonly #form = h("form", { class: "map-numbers", "aria-label": "The chosen place" });
  readonly #where = h("p", { class: "label" });
  readonly #name = new TextField("Name", (text) => void this.#rename(text));
  readonly #fields: Record<Field, TextField>;
  readonly #delete = barButton("cross", "Delete this place", () => void this.#remove());
  readonly #closers: (() => void)[] = [];
  /** Poses that the robot has not confirmed yet, by name. */
  readonly #held = new Map<string, Partial<Pose>>();

  constructor(robot: Robot, changed: () => void, done: () => void, standing: () => Pose | null) {
    this.#changed = changed;
    this.#edits = editsOf<EditedPlace>(robot.link, SECTION);
    this.#bar = new EditsBar(robot, this.#edits, done);
    const field = (key: Field, words: string) => new TextField(words, (text) => void this.#type(key, text));
    this.#fields = { x: field("x", "x"), y: field("y", "y"), heading: field("heading", "Heading") };
    this.#add = barButton("edit", "Add where the robot is", () => {
      if (!standing()) robot.notify("Where the robot is, is not known: the place is added at the origin of the map.");
      void this.#addAt(standing() ?? { x: 0, y: 0, heading: 0 });
    });
    const fields = Object.values(this.#fields).map(({ element }) => element);
    this.#name.element.classList.add("places-name");
    this.#form.append(this.#name.element, ...fields, this.#where, this.#delete);
    this.#form.onsubmit = (event) => event.preventDefault();
    this.element.append(h("h2", {}, "Edit places"), this.#bar.element, this.#list, this.#add, this.#form);
    this.#closers.push(
      this.#edits.robot.watch(() => {
        this.#held.clear();
        this.#show();
      }),
    );
  }

  close(): void {
    this.#bar.close();
    for (const close of this.#closers) close();
  }

  get places(): readonly EditedPlace[] {
    const entries = this.#edits.robot.value?.entries ?? [];
    return entries.map((place) => ({ ...place, ...this.#held.get(place.name) }));
  }

  /** Returns the places as the map shows them. */
  shown(): ShownPlace[] {
    return this.places.map((place) => ({
      ...place,
      label: formatName(place.name),
      isDock: false,
      isChosen: place.name === this.chosen,
    }));
  }

  /** Does what a drag on the map means. */
  take({ is, name, pose }: MapGesture): void {
    const at = rounded(pose);
    if (is === "add") return void this.#addAt(at);
    if (is !== "choose") void this.#place(name, is === "turn" ? { heading: at.heading } : { x: at.x, y: at.y });
    this.choose(name);
  }

  /** Does what a key on the map means; returns whether it means something. */
  press({ key, shiftKey }: KeyboardEvent): boolean {
    const place = this.#current();
    if (!place) return false;
    const far = shiftKey ? FINE : STEP;
    const ways: Record<string, Partial<Pose>> = {
      ArrowLeft: { x: place.x - far },
      ArrowRight: { x: place.x + far },
      ArrowUp: { y: place.y + far },
      ArrowDown: { y: place.y - far },
      PageUp: { heading: place.heading + TURN * RADIANS },
      PageDown: { heading: place.heading - TURN * RADIANS },
    };
    if (key === "Delete") void this.#remove();
    else if (ways[key]) {
      const pose = rounded({ ...place, ...ways[key] });
      this.#held.set(place.name, pose); // the next key comes before the answer
      this.#changed();
      void this.#edits.change(this.#setting(place.name, keysOf(pose, ways[key])), true);
    } else return false;
    return true;
  }

  choose(name: string): void {
    this.chosen = name;
    this.#show();
  }

  #current(): EditedPlace | undefined {
    return this.places.find(({ name }) => name === this.chosen);
  }

  #setting(name: string, values: Message): RobotChange {
    return { op: "set", path: [SECTION, name], values };
  }

  async #place(name: string, pose: Partial<Pose>): Promise<void> {
    const place = this.places.find((one) => one.name === name);
    if (!place) return;
    const values = differing(place, { ...place, ...pose });
    if (Object.keys(values).length === 0) return this.#changed();
    this.#held.set(name, pose); // it stays where it was put until the answer comes
    await this.#edits.change(this.#setting(name, values));
  }

  async #addAt(pose: Pose): Promise<void> {
    const { x, y, heading } = rounded(pose);
    const name = freshName(this.places.map((place) => place.name));
    const values = { x, y, ...(heading === 0 ? {} : { heading }) };
    if (!(await this.#edits.change({ op: "add", path: [SECTION, name], values }))) return;
    this.choose(name);
    this.#name.input.focus();
    this.#name.input.select();
  }

  async #rename(text: string): Promise<void> {
    const before = this.chosen;
    this.chosen = text;
    const isDone = await this.#edits.change({ op: "rename", path: [SECTION, before], name: text });
    if (isDone) return;
    this.choose(before);
    this.#name.refuse(text);
  }

  async #type(key: Field, text: string): Promise<void> {
    const value = withUnit(text, UNITS[key]);
    if (!(await this.#edits.change(this.#setting(this.chosen, { [key]: value })))) this.#fields[key].refuse(text);
  }

  async #remove(): Promise<void> {
    const place = this.#current();
    if (!place || !this.#bar.canSave) return;
    if (await this.#edits.change({ op: "remove", path: [SECTION, place.name] })) this.#list.querySelector("button")?.focus();
  }

  #show(): void {
    const robot = this.#edits.robot.value;
    const mayAdd = this.#bar.canSave && robot !== null && robot.why_not === "";
    this.#add.disabled = !mayAdd;
    const shown = this.places.map(({ name }) => name);
    const buttons = [...this.#list.querySelectorAll("button")];
    if (buttons.map(({ value }) => value).join() !== shown.join()) {
      this.#list.replaceChildren(
        ...shown.map((name) => {
          const button = h("button", { type: "button", value: name }, formatName(name));
          button.onclick = () => this.choose(name);
          return button;
        }),
      );
    }
    for (const button of this.#list.querySelectorAll("button")) {
      button.setAttribute("aria-pressed", String(button.value === this.chosen));
    }
    const place = this.#current();
    this.#form.hidden = !place;
    if (place) {
      const isEnabled = this.#bar.canSave && place.why_not === "";
      this.#name.show(place.name, isEnabled);
      for (const [key, field] of Object.entries(this.#fields)) field.show(place.written[key as Field], isEnabled);
      this.#delete.disabled = !isEnabled;
      const where = place.file ? `It is written in ${place.file}.` : "";
      setText(this.#where, place.why_not ? `It cannot be changed here: ${place.why_not}.` : where);
    }
    this.#changed();
  }
}

function keysOf(pose: Pose, keys: Partial<Pose>): Message {
  return Object.fromEntries((Object.keys(keys) as Field[]).map((key) => [key, pose[key]]));
}
