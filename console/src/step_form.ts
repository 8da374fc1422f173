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

/** One value of a step. `only` means that it is one of the choices; `is_fixed` that it has several lines. */
export interface FormField {
  key: string;
  about: string;
  value: string;
  is_fixed: boolean;
  is_word: boolean;
  choices: string[];
  only: boolean;
  units: string[];
  default: string;
}

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
  readonly #set: (key: string, value: string) => void;
  readonly #rename: (name: string) => void;
  #shown = "";

  /** `set` changes a value in the text, and an empty one takes it away; `rename` gives the block another name. */
  constructor(set: (key: string, value: string) => void, rename: (name: string) => void) {
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
    const isTyped = focused instanceof HTMLInputElement && focused.value !== focused.defaultValue;
    if (isTyped && again instanceof HTMLInputElement) again.value = focused.value;
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
    const id = `option-${field.key}`;
    const label = h("label", { for: id }, formatName(field.key), h("span", { class: "label" }, ` ${said(field.about)}`));
    const unit = field.units.length > 0 ? [h("span", { class: "unit" }, `with a unit: ${field.units.slice(0, 4).join(", ")}`)] : [];
    if (field.is_fixed) {
      return h("div", { class: "field" }, h("span", {}, formatName(field.key)), h("span", { class: "label" }, "Several lines: change it in the text."));
    }
    let control: HTMLInputElement | HTMLSelectElement;
    const more: Node[] = [];
    if (field.only) {
      control = h("select", { id }, h("option", { value: "" }, field.default ? `${field.default} (usual)` : "not set"));
      control.append(...field.choices.map((choice) => h("option", { value: choice }, choice)));
    } else {
      control = h("input", { id, type: "text", autocomplete: "off", list: `${id}-choices`, placeholder: field.default });
      more.push(h("datalist", { id: `${id}-choices` }, ...field.choices.map((choice) => h("option", { value: choice }))));
    }
    if (control instanceof HTMLInputElement) control.defaultValue = field.value;
    control.value = field.value;
    this.#writes(control, field.value, mayChange, (value) => this.#set(field.key, value));
    return h("div", { class: "field" }, label, control, ...more, ...unit);
  }
  /** Has a control write what it holds, once for each change. */
  #writes(control: HTMLInputElement | HTMLSelectElement, written: string, mayChange: boolean, set: (value: string) => void): void {
    control.disabled = !mayChange;
    const write = (): void => {
      const value = control.value.trim();
      if (!control.isConnected || value === written) return; // else what is drawn anew would be written twice
      written = value;
      set(value);
    };
    control.onchange = write;
    control.onblur = write; // a text that was carried over does not count as a change
    control.onkeydown = (event) => {
      if ((event as KeyboardEvent).key === "Enter") write();
    };
  }
}
