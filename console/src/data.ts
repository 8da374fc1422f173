/** What topics carry, for their page: rates, numbers to plot, and messages to publish. */
import { isMessage, type Json } from "./rosbridge";

/** Counts messages of the last seconds. */
export class Rate {
  readonly #span: number;
  #times: number[] = [];

  /** `span` is over which time it is taken [ms]. */
  constructor(span = 5_000) {
    this.#span = span;
  }

  count(now: number): void {
    this.#times.push(now);
  }

  /** Returns the messages in a second; null before the second one. */
  at(now: number): number | null {
    this.#times = this.#times.filter((time) => time > now - this.#span);
    const first = this.#times[0];
    if (first === undefined || this.#times.length < 2) return null;
    return ((this.#times.length - 1) * 1000) / Math.max(1, this.#times.at(-1)! - first);
  }
}

/** A number somewhere in a message, by its keys and places: `["pose", "position", "x"]`. */
export type Path = readonly string[];

/** Returns a value of a message, or null if there is none. */
export function valueAt(message: Json, path: Path): Json {
  let at: Json | undefined = message;
  for (const key of path) at = Array.isArray(at) ? at[Number(key)] : isMessage(at ?? null) ? (at as { [key: string]: Json })[key] : undefined;
  return at ?? null;
}

/** Returns a number of a message, or null: NaN comes as null. */
export function numberAt(message: Json, path: Path): number | null {
  const at = valueAt(message, path);
  if (typeof at === "boolean") return Number(at);
  return typeof at === "number" ? at : null;
}

/** Returns what two messages have in common whose values stand at the same places: keys, lengths, texts or numbers. */
export function shapeOf(value: Json): string {
  if (Array.isArray(value)) return `[${value.length}${value.length > 0 ? shapeOf(value[0]!) : ""}]`;
  if (isMessage(value)) return `{${Object.entries(value).map(([key, inner]) => `${key}:${shapeOf(inner)}`).join()}}`;
  return typeof value === "string" ? "s" : "n";
}

/** Numbers over time, for a plot: seconds ago and values, oldest first. */
export class Series {
  readonly #span: number;
  #points: [number, number | null][] = [];

  /** `span` is how long values are kept [ms]. */
  constructor(span = 60_000) {
    this.#span = span;
  }

  add(now: number, value: number | null): void {
    this.#points.push([now, value]);
    const oldest = now - this.#span;
    if (this.#points[0]![0] < oldest) this.#points = this.#points.filter(([time]) => time >= oldest);
  }

  at(now: number): [number[], (number | null)[]] {
    return [this.#points.map(([time]) => (time - now) / 1000), this.#points.map(([, value]) => value)];
  }
}

/** Returns several series as columns over common times, as uPlot has them: at each time, values of the others are absent. */
export function columns(series: readonly Series[], now: number): [number[], ...(number | null | undefined)[][]] {
  const all = series.map((one) => one.at(now));
  const times = [...new Set(all.flatMap(([at]) => at))].sort((a, b) => a - b);
  const place = new Map(times.map((time, at) => [time, at]));
  const rows = all.map(([at, values]) => {
    const row = new Array<number | null | undefined>(times.length).fill(undefined);
    at.forEach((time, turn) => (row[place.get(time)!] = values[turn]));
    return row;
  });
  return [times, ...rows];
}

/** Returns a message as text for publishing, without its header, which the robot fills. */
export function writable(message: Json): string {
  if (!isMessage(message)) return "{}";
  const { header: _, ...fields } = message;
  return JSON.stringify(fields, null, 2);
}
