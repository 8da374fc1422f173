/** What can be added to a mission, with a search; and the form of the chosen step, as the robot's grammar declares it. */
import { h, setText } from "./dom";
import type { OfferedPart } from "./edited";
import { formatName } from "./format";

/** A skill of the robot or a kind of step: a line of help, and a step of it in YAML. */
export interface Offered {
  word: string;
  sort: "skill" | "kind";
  about: string;
  yaml: string;
}

/**
 * One value of a step, or of the map `within` it. It is edited in a `line`, in `lines` of YAML, as a `text` of several
 * lines, or only in the text of the mission. `only` means that it is one of the choices.
 */
export interface FormField {
  key: string;
  within: string[];
  about: string;
  value: string;
  shape: Shape;
  is_word: boolean;
  choices: string[];
  only: boolean;
  units: string[];
  default: string;
}

export type Shape = "line" | "lines" | "text" | "fixed";

export interface Form {
  kind: string;
  /** Of a state, an interrupt, a case or a branch; else empty. */
  name: string;
  about: string;
  fields: FormField[];
}

/** Returns what fits a search: all of its words are somewhere in it, those at the beginning of its name first. */
export function matching(offered: readonly Offered[], search: string): Offered[] {
  const words = search.trim().toLowerCase().split(/\s+/).filter(Boolean);
  const found = offered.filter(({ word, about }) => words.every((one) => `${word} ${about}`.toLowerCase().includes(one)));
  const first = (one: Offered) => (words.length > 0 && one.word.startsWith(words[0]!) ? 0 : 1);
  return found.sort((one, other) => first(one) - first(other));
}

const NAME_ID = "option-own-name";

/** Returns a help as plain text. */
function said(about: string): string {
  return about.replaceAll("`", "'");
}

function article(part: string): string {
  if (part === "else" || part === "then" || part === "do") return `'${part}'`;
  return `${/^[aeiou]/.test(part) ? "an" : "a"} ${part}`;
}

function blockName({ to }: OfferedPart): string {
  return to ? to.name || `${to.kind} ${to.text}`.trim() : "the mission";
}

export class Palette {
  readonly element = h("details", { class: "palette" });
  readonly #list = h("ul", { "aria-label": "Steps to add" });
  readonly #parts = h("div", { class: "parts", role: "group", "aria-label": "Parts to add" });
  readonly #search = h("input", { type: "search", id: "palette-search", placeholder: "Search", autocomplete: "off" });
  readonly #add: (offered: Offered) => void;
  readonly #addPart: (part: OfferedPart) => void;
  #offered: Offered[] = [];
  #mayAdd = false;
  #offeredParts: readonly OfferedPart[] = [];
  #shownParts = "";

  constructor(add: (offered: Offered) => void, addPart: (part: OfferedPart) => void) {
    [this.#add, this.#addPart] = [add, addPart];
    const label = h("label", { for: "palette-search", class: "label" }, "It is added behind the chosen step.");
    this.element.append(h("summary", {}, "Add a step"), this.#parts, label, this.#search, this.#list);
    this.#search.oninput = () => this.#draw();
    this.#search.onkeydown = (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      const first = matching(this.#offered, this.#search.value)[0];
      if (first && this.#mayAdd) this.#add(first);
    };
  }

  /** Offers what the chosen block and those around it can have besides steps. */
  showParts(parts: readonly OfferedPart[]): void {
    this.#offeredParts = parts;
    const key = JSON.stringify([this.#mayAdd, ...parts.map((one) => [one.part, one.path, one.index, blockName(one)])]);
    if (key === this.#shownParts) return; // a button that is drawn anew while it is pressed does nothing
    this.#shownParts = key;
    this.#parts.replaceChildren(
      ...parts.map((one) => {
        const words = h("span", {}, `Add ${article(one.part)}`, h("span", { class: "label" }, ` to ${blockName(one)}`));
        const button = h("button", { type: "button", class: "offered" }, words);
        button.disabled = !this.#mayAdd;
        button.onclick = () => this.#addPart(one);
        return button;
      }),
    );
  }

  show(offered: Offered[], mayAdd: boolean): void {
    [this.#offered, this.#mayAdd] = [offered, mayAdd];
    this.showParts(this.#offeredParts);
    this.#draw();
  }

  #draw(): void {
    this.#list.replaceChildren(
      ...matching(this.#offered, this.#search.value).map((one) => {
        const words = h("span", { class: "offered-words" }, h("strong", {}, one.word), h("span", { class: "label" }, ` ${said(one.about)}`));
        const button = h("button", { type: "button", class: "offered" }, words);
        button.disabled = !this.#mayAdd;
        button.onclick = () => this.#add(one);
        return h("li", {}, button);
      }),
    );
  }
}

export class StepForm {
  readonly element = h("details", { class: "step-form", open: "" });
  readonly #title = h("summary", {}, "Options");
  readonly #about = h("p", { class: "label" });
  readonly #fields = h("div", { class: "form-fields" });
  readonly #set: (field: FormField, value: string) => void;
  readonly #rename: (name: string) => void;
  #shown = "";

  /** `set` changes a value in the text, and an empty one takes it away; `rename` gives the block another name. */
  constructor(set: (field: FormField, value: string) => void, rename: (name: string) => void) {
    [this.#set, this.#rename] = [set, rename];
    this.element.append(this.#title, this.#about, this.#fields);
    this.hide("Choose a step to see its options.");
  }

  hide(why: string): void {
    this.#shown = "";
    setText(this.#title, "Options");
    setText(this.#about, why);
    this.#fields.replaceChildren();
  }

  show(form: Form, mayChange: boolean): void {
    const key = JSON.stringify([form, mayChange]);
    if (key === this.#shown) return;
    const focused = document.activeElement;
    this.#shown = key;
    setText(this.#title, `Options of ${form.name && form.fields[0]?.is_word !== true ? `${form.kind} ${form.name}` : form.kind}`);
    setText(this.#about, said(form.about));
    const name = form.name ? [this.#nameRow(form, mayChange)] : [];
    this.#fields.replaceChildren(...name, ...form.fields.map((field) => this.#row(field, mayChange)));
    const again = focused?.id.startsWith("option-") ? document.getElementById(focused.id) : null;
    if (isTyped(focused) && again?.tagName === focused.tagName) (again as typeof focused).value = focused.value;
    again?.focus();
  }

  #nameRow({ name, fields }: Form, mayChange: boolean): HTMLElement {
    const about = ` ${fields.some(({ key }) => key === "next") ? "What leads to it follows." : "Its key in the text."}`;
    const label = h("label", { for: NAME_ID }, "Name", h("span", { class: "label" }, about));
    const input = h("input", { id: NAME_ID, type: "text", autocomplete: "off", value: name });
    this.#writes(input, name, mayChange, (value) => value && this.#rename(value));
    return h("div", { class: "field" }, label, input);
  }

  #row(field: FormField, mayChange: boolean): HTMLElement {
    const id = `option-${[...field.within, field.key].join("-")}`;
    const label = h("label", { for: id }, formatName(field.key), h("span", { class: "label" }, ` ${said(field.about)}`));
    const unit = field.units.length > 0 ? [h("span", { class: "unit" }, `with a unit: ${field.units.slice(0, 4).join(", ")}`)] : [];
    if (field.shape === "fixed") {
      const why = "It is shared with other steps by a mark such as '&low': change it in the text.";
      return h("div", { class: "field" }, h("span", {}, formatName(field.key)), h("span", { class: "label" }, why));
    }
    const [control, ...more] = controlOf(field, id);
    this.#writes(control, field.value, mayChange, (value) => this.#set(field, value));
    return h("div", { class: field.shape === "line" ? "field" : "field wide" }, label, control, ...more, ...unit);
  }

  /** Has a control write what it holds, once for each change. */
  #writes(control: Control, written: string, mayChange: boolean, set: (value: string) => void): void {
    control.disabled = !mayChange;
    const write = (): void => {
      const value = control instanceof HTMLTextAreaElement ? control.value : control.value.trim();
      if (!control.isConnected || value === written) return; // else what is drawn anew would be written twice
      written = value;
      set(value);
    };
    control.onchange = write;
    control.onblur = write; // a text that was carried over does not count as a change
    control.onkeydown = (event) => {
      const { key, ctrlKey } = event as KeyboardEvent;
      if (key === "Enter" && (ctrlKey || !(control instanceof HTMLTextAreaElement))) write();
    };
  }
}

type Control = HTMLInputElement | HTMLSelectElement | HTMLTextAreaElement;

function isTyped(element: Element | null): element is HTMLInputElement | HTMLTextAreaElement {
  const isText = element instanceof HTMLInputElement || element instanceof HTMLTextAreaElement;
  return isText && element.value !== element.defaultValue;
}

/** Returns what edits a value, and what belongs to it. */
function controlOf(field: FormField, id: string): [Control, ...Node[]] {
  if (field.shape !== "line") {
    const rows = Math.min(Math.max(field.value.split("\n").length, 2), 10);
    const area = h("textarea", { id, rows: String(rows), spellcheck: String(field.shape === "text"), autocomplete: "off" });
    area.defaultValue = area.value = field.value;
    const hint = field.shape === "lines" ? "As in the text, such as 'a: 1' in lines, or [a, b]. " : "";
    return [area, h("span", { class: "unit" }, `${hint}Ctrl+Enter, or leaving it, writes it.`)];
  }
  if (field.only) {
    const select = h("select", { id }, h("option", { value: "" }, field.default ? `${field.default} (usual)` : "not set"));
    select.append(...field.choices.map((choice) => h("option", { value: choice }, choice)));
    select.value = field.value;
    return [select];
  }
  const input = h("input", { id, type: "text", autocomplete: "off", list: `${id}-choices`, placeholder: field.default });
  input.defaultValue = input.value = field.value;
  return [input, h("datalist", { id: `${id}-choices` }, ...field.choices.map((choice) => h("option", { value: choice })))];
}
