/** The outline of a mission beside its text: blocks to choose, to fold, and to move by keys, buttons and dragging. */
import { h, icon, setText } from "./dom";
import { allBlocks, blockAt, isSame, type Block, type Outline, type Path, type Slot } from "./edited";
import { OutlineDrag } from "./outline_drag";
import { sameBlocks, seenBlocks, wordsOf, type Drop, type Row } from "./outline_rows";

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

/** What is on the screen for a block; it outlives edits, as long as the block is still the same. */
interface Shown {
  block: Block;
  parent: Block | null;
  item: HTMLElement;
  row: HTMLElement;
  fold: HTMLButtonElement;
  words: HTMLElement;
  said: string;
  folding: string;
  inner: HTMLElement;
}

export class OutlineView {
  readonly element = h("section", { class: "outline", "aria-label": "Outline" });
  readonly #tree = h("ul", { role: "tree", "aria-label": "Blocks of the mission" });
  readonly #says = h("p", { class: "outline-says", role: "status" });
  readonly #buttons: HTMLButtonElement[];
  readonly #act: (operation: Operation) => void;
  readonly #choose: (block: Block | null, isByHand: boolean) => void;
  readonly #enter: () => void;
  readonly #folded = new Set<Block>();
  readonly #drag: OutlineDrag;
  #outline: Outline = { blocks: [], slots: [] };
  #shown = new Map<Block, Shown>();
  #byItem = new Map<Element, Shown>();
  #chosen: Block | null = null;
  #marked: HTMLElement | null = null; // the item that Tab leads to
  #mayChange = false;

  /** `act` changes the text, `choose` learns of each choice, and whether it was made here; `enter` goes to the text. */
  constructor(act: (operation: Operation) => void, choose: (block: Block | null, isByHand: boolean) => void, enter: () => void) {
    [this.#act, this.#choose, this.#enter] = [act, choose, enter];
    this.#buttons = ACTIONS.map(({ words, keys, operation }) => {
      const made = h("button", { type: "button", "aria-keyshortcuts": keys, title: keys.replace("Arrow", "") }, words);
      made.onclick = () => this.#do(operation);
      return made;
    });
    const bar = h("div", { class: "outline-bar", role: "group", "aria-label": "The chosen block" }, ...this.#buttons);
    this.element.append(bar, this.#tree, this.#says);
    this.#tree.onkeydown = (event) => this.#key(event);
    this.#tree.onclick = ({ target }) => this.#click(target);
    this.#drag = new OutlineDrag(this.#tree, {
      blockOf: (target) => this.#draggable(target),
      rows: () => this.#rows(),
      show: (moved, drop, words) => this.#showDrag(moved, drop, words),
      drop: ({ path }, { to, index }) => this.#act({ op: "move_to", path, to, index }),
    });
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

  /** Shows another outline, and chooses the block at a path, else the one at the cursor. What did not change stays as it is. */
  show(outline: Outline, path: Path | null, cursor: number): void {
    const hadFocus = this.#tree.contains(document.activeElement);
    this.#fade();
    const same = sameBlocks(this.#outline.blocks, outline.blocks);
    const [folded, before] = [new Set(this.#folded), this.#shown];
    this.#folded.clear();
    for (const [block, old] of same) if (folded.has(old)) this.#folded.add(block);
    this.#outline = outline;
    this.#shown = new Map();
    this.#byItem.clear();
    const known = (block: Block): Shown | undefined => {
      const old = same.get(block);
      return old && before.get(old);
    };
    this.#fill(this.#tree, outline.blocks, null, known);
    const now = new Map([...same].map(([block, old]) => [old, block]));
    this.#drag.follow((block) => now.get(block));
    const wanted = path ? allBlocks(outline.blocks).find((block) => isSame(block.path, path)) : undefined;
    if (wanted) this.#reach(wanted);
    this.#mark(wanted ?? this.#seenAt(cursor), wanted !== undefined);
    if (hadFocus) this.focus();
  }

  /** Chooses the block at a place of the text. */
  follow(cursor: number): void {
    const block = this.#seenAt(cursor);
    if (block !== this.#chosen) this.#mark(block, false);
  }

  /** Chooses the block at a path, and shows it. */
  choose(path: Path): void {
    const block = allBlocks(this.#outline.blocks).find((one) => isSame(one.path, path));
    if (!block) return;
    this.#reach(block);
    this.#mark(block, true);
  }

  /** Takes the keyboard to the chosen block. */
  focus(): void {
    if (this.#chosen) this.#shown.get(this.#chosen)!.item.focus();
  }

  /** Colours the blocks by how each ended, until another outline is shown. */
  colour(statuses: readonly { path: Path; status: string }[]): void {
    this.#fade();
    const byPath = new Map(statuses.map(({ path, status }) => [JSON.stringify(path), status]));
    for (const { block, item, row } of this.#shown.values()) {
      const status = byPath.get(JSON.stringify(block.path));
      if (!status) continue;
      item.dataset.status = status;
      row.append(h("span", { class: "outline-status" }, status));
    }
  }

  #fade(): void {
    for (const old of this.#tree.querySelectorAll(".outline-status")) {
      (old.parentElement!.parentElement as HTMLElement).removeAttribute("data-status");
      old.remove();
    }
  }

  // The rows

  /** Puts the items of blocks into a list, and touches only what is not there yet. */
  #fill(list: HTMLElement, blocks: readonly Block[], parent: Block | null, known: (block: Block) => Shown | undefined): void {
    const items = blocks.map((block) => this.#show(block, parent, known));
    const keeps = new Set<Element>(items);
    for (let item = list.firstElementChild; item; ) {
      const next = item.nextElementSibling;
      if (!keeps.has(item)) item.remove();
      item = next;
    }
    let there = list.firstElementChild;
    for (const item of items) {
      if (there !== item && there?.nextElementSibling === item) {
        there.remove(); // it went further down: the others need not move
        there = item;
      }
      if (there === item) there = there.nextElementSibling;
      else list.insertBefore(item, there);
    }
  }

  #show(block: Block, parent: Block | null, known: (block: Block) => Shown | undefined): HTMLElement {
    const shown = known(block) ?? made(block);
    [shown.block, shown.parent] = [block, parent];
    this.#shown.set(block, shown);
    this.#byItem.set(shown.item, shown);
    const said = wordsOf(block);
    if (said !== shown.said) {
      shown.said = said;
      shown.words.replaceChildren(...words(block));
    }
    this.#fill(shown.inner, block.children, block, known);
    this.#showFold(shown);
    return shown.item;
  }

  #showFold(shown: Shown): void {
    const { block, item, fold, inner, words, said } = shown;
    const hasInside = block.children.length > 0;
    const isFolded = this.#folded.has(block);
    const folding = `${hasInside} ${isFolded} ${said}`;
    if (folding === shown.folding) return;
    shown.folding = folding;
    if (fold.hidden === hasInside) fold.hidden = !hasInside;
    if (!hasInside) {
      item.removeAttribute("aria-expanded");
      inner.remove();
      return;
    }
    if (inner.parentElement !== item) item.append(inner);
    inner.hidden = isFolded;
    item.setAttribute("aria-expanded", String(!isFolded));
    fold.setAttribute("aria-label", `${isFolded ? "Show" : "Hide"} what is in ${words.textContent ?? ""}`);
  }

  /** Folds or unfolds a block; what is chosen in a folded one is no more. */
  #fold(block: Block, isFolded: boolean): void {
    if (isFolded) this.#folded.add(block);
    else this.#folded.delete(block);
    this.#showFold(this.#shown.get(block)!);
    if (isFolded && this.#chosen && this.#chosen !== block && allBlocks(block.children).includes(this.#chosen)) this.#pick(block);
  }

  /** Unfolds what is around a block. */
  #reach(block: Block): void {
    let { parent } = this.#shown.get(block)!;
    for (; parent; parent = this.#shown.get(parent)!.parent) if (this.#folded.has(parent)) this.#fold(parent, false);
  }

  #seen(): Block[] {
    return seenBlocks(this.#outline.blocks, (block) => this.#folded.has(block));
  }

  /** Returns the innermost block at a place of the text that is not within a folded one. */
  #seenAt(cursor: number): Block | null {
    let found = blockAt(this.#outline.blocks, cursor);
    for (let above = found; above; above = this.#shown.get(above)?.parent ?? null) if (this.#folded.has(above)) found = above;
    return found;
  }

  #click(target: EventTarget | null): void {
    const item = target instanceof Element ? target.closest("li") : null;
    const shown = item ? this.#byItem.get(item) : undefined;
    if (!shown) return;
    if (shown.fold.contains(target as Node)) this.#fold(shown.block, !this.#folded.has(shown.block));
    else this.#pick(shown.block);
  }

  #pick(block: Block): void {
    this.#mark(block, true);
    this.#shown.get(block)!.item.focus();
  }

  #mark(block: Block | null, isByHand: boolean): void {
    this.#marked?.setAttribute("tabindex", "-1");
    this.#marked?.setAttribute("aria-selected", "false");
    this.#chosen = block;
    const marked = block ?? this.#outline.blocks[0];
    this.#marked = (marked && this.#shown.get(marked)?.item) ?? null;
    this.#marked?.setAttribute("tabindex", "0");
    if (block && this.#marked) {
      this.#marked.setAttribute("aria-selected", "true");
      this.#reveal(this.#marked);
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
    const chosen = this.#mayChange ? this.#chosen : null;
    this.#buttons.forEach((one, turn) => {
      const canGo = chosen !== null && ACTIONS[turn]!.operation.op === "delete" && this.#isOptional(chosen);
      one.disabled = !chosen || (chosen.is_fixed && !canGo);
    });
  }

  /** Returns whether a block is the only one in a place that may be empty, such as `else`. */
  #isOptional(block: Block): boolean {
    const parent = this.#shown.get(block)?.parent;
    return parent?.slots.some(({ path, is_optional: isOptional }) => isOptional && isSame(path, block.path)) ?? false;
  }

  #do(operation: (typeof ACTIONS)[number]["operation"]): void {
    if (this.#chosen && this.#mayChange) this.#act({ ...operation, path: this.#chosen.path });
  }

  // Dragging

  #draggable(target: EventTarget | null): Block | null {
    if (!this.#mayChange || !(target instanceof Element) || target.closest("button")) return null;
    const row = target.closest(".outline-row");
    return (row && this.#byItem.get(row.parentElement!)?.block) ?? null;
  }

  #rows(): Row[] {
    return this.#seen().map((block) => {
      const { parent, row, inner } = this.#shown.get(block)!;
      const { top, bottom, left } = row.getBoundingClientRect();
      const [siblings, slots]: [Block[], Slot[]] = parent ? [parent.children, parent.slots] : [this.#outline.blocks, this.#outline.slots];
      return { block, parent, siblings, slots, top, bottom, left, isOpen: block.children.length > 0 && !inner.hidden };
    });
  }

  #showDrag(moved: Block | null, drop: Drop | null, words: string): void {
    for (const old of this.#tree.querySelectorAll("[data-drop]")) old.removeAttribute("data-drop");
    this.#tree.classList.toggle("drags", moved !== null);
    this.#tree.querySelector(".dragged")?.classList.remove("dragged");
    if (moved) this.#shown.get(moved)?.item.classList.add("dragged");
    if (drop) this.#shown.get(drop.at)!.item.dataset.drop = drop.where;
    setText(this.#says, words);
  }

  // Keys

  #key(event: KeyboardEvent): void {
    const keys = `${event.altKey ? "Alt+" : ""}${event.key}`;
    const action = ACTIONS.find((one) => one.keys === keys);
    const seen = this.#seen();
    const at = this.#chosen ? seen.indexOf(this.#chosen) : -1;
    const steps: Record<string, number> = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: seen.length - 1 };
    if (action) this.#do(action.operation);
    else if (keys in steps) {
      const block = seen[steps[keys]!];
      if (block) this.#pick(block);
    } else if (keys === "ArrowLeft") this.#leave();
    else if (keys === "ArrowRight") this.#inside();
    else if (keys === "Enter") this.#enter();
    else return;
    event.preventDefault();
  }

  /** Folds the chosen block, or goes to the one around it. */
  #leave(): void {
    const block = this.#chosen;
    if (!block) return;
    const { parent } = this.#shown.get(block)!;
    if (block.children.length > 0 && !this.#folded.has(block)) this.#fold(block, true);
    else if (parent) this.#pick(parent);
  }

  /** Unfolds the chosen block, or goes to the first one in it. */
  #inside(): void {
    const block = this.#chosen;
    if (!block) return;
    if (this.#folded.has(block)) this.#fold(block, false);
    else if (block.children[0]) this.#pick(block.children[0]);
  }
}

/** Returns what shows a block, before it shows one. */
function made(block: Block): Shown {
  const words = h("span", { class: "outline-words" });
  // Keys do the same: Tab does not lead through hundreds of buttons.
  const fold = h("button", { type: "button", class: "fold", tabindex: "-1" }, icon("down"));
  const row = h("div", { class: "outline-row" }, fold, words);
  const item = h("li", { role: "treeitem", tabindex: "-1", "aria-selected": "false" }, row);
  fold.hidden = true;
  return { block, parent: null, item, row, fold, words, said: "", folding: "", inner: h("ul", { role: "group" }) };
}

function words(block: Block): (Node | string)[] {
  const { role, name, kind, text, notes } = block;
  return [
    ...(role ? [h("span", { class: "label" }, `${role}: `)] : []),
    ...(name ? [h("strong", {}, name), " "] : []),
    `${kind} ${text}`.trim(),
    ...notes.map((note) => h("span", { class: "note" }, note)),
  ];
}
