/** Forms for messages: from the definition of a type, its units and the words it may hold, to what is sent. */
import { formatNumber, numberIn } from "./format";
import { isMessage, type Json, type Message } from "./rosbridge";
import { plain, unitsAt, unitsIn } from "./units";

/** One type as rosapi describes it; `fieldarraylen` is -1 for what is no array, and 0 for one of any length. */
export interface TypeDef {
  type: string;
  fieldnames: string[];
  fieldtypes: string[];
  fieldarraylen: number[];
}

export type Kind = "number" | "integer" | "boolean" | "text" | "json" | "duration" | "angle";

/** One field that a person fills. `scale` times what is typed is what is sent; `path` is where in the message. */
export interface Field {
  path: string[];
  kind: Kind;
  unit: string;
  scale: number;
  choices: string[];
  least: number | null;
  most: number | null;
  value: string;
}

/** What is known about the numbers and texts of a message beside their types: units, and words to choose from. */
export interface Hints {
  measures: Record<string, Json>;
  choices: Record<string, string[]>;
  /** The unit of the only number, if it has no name that counts. */
  unit: string;
}

export const NO_HINTS: Hints = { measures: {}, choices: {}, unit: "" };

const INTEGERS = /^u?int(8|16|32|64)$|^byte$|^char$/;
const NUMBERS = /^(float|double)(32|64)?$/;
const TIMES = /(^|\/)(Time|Duration)$|^time$|^duration$/;
const RANGE = /^(-?[\d.]+) to (-?[\d.]+)$/;
const DEEPEST = 6;
const SHORT = 12; // numbers of a list
const TURNS = ["roll", "pitch", "yaw"] as const; // what people write in place of a quaternion

/** Returns the fields of a message, nested ones by their path; a header is left to the robot but for its frame. */
export function fieldsOf(types: readonly TypeDef[], root: string, hints: Hints = NO_HINTS): Field[] {
  const known = new Map(types.map((type) => [plain(type.type), type]));
  const top = known.get(plain(root)) ?? types[0];
  return top ? within(top, known, [], hints.measures, hints) : [];
}

function within(
  type: TypeDef,
  known: ReadonlyMap<string, TypeDef>,
  path: string[],
  measures: Json | undefined,
  hints: Hints,
): Field[] {
  return type.fieldnames.flatMap((name, at) => {
    const kind = plain(type.fieldtypes[at] ?? "");
    const isArray = (type.fieldarraylen[at] ?? -1) >= 0;
    const inner = unitsAt(measures, name) ?? unitsAt(unitsIn(type.type), name);
    const here = [...path, name];
    if (!isArray && kind === "geometry_msgs/Quaternion") return TURNS.map((turn) => field([...here, turn], "angle", "rad"));
    const nested = known.get(kind);
    if (!isArray && TIMES.test(kind)) return kind.endsWith("uration") ? [field(here, "duration", "s")] : [];
    if (!isArray && nested && path.length < DEEPEST) return within(nested, known, here, inner, hints);
    if (isArray || nested) return [{ ...field(here, "json", ""), value: isArray ? "[]" : "{}" }];
    if (kind === "boolean" || kind === "bool") return [{ ...field(here, "boolean", ""), value: "false" }];
    if (kind === "string" || kind === "wstring") {
      const choices = hints.choices[name] ?? [];
      const value = name === "frame_id" ? "map" : "";
      return [{ ...field(here, "text", ""), choices, value }];
    }
    const isInteger = INTEGERS.test(kind);
    if (!isInteger && !NUMBERS.test(kind)) return [{ ...field(here, "json", ""), value: "null" }];
    const unit = typeof inner === "string" ? inner : path.length === 0 && type.fieldnames.length === 1 ? hints.unit : "";
    return [field(here, isInteger ? "integer" : "number", unit)];
  });
}

function field(path: string[], kind: Kind, unit: string): Field {
  const range = RANGE.exec(unit);
  const [least, most] = range ? [Number(range[1]), Number(range[2])] : unit === "%" ? [0, 100] : [null, null];
  const isAngle = unit === "rad" || unit === "rad/s"; // people think in degrees
  const shown = range ? "" : isAngle ? unit.replace("rad", "\u00b0") : unit;
  return { path, kind, unit: shown, scale: isAngle ? Math.PI / 180 : 1, choices: [], least, most, value: kind === "text" ? "" : "0" };
}

/** Returns what a field is called: the path without what is said by the last word. */
export function labelOf(path: readonly string[]): string {
  return path.join(" ").replaceAll("_", " ");
}

export class FieldError extends Error {
  override name = "FieldError";
}

/** Returns the message that filled fields make. Throws a FieldError that names the first field that is wrong. */
export function messageOf(fields: readonly Field[], values: readonly string[]): Message {
  const message: Message = {};
  const turned = new Set<Message>();
  fields.forEach((one, at) => {
    let place = message;
    for (const key of one.path.slice(0, -1)) place = (place[key] ??= {}) as Message;
    place[one.path.at(-1)!] = valueOf(one, (values[at] ?? "").trim());
    if (one.kind === "angle") turned.add(place);
  });
  for (const place of turned) {
    const quaternion = quaternionOf(...(TURNS.map((turn) => Number(place[turn])) as [number, number, number]));
    for (const turn of TURNS) delete place[turn];
    Object.assign(place, quaternion);
  }
  return message;
}

/** Returns the rotation by roll, then pitch, then yaw [rad] about the axes that stay (REP 103). */
export function quaternionOf(roll: number, pitch: number, yaw: number): { x: number; y: number; z: number; w: number } {
  const [sr, sp, sy] = [Math.sin(roll / 2), Math.sin(pitch / 2), Math.sin(yaw / 2)];
  const [cr, cp, cy] = [Math.cos(roll / 2), Math.cos(pitch / 2), Math.cos(yaw / 2)];
  return {
    x: sr * cp * cy - cr * sp * sy,
    y: cr * sp * cy + sr * cp * sy,
    z: cr * cp * sy - sr * sp * cy,
    w: cr * cp * cy + sr * sp * sy,
  };
}

function valueOf(one: Field, text: string): Json {
  const label = labelOf(one.path);
  if (one.kind === "text") return text;
  if (one.kind === "boolean") return text === "true";
  if (one.kind === "json") {
    try {
      return JSON.parse(text || "null") as Json;
    } catch {
      throw new FieldError(`${label}: this is no JSON`);
    }
  }
  const number = numberIn(text);
  if (!Number.isFinite(number)) throw new FieldError(`${label}: this is no number`);
  if (one.kind === "integer" && !Number.isInteger(number)) throw new FieldError(`${label}: this must be a whole number`);
  if (one.least !== null && number < one.least) throw new FieldError(`${label}: at least ${one.least}`);
  if (one.most !== null && number > one.most) throw new FieldError(`${label}: at most ${one.most}`);
  if (one.kind === "duration") {
    const sec = Math.floor(number);
    return { sec, nanosec: Math.round((number - sec) * 1e9) };
  }
  return number * one.scale;
}

/** One value of a message: where it is, what it is, and its unit, empty if that is not known. */
export type Leaf = [path: string, value: Json, unit: string];

/** Returns the plain values of a message, so many at most: without headers, empty ones, and lists but short ones of numbers. */
export function leavesOf(message: Json, most: number, units?: Json, path: readonly string[] = []): Leaf[] {
  const unit = typeof units === "string" ? units : "";
  if (!isMessage(message)) return message === "" ? [] : [[path.join(" "), message, unit]];
  const found: Leaf[] = [];
  for (const [name, value] of Object.entries(message)) {
    if (found.length >= most) break;
    if (name === "header" || name === "stamp" || name.startsWith("covariance")) continue;
    const inner = unitsAt(units, name);
    if (!Array.isArray(value)) found.push(...leavesOf(value, most - found.length, inner, [...path, name]));
    else if (value.some((each) => each !== null) && !isNames(message, name, value.length))
      found.push([[...path, name].join(" "), listed(value, message.name), typeof inner === "string" ? inner : ""]);
  }
  return found;
}

/** Returns whether a list only names the numbers of others, as in a `JointState`. */
function isNames(message: Message, name: string, length: number): boolean {
  return name === "name" && Object.entries(message).some(([other, list]) => other !== name && Array.isArray(list) && list.length === length);
}

/** Returns a short list of numbers, with names if there are as many; of another list how long it is. */
function listed(list: readonly Json[], names: Json | undefined): Json {
  if (list.length > SHORT || !list.every((each) => typeof each === "number" || each === null)) return `${list.length} items`;
  if (!Array.isArray(names) || names.length !== list.length) return [...list];
  const shortened = names.map((name) => String(name).replace(/_joint$/, "").replaceAll("_", " "));
  return list.map((each, at) => `${shortened[at]} ${formatNumber(each as number | null, "")}`);
}
