/** Diagnostics as their page shows them. */
import { isMessage, type Json } from "./rosbridge";
import type { Icon } from "./dom";

export interface TreeLine {
  path: string;
  name: string;
  depth: number;
  is_group: boolean;
  level: number;
  message: string;
  hardware_id: string;
  values: [string, string][];
}

export interface Tree {
  time: number;
  level: number;
  cause: string;
  lines: TreeLine[];
  left_out: number;
}

export interface Change {
  number: number;
  time: number;
  path: string;
  old: number;
  new: number;
  cause: string;
}

export interface LevelLook {
  word: string;
  kind: "good" | "fair" | "bad" | "none";
  icon: Icon;
}

const LEVELS: readonly LevelLook[] = [
  { word: "OK", kind: "good", icon: "check" },
  { word: "Warning", kind: "fair", icon: "warning" },
  { word: "Error", kind: "bad", icon: "alarm" },
  { word: "Stale", kind: "none", icon: "wait" },
];

/** Returns how a level of diagnostics is shown; it may be a number or the byte as a character. */
export function levelOf(level: unknown): LevelLook {
  return LEVELS[Number(level)] ?? LEVELS[3]!;
}

/** Returns the items that are not OK, the worst first; groups only repeat them. */
export function problems(lines: readonly TreeLine[]): TreeLine[] {
  const rank = [3, 1, 0, 2]; // errors, warnings, stale
  return lines.filter(({ is_group, level }) => !is_group && level > 0).sort((a, b) => (rank[a.level] ?? 2) - (rank[b.level] ?? 2));
}

/** Returns whether a line is in a group that is folded: one whose path begins its own. */
export function isFolded(path: string, folded: ReadonlySet<string>): boolean {
  for (let end = path.lastIndexOf("/"); end > 0; end = path.lastIndexOf("/", end - 1)) {
    if (folded.has(path.slice(0, end))) return true;
  }
  return false;
}

/** A time in which something had a level [s]. */
export interface Span {
  from: number;
  to: number;
  level: number;
  cause: string;
}

/** Returns the levels of a group or item over time, up to now; before its first change it had its old level. */
export function spansOf(changes: readonly Change[], path: string, from: number, now: number, level: number): Span[] {
  const own = changes.filter((change) => change.path === path);
  if (own.length === 0) return [{ from, to: now, level, cause: "" }];
  const spans: Span[] = [];
  let at = from;
  let current = own[0]!.old;
  let cause = "";
  for (const change of own) {
    if (change.time > at) spans.push({ from: at, to: change.time, level: current, cause });
    [at, current, cause] = [Math.max(from, change.time), change.new, change.cause];
  }
  spans.push({ from: at, to: Math.max(at, now), level: current, cause });
  return spans;
}

/**
 * Returns the known changes with the later ones that `list` returns. Asks from the last known one on: if the robot no
 * longer tells it, it came up again or went on too far to know, and all is learned anew.
 */
export async function learnChanges(known: Change[], list: (after: number) => Promise<Change[]>): Promise<Change[]> {
  const last = known.at(-1);
  if (!last) return list(0);
  const [same, ...later] = await list(last.number - 1);
  const isSame = same?.number === last.number && same.time === last.time && same.path === last.path;
  return isSame ? [...known, ...later] : list(0);
}

export function treeOf(answer: Json): Tree | null {
  return isMessage(answer) && Array.isArray(answer.lines) ? (answer as unknown as Tree) : null;
}
