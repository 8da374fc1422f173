/** The outline of a mission beside its text: blocks to choose, and to move by keys and buttons. */
import { h } from "./dom";
import { allBlocks, blockAt, isSame, type Block, type Outline, type Path } from "./edited";

/** What can be done with the chosen block: the words of its button, its keys, and the operation. */
const ACTIONS = [
  { words: "Up", keys: "Alt+ArrowUp", operation: { op: "move", way: "up" } },
  { words: "Down", keys: "Alt+ArrowDown", operation: { op: "move", way: "down" } },
  { words: "In", keys: "Alt+ArrowRight", operation: { op: "move", way: "in" } },
  { words: "Out", keys: "Alt+ArrowLeft", operation: { op: "move", way: "out" } },
  { words: "Copy", keys: "Insert", operation: { op: "duplicate" } },
  { words: "Delete", keys: "Delete", operation: { op: "delete" } },
] as const;

export type Operation = { op: string; path: Path; [key: string]: string | number | Path };

export class OutlineView {
  readonly element = h("section", { class: "outline", "aria-label": "Outline" });
  readonly #tree = h("ul", { role: "tree", "aria-label": "Blocks of the mission" });
  readonly #buttons: HTMLButtonElement[];
  readonly #act: (operation: Operation) => void;
  readonly #choose: (block: Block | null, isByHand: boolean) => void;
  readonly #enter: () => void;
  #outline: Outline = { blocks: [], slots: [] };
  #rows = new Map<Block, HTMLElement>();
  #order: Block[] = [];
  #chosen: Block | null = null;
  #mayChange = false;

  /** `act` changes the text, `choose` learns of each choice, and whether it was made here; `enter` goes to the text. */
  constructor(act: (operation: Operation) => void, choose: (block: Block | null, isByHand: boolean) => void, enter: () => void) {
    [this.#act, this.#choose, this.#enter] = [act, choose, enter];
    this.#buttons = ACTIONS.map(({ words, keys, operation }) => {
      const made = h("button", { type: "button", "aria-keyshortcuts": keys, title: keys.replace("Arrow", "") }, words);
      made.onclick = () => this.#do(operation);
      return made;
    });
    this.element.append(h("div", { class: "outline-bar", role: "group", "aria-label": "The chosen block" }, ...this.#buttons), this.#tree);
    this.#tree.onkeydown = (event) => this.#key(event);
    this.#enable();
  }

  get outline(): Outline {
    return this.#outline;
  }

  get chosen(): Block | null {
    return this.#chosen;
  }

  allow(mayChange: boolean): void {
    this.#mayChange = mayChange;
    this.#enable();
  }

  /** Shows another outline, and chooses the block at a path, else the one at the cursor. */
  show(outline: Outline, path: Path | null, cursor: number): void {
    const hadFocus = this.#tree.contains(document.activeElement);
    this.#outline = outline;
    this.#rows.clear();
    this.#order = allBlocks(outline.blocks);
    this.#tree.replaceChildren(...outline.blocks.map((block) => this.#row(block)));
    const wanted = path ? this.#order.find((block) => isSame(block.path, path)) : undefined;
    this.#mark(wanted ?? blockAt(outline.blocks, cursor), wanted !== undefined);
    if (hadFocus && this.#chosen) this.#rows.get(this.#chosen)!.focus();
  }

  /** Chooses the block at a place of the text. */
  follow(cursor: number): void {
    const block = blockAt(this.#outline.blocks, cursor);
    if (block !== this.#chosen) this.#mark(block, false);
  }

  /** Colours the blocks by how each ended, until another outline is shown. */
  colour(statuses: readonly { path: Path; status: string }[]): void {
    for (const old of this.#tree.querySelectorAll(".outline-status")) old.remove();
    for (const { path, status } of statuses) {
      const block = this.#order.find((one) => isSame(one.path, path));
      const item = block && this.#rows.get(block);
      if (!item) continue;
      item.dataset.status = status;
      item.firstElementChild!.append(h("span", { class: "outline-status" }, status));
    }
  }

  #row(block: Block): HTMLElement {
    const words = h("span", { class: "outline-words" });
    if (block.role) words.append(h("span", { class: "label" }, `${block.role}: `));
    if (block.name) words.append(h("strong", {}, block.name), " ");
    words.append(`${block.kind} ${block.text}`.trim());
    words.append(...block.notes.map((note) => h("span", { class: "note" }, note)));
    const row = h("div", { class: "outline-row" }, words);
    const item = h("li", { role: "treeitem", tabindex: "-1", "aria-selected": "false" }, row);
    row.onclick = () => this.#pick(block);
    this.#rows.set(block, item);
    if (block.children.length > 0) {
      item.setAttribute("aria-expanded", "true");
      item.append(h("ul", { role: "group" }, ...block.children.map((child) => this.#row(child))));
    }
    return item;
  }

  #pick(block: Block): void {
    this.#mark(block, true);
    this.#rows.get(block)!.focus();
  }

  #mark(block: Block | null, isByHand: boolean): void {
    for (const item of this.#tree.querySelectorAll("[aria-selected='true']")) item.setAttribute("aria-selected", "false");
    for (const item of this.#tree.querySelectorAll("[tabindex='0']")) item.setAttribute("tabindex", "-1");
    this.#chosen = block;
    const first = this.#order[0];
    const item = block ? this.#rows.get(block) : first && this.#rows.get(first);
    item?.setAttribute("tabindex", "0");
    if (block && item) {
      item.setAttribute("aria-selected", "true");
      this.#reveal(item);
    }
    this.#choose(block, isByHand);
    this.#enable();
  }

  /** Scrolls the tree, and nothing around it. */
  #reveal(item: HTMLElement): void {
    const [seen, row] = [this.#tree.getBoundingClientRect(), item.firstElementChild!.getBoundingClientRect()];
    if (row.top < seen.top) this.#tree.scrollTop -= seen.top - row.top;
    else if (row.bottom > seen.bottom) this.#tree.scrollTop += row.bottom - seen.bottom;
  }

  #enable(): void {
    for (const one of this.#buttons) one.disabled = !this.#mayChange || !this.#chosen || this.#chosen.is_fixed;
  }

  #do(operation: (typeof ACTIONS)[number]["operation"]): void {
    if (this.#chosen && this.#mayChange) this.#act({ ...operation, path: this.#chosen.path });
  }

  #key(event: KeyboardEvent): void {
    const keys = `${event.altKey ? "Alt+" : ""}${event.key}`;
    const action = ACTIONS.find((one) => one.keys === keys);
    const at = this.#chosen ? this.#order.indexOf(this.#chosen) : -1;
    const steps: Record<string, number> = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: this.#order.length - 1 };
    if (action) this.#do(action.operation);
    else if (keys in steps) {
      const block = this.#order[steps[keys]!];
      if (block) this.#pick(block);
    } else if (keys === "Enter") this.#enter();
    else return;
    event.preventDefault();
  }
}
