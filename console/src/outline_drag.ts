/** Dragging rows of an outline with mouse, pen or finger; a finger rests before it drags, so that it can scroll, too. */
import type { Block } from "./edited";
import { dropAt, dropWords, isWithin, type Drop, type Row } from "./outline_rows";

const REST = 300; // [ms] that a finger rests before it drags
const FAR = 6; // [px] that a pointer moves before it drags; a finger that moves so far before it drags, scrolls
const MARGIN = 40; // [px] at the edges of the tree, in which it scrolls
const SPEED = 8; // [px] for each frame

/** What the outline shows and does for a drag. */
export interface DragHost {
  /** The block of the row that was pressed; null if it is none that may move. */
  blockOf(target: EventTarget | null): Block | null;
  rows(): Row[];
  /** Shows what is dragged, where it would go, and that in words; null ends it. */
  show(moved: Block | null, drop: Drop | null, words: string): void;
  drop(moved: Block, drop: Drop): void;
}

export class OutlineDrag {
  readonly #tree: HTMLElement;
  readonly #host: DragHost;
  #pressed: { block: Block; id: number; x: number; y: number } | null = null;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #moved: Block | null = null;
  #drop: Drop | null = null;
  #at = { x: 0, y: 0 };
  #hasDragged = false; // the click that follows chooses nothing

  constructor(tree: HTMLElement, host: DragHost) {
    [this.#tree, this.#host] = [tree, host];
    tree.addEventListener("pointerdown", (event) => this.#press(event));
    tree.addEventListener("pointermove", (event) => this.#move(event));
    tree.addEventListener("pointerup", () => this.#release());
    tree.addEventListener("pointercancel", () => this.cancel());
    tree.addEventListener("contextmenu", (event) => this.#pressed && event.preventDefault()); // a long press is a drag
    // While it drags, a finger does not scroll.
    tree.addEventListener("touchmove", (event) => this.#moved && event.preventDefault(), { passive: false });
    tree.addEventListener("click", (event) => this.#hasDragged && event.stopPropagation(), { capture: true });
  }

  /** Goes on with another outline, in which `find` returns what the dragged block has become. */
  follow(find: (block: Block) => Block | undefined): void {
    if (!this.#pressed) return;
    const now = find(this.#pressed.block);
    if (!now) return this.cancel();
    this.#pressed.block = now;
    if (!this.#moved) return;
    this.#moved = now;
    this.#aim();
  }

  /** Ends a drag without a drop. */
  cancel(): void {
    clearTimeout(this.#timer);
    this.#pressed = null;
    if (!this.#moved) return;
    this.#moved = this.#drop = null;
    removeEventListener("keydown", this.#key, { capture: true });
    this.#host.show(null, null, "");
  }

  #press(event: PointerEvent): void {
    this.#hasDragged = false;
    if (!event.isPrimary || event.button !== 0) return this.cancel();
    const block = this.#host.blockOf(event.target);
    if (!block) return;
    this.#at = { x: event.clientX, y: event.clientY };
    this.#pressed = { block, id: event.pointerId, ...this.#at };
    clearTimeout(this.#timer);
    if (event.pointerType === "touch") this.#timer = setTimeout(() => this.#begin(), REST);
  }

  #move(event: PointerEvent): void {
    const pressed = this.#pressed;
    if (!pressed || event.pointerId !== pressed.id) return;
    this.#at = { x: event.clientX, y: event.clientY };
    const isFar = Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > FAR;
    if (this.#moved) this.#aim();
    else if (isFar && event.pointerType === "touch") this.cancel();
    else if (isFar) this.#begin();
  }

  #begin(): void {
    if (!this.#pressed) return;
    this.#moved = this.#pressed.block;
    this.#hasDragged = true;
    this.#tree.setPointerCapture(this.#pressed.id);
    addEventListener("keydown", this.#key, { capture: true });
    this.#aim();
    requestAnimationFrame(() => this.#scroll());
  }

  #aim(): void {
    const moved = this.#moved!;
    const found = dropAt(this.#host.rows(), this.#at.x, this.#at.y);
    this.#drop = found && !isWithin(found, moved) ? found : null;
    const words = this.#drop ? `Drop it ${dropWords(this.#drop)}` : found ? "Not into itself" : "Not here";
    this.#host.show(moved, this.#drop, words);
  }

  /** Scrolls while the pointer is at an edge of the tree. */
  #scroll(): void {
    if (!this.#moved) return;
    const { top, bottom } = this.#tree.getBoundingClientRect();
    const way = this.#at.y < top + MARGIN ? -SPEED : this.#at.y > bottom - MARGIN ? SPEED : 0;
    const before = this.#tree.scrollTop;
    if (way) this.#tree.scrollTop += way;
    if (this.#tree.scrollTop !== before) this.#aim();
    requestAnimationFrame(() => this.#scroll());
  }

  #release(): void {
    const [moved, drop] = [this.#moved, this.#drop];
    this.cancel();
    if (moved && drop) this.#host.drop(moved, drop);
  }

  readonly #key = (event: KeyboardEvent): void => {
    if (event.key !== "Escape") return;
    event.preventDefault();
    event.stopPropagation();
    this.cancel();
  };
}
