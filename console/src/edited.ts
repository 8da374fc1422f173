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

export interface Looked {
  findings: Found[];
  /** How many there are; of very many, only the first are told. */
  count: number;
  errors: number;
  elsewhere: Elsewhere[];
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
export async function askEditor<T>(link: Rosbridge, what: string, mission: string, given: Message = {}): Promise<T> {
  const values = await link.call(`/console/mission/${what}`, { mission, ...given }, PATIENCE);
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
