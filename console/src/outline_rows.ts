/** The rows of an outline as a person folds and drags them: which block is still which after an edit, and where a drop goes. */
import { isSame, type Block, type Path, type Slot } from "./edited";

/** Returns the blocks that are seen: all but those within folded ones. */
export function seenBlocks(blocks: readonly Block[], isFolded: (block: Block) => boolean): Block[] {
  return blocks.flatMap((block) => [block, ...(isFolded(block) ? [] : seenBlocks(block.children, isFolded))]);
}

/** Returns what a row says of a block; two blocks that say the same look the same. */
export function wordsOf({ role, name, kind, text, notes }: Block): string {
  return [role, name, kind, text, ...notes].join("\n");
}

/**
 * Returns for each block of a new outline the one that it was before, as far as there is one: the same among the same
 * siblings, else the one that says the same anywhere else, else whatever is at its place.
 */
export function sameBlocks(before: readonly Block[], after: readonly Block[]): Map<Block, Block> {
  const found = new Map<Block, Block>();
  const lost: Block[] = [];
  const fresh: Block[] = [];
  const pair = (old: readonly Block[], now: readonly Block[]): void => {
    const byWords = grouped(old, wordsOf);
    const free = new Set(old);
    const open: Block[] = [];
    for (const block of now) {
      const one = byWords.get(wordsOf(block))?.shift();
      if (!one) open.push(block);
      else {
        found.set(block, one);
        free.delete(one);
      }
    }
    const left = [...free];
    // One that was edited is where it was, between the same neighbours; if some were moved away, that is not known.
    const isEdited = left.length === open.length;
    open.forEach((block, turn) => {
      const one = left[turn];
      if (isEdited && one && one.kind === block.kind) found.set(block, one);
      else {
        fresh.push(block);
        if (one) lost.push(one);
      }
    });
    lost.push(...left.slice(open.length));
    for (const block of now) {
      const one = found.get(block);
      if (one) pair(one.children, block.children);
    }
  };
  pair(before, after);
  const elsewhere = grouped(lost, wordsOf);
  for (const block of fresh) {
    const one = elsewhere.get(wordsOf(block))?.shift();
    if (!one) continue;
    found.set(block, one);
    pair(one.children, block.children);
  }
  return found;
}

function grouped(blocks: readonly Block[], key: (block: Block) => string): Map<string, Block[]> {
  const found = new Map<string, Block[]>();
  for (const block of blocks) found.set(key(block), [...(found.get(key(block)) ?? []), block]);
  return found;
}

/** A row on the screen: `left` is where its words may begin; `parent` is null, and `slots` are the mission's, at the top. */
export interface Row {
  block: Block;
  parent: Block | null;
  siblings: readonly Block[];
  slots: readonly Slot[];
  top: number;
  bottom: number;
  left: number;
  isOpen: boolean; // its children are seen
}

/** Where a block would be dropped: beside or into another one, and that in words for the robot: a slot, an index. */
export interface Drop {
  at: Block;
  where: "before" | "after" | "into";
  to: Path;
  index: number;
}

const EDGE = 0.3; // of a row, above and below, that means before and after it
const LAST = 1_000; // behind whatever is there

/** Returns where a drop at a place of the screen goes; null above and below all rows. */
export function dropAt(rows: readonly Row[], x: number, y: number): Drop | null {
  const row = rows.find(({ top, bottom }) => top <= y && y < bottom);
  if (!row) return null;
  const part = (y - row.top) / (row.bottom - row.top);
  const slot = slotInside(row.block);
  if (slot && EDGE <= part && part <= 1 - EDGE) return { at: row.block, where: "into", to: slot.path, index: LAST };
  if (part <= 0.5) return beside(row, "before");
  const first = row.isOpen ? rows.find(({ parent }) => parent === row.block) : undefined;
  return first ? beside(first, "before") : beside(outermost(rows, row, x), "after");
}

/** Returns the last slot of a block in which something is, else its last one. */
function slotInside({ slots, children }: Block): Slot | undefined {
  const last = children.at(-1);
  return (last && slots.find(({ path }) => startsWith(last.path, path))) ?? slots.at(-1);
}

/** Returns the row behind which a drop goes: left of the last one in a block, it goes behind that block. */
function outermost(rows: readonly Row[], row: Row, x: number): Row {
  const above = rows.find(({ block }) => block === row.parent);
  return above && x < row.left && row.siblings.at(-1) === row.block ? outermost(rows, above, x) : row;
}

function beside({ block, siblings, slots }: Row, where: "before" | "after"): Drop {
  const [key, behind] = [block.path.at(-1)!, where === "after" ? 1 : 0];
  if (typeof key === "number") return { at: block, where, to: block.path.slice(0, -1), index: key + behind };
  if (slots.some(({ path }) => isSame(path, block.path))) return { at: block, where, to: block.path, index: behind }; // the only step there
  const to = block.path.slice(0, -1);
  return { at: block, where, to, index: siblings.filter(({ path }) => isSame(path.slice(0, -1), to)).indexOf(block) + behind };
}

function startsWith(path: Path, beginning: Path): boolean {
  return isSame(path.slice(0, beginning.length), beginning);
}

/** Returns whether a block would be dropped into itself. */
export function isWithin({ to }: Drop, moved: Block): boolean {
  return startsWith(to, moved.path);
}

/** Returns a drop in words. */
export function dropWords({ at, where }: Drop): string {
  return `${where} ${at.name || `${at.kind} ${at.text}`.trim()}`;
}
