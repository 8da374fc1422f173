/** The text of a mission as it is edited: what the robot's editor answers. */
import { isMessage, type Json, type Message, type Rosbridge } from "./rosbridge";

export interface Edit {
  from: number;
  to: number;
  text: string;
}

/** What is wrong with the text; `fix` corrects it. */
export interface Found {
  code: string;
  severity: "error" | "warning";
  message: string;
  help: string;
  from: number;
  to: number;
  line: number;
  fix: { title: string; edits: Edit[] } | null;
}

/** What is wrong in another file of the robot. */
export interface Elsewhere {
  code: string;
  severity: "error" | "warning";
  message: string;
  help: string;
  place: string;
}

/** A place for blocks: what it holds is one step, several in a list, or entries with names. */
export interface Slot {
  path: Path;
  holds: "one" | "several" | "named";
  of: "step" | "state" | "interrupt";
  /** What one of its parts is called: a state, a case; else the key of the place. */
  part: string;
  is_there: boolean;
  has_names: boolean;
  /** The first of its states, if it is a machine's. */
  start: string;
  /** Whether nothing need be there. */
  is_optional: boolean;
}

/** Where something is in the tree of a text: keys, and numbers in lists. */
export type Path = (string | number)[];

/** A step, a state or an interrupt with its part of the text; what `is_fixed` cannot be moved by itself. */
export interface Block {
  path: Path;
  kind: string;
  text: string;
  name: string;
  role: string;
  from: number;
  to: number;
  is_fixed: boolean;
  notes: string[];
  /** Where a state leads to; an empty outcome is any. */
  leads: { outcome: string; to: string }[];
  slots: Slot[];
  children: Block[];
}

export interface Outline {
  blocks: Block[];
  slots: Slot[];
}

export interface Looked {
  /** What `check` answers has none. */
  outline?: Outline;
  findings: Found[];
  /** How many there are; of very many, only the first are told. */
  count: number;
  errors: number;
  elsewhere: Elsewhere[];
}

/** How the robot changes a text, and the block that is chosen then. */
export interface Changed {
  edits: Edit[];
  chosen: Path;
}

export interface ReadText extends Looked {
  file: string;
  text: string;
  hash: string;
  why_not: string;
}

/** The robot refused, with its reason. */
export class RefusedError extends Error {
  override name = "RefusedError";
}

const PATIENCE = 35_000; // [ms]

/** Asks the robot's editor of missions. Throws a RefusedError, or a CallError if there was no answer. */
export async function askEditor<T>(
  link: Rosbridge,
  what: string,
  mission: string,
  given: Message = {},
  patience = PATIENCE,
): Promise<T> {
  const values = await link.call(`/console/mission/${what}`, { mission, ...given }, patience);
  if (!isMessage(values) || values.success !== true) {
    throw new RefusedError(isMessage(values) ? String(values.message) : "the robot gave no answer");
  }
  return (values.answer ?? null) as Json as unknown as T;
}

/** Returns how many findings there are, in words. */
export function verdict({ errors, count }: { errors: number; count: number }): string {
  const warnings = count - errors;
  const parts = [counted(errors, "error"), counted(warnings, "warning")].filter(Boolean);
  return parts.length > 0 ? parts.join(", ") : "No mistakes";
}

export function counted(count: number, what: string): string {
  return count === 0 ? "" : `${count} ${what}${count === 1 ? "" : "s"}`;
}

/** Returns the kind of a line of a difference, for its colour and for who hears it. */
export function kindOf(line: string): "old" | "new" | "place" | "same" {
  if (line.startsWith("@@")) return "place";
  if (line.startsWith("-")) return "old";
  return line.startsWith("+") ? "new" : "same";
}

/** Returns all blocks, each before those below it. */
export function allBlocks(blocks: readonly Block[]): Block[] {
  return blocks.flatMap((block) => [block, ...allBlocks(block.children)]);
}

/** Returns the innermost block at a place of the text; null if there is none. */
export function blockAt(blocks: readonly Block[], at: number): Block | null {
  const found = blocks.find(({ from, to }) => from <= at && at < to);
  return found ? (blockAt(found.children, at) ?? found) : null;
}

export function isSame(one: Path, other: Path): boolean {
  return one.length === other.length && one.every((key, turn) => key === other[turn]);
}

/** Returns where a new step goes: behind the chosen block, or into it if it is a place for states or interrupts. */
export function placeBehind(outline: Outline, chosen: Block | null): { path: Path; index: number } | null {
  const last = chosen?.path.at(-1);
  if (chosen && typeof last === "number") return { path: chosen.path.slice(0, -1), index: last + 1 };
  if (chosen && chosen.slots.length > 0 && (chosen.kind === "state" || chosen.kind === "interrupt")) {
    return { path: chosen.slots[0]!.path, index: 1_000 };
  }
  if (chosen) return { path: chosen.path, index: 1 };
  const slot = outline.slots.find(({ of, has_names: hasNames }) => of === "step" && !hasNames);
  return slot ? { path: slot.path, index: 1_000 } : null;
}

/** A part that can be added to a block, or to the mission, which is null: `path` and `index` are where it goes. */
export interface OfferedPart {
  part: string;
  to: Block | null;
  path: Path;
  index: number;
}

/** Returns what can be added that has a name or a place of its own: to the chosen block first, then to those around it. */
export function partsOf(outline: Outline, chosen: Block | null): OfferedPart[] {
  const around = chosen ? blocksAround(outline.blocks, chosen) : [];
  const places = [...around.map((block) => [block, block.slots] as const), [null, outline.slots] as const];
  return places.flatMap(([to, slots]) =>
    slots
      .filter((slot) => slot.has_names || !slot.is_there)
      .map(({ part, path }) => ({ part, to, path, index: indexBehind(to ? to.children : outline.blocks, path, chosen) })),
  );
}

/** Returns a block and those around it, the innermost first. */
export function blocksAround(blocks: readonly Block[], wanted: Block): Block[] {
  for (const block of blocks) {
    if (block === wanted) return [block];
    const found = blocksAround(block.children, wanted);
    if (found.length > 0) return [...found, block];
  }
  return [];
}

/** Returns the index in a place behind the part of it in which the chosen block is, else at its end. */
function indexBehind(blocks: readonly Block[], path: Path, chosen: Block | null): number {
  const there = blocks.filter((block) => isSame(block.path.slice(0, -1), path));
  const at = there.findIndex((block) => chosen && isSame(chosen.path.slice(0, block.path.length), block.path));
  return at < 0 ? 1_000 : at + 1;
}
