/** A mission in plain sentences, as `rbxcompose mission show` says it; a sentence chooses its block. */
import { h } from "./dom";
import { isSame, type Block, type Path } from "./edited";

/** What a block says; `path` is null for what another mission says, `place` is where it stands: 1.2 is in 1. */
export interface Sentence {
  place: string;
  text: string;
  path: Path | null;
}

export class ReadView {
  readonly element = h("div", { class: "read-aloud" });
  readonly #choose: (path: Path) => void;
  #rows: { path: Path | null; row: HTMLElement }[] = [];
  #shown = "";

  constructor(choose: (path: Path) => void) {
    this.#choose = choose;
  }

  show(sentences: readonly Sentence[], chosen: Block | null): void {
    const key = JSON.stringify(sentences);
    if (key !== this.#shown) {
      this.#shown = key;
      this.#rows = sentences.map((sentence) => ({ path: sentence.path, row: this.#row(sentence) }));
      const list = h("ol", { "aria-label": "The mission in sentences" }, ...this.#rows.map(({ row }) => h("li", {}, row)));
      this.element.replaceChildren(list);
    }
    this.mark(chosen);
  }

  /** Tells why there are no sentences. */
  tell(why: string): void {
    this.#shown = "";
    this.#rows = [];
    this.element.replaceChildren(h("p", { class: "label", role: "status" }, why));
  }

  /** Marks what the chosen block says. */
  mark(chosen: Block | null): void {
    for (const { path, row } of this.#rows) {
      const isChosen = chosen !== null && path !== null && isSame(path, chosen.path);
      if (row.getAttribute("aria-current") === String(isChosen)) continue;
      row.setAttribute("aria-current", String(isChosen));
      if (isChosen) reveal(this.element, row);
    }
  }

  #row({ place, text, path }: Sentence): HTMLElement {
    const words = [h("span", { class: "label" }, place), h("span", {}, text)];
    const row = path ? h("button", { type: "button", class: "sentence" }, ...words) : h("p", { class: "sentence" }, ...words);
    row.style.setProperty("--level", String(place.split(".").length - 1));
    if (path) row.onclick = () => this.#choose(path);
    return row;
  }
}

/** Scrolls a box so that a row in it is seen, and nothing around it. */
function reveal(box: HTMLElement, row: HTMLElement): void {
  const [seen, own] = [box.getBoundingClientRect(), row.getBoundingClientRect()];
  if (own.top < seen.top) box.scrollTop -= seen.top - own.top;
  else if (own.bottom > seen.bottom) box.scrollTop += own.bottom - seen.bottom;
}
