/** The data of a mission as a table; who may operate the robot sets them while it runs. */
import type { Datum } from "./debugging";
import { h, setText } from "./dom";

/** What the table asks the robot for; both fail with the reason if they are refused. */
export interface DataAccess {
  list(): Promise<Datum[]>;
  set(name: string, text: string): Promise<void>;
}

interface Row {
  element: HTMLTableRowElement;
  value: HTMLElement;
  set: HTMLButtonElement;
}

export class MissionData {
  readonly element = h("div", { class: "mission-data" });
  readonly #access: DataAccess;
  readonly #table = h("table", {});
  readonly #empty = h("p", { class: "label" });
  #rows = new Map<string, Row>();

  constructor(access: DataAccess) {
    this.#access = access;
    this.element.append(this.#table, this.#empty);
    this.forget("Nothing yet");
  }

  /** Shows no data, and says why. */
  forget(why: string): void {
    this.#rows.clear();
    this.#table.replaceChildren();
    this.#table.hidden = true;
    setText(this.#empty, why);
    this.#empty.hidden = false;
  }

  /** Shows data; what is being typed stays. */
  show(data: Record<string, string>, maySet: boolean): void {
    const names = Object.keys(data);
    if (names.length === 0) {
      this.forget("This mission keeps no data.");
      return;
    }
    if (names.join(" ") !== [...this.#rows.keys()].join(" ")) {
      this.#rows = new Map(names.map((name) => [name, this.#row(name)]));
      this.#table.replaceChildren(...[...this.#rows.values()].map(({ element }) => element));
      this.#table.hidden = false;
      this.#empty.hidden = true;
    }
    for (const [name, { value, set }] of this.#rows) {
      setText(value, data[name] || "(empty)");
      set.hidden = !maySet;
    }
  }

  #row(name: string): Row {
    const value = h("span", {});
    const set = h("button", { type: "button", "aria-label": `Set ${name}` }, "Set");
    const cell = h("td", {}, h("div", { class: "datum" }, value, set));
    set.onclick = () => void this.#open(name, cell, set);
    return { element: h("tr", {}, h("th", { scope: "row" }, name), cell), value, set };
  }

  async #open(name: string, cell: HTMLElement, set: HTMLButtonElement): Promise<void> {
    if (cell.querySelector("form")) return;
    const problem = h("p", { role: "alert", class: "problem" });
    const form = h("form", { class: "datum-form", "aria-label": `New value of ${name}` }, problem);
    cell.append(form);
    const close = () => {
      form.remove();
      set.focus();
    };
    form.onkeydown = (event) => {
      if (event.key === "Escape") close();
    };
    const cancel = h("button", { type: "button" }, "Cancel");
    cancel.onclick = close;
    const datum = await this.#access.list().then(
      (listed) => listed.find((one) => one.name === name) ?? "the mission has no such data",
      (error: Error) => error.message,
    );
    if (typeof datum === "string" || datum.text === null) {
      setText(problem, typeof datum === "string" ? datum : "What it holds cannot be written here.");
      form.append(cancel);
      cancel.focus();
      return;
    }
    const field = datum.choices.length > 0 ? h("select", {}) : h("input", { autocomplete: "off" });
    field.append(...datum.choices.map((choice) => h("option", { value: choice }, choice)));
    field.value = datum.text;
    field.setAttribute("aria-label", `${name}: ${datum.about}`);
    const save = h("button", {}, "Set");
    form.prepend(h("span", { class: "label" }, datum.about), field, h("span", { class: "row" }, save, cancel));
    field.focus();
    form.onsubmit = async (event) => {
      event.preventDefault();
      save.disabled = true;
      try {
        await this.#access.set(name, field.value);
        close();
      } catch (error) {
        setText(problem, (error as Error).message);
        field.focus();
      } finally {
        save.disabled = false;
      }
    };
  }
}
