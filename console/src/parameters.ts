/** Parameters as their page shows them, from what a node says by the services of ROS 2. */
import { numberIn } from "./format";
import { isMessage, type Json, type Message } from "./rosbridge";

/** As the robot has it: numbers are SI, and are not changed by being shown. */
export type Value = boolean | number | string;

/** A parameter of a node; its numbers are in the unit that is shown: `scale` times a number is SI. */
export interface Setting {
  node: string;
  name: string;
  about: string;
  type: number;
  unit: string;
  scale: number;
  least: number | null;
  most: number | null;
  step: number;
  choices: string[];
  constraints: string;
  isReadOnly: boolean;
}

const [BOOL, INTEGER, DOUBLE, STRING] = [1, 2, 3, 4]; // rcl_interfaces/msg/ParameterType
const FIELDS: Record<number, string> = {
  [BOOL!]: "bool_value",
  [INTEGER!]: "integer_value",
  [DOUBLE!]: "double_value",
  [STRING!]: "string_value",
};
const HUGE = 2 ** 53;

/** Returns a setting of its descriptor, or null if its type has no control. */
export function settingOf(node: string, descriptor: Json): Setting | null {
  if (!isMessage(descriptor) || typeof descriptor.type !== "number" || !(descriptor.type in FIELDS)) return null;
  const [, about, written] = /^(.*?)\s*(?:\[([^\]]*)\])?$/s.exec(String(descriptor.description))!;
  const { unit, scale } = shownUnit(written ?? "");
  const constraints = String(descriptor.additional_constraints ?? "");
  const ranges = [descriptor.floating_point_range, descriptor.integer_range].flatMap((all) => (Array.isArray(all) ? all : []));
  const range = isMessage(ranges[0] ?? null) ? (ranges[0] as Message) : {};
  const bound = (value: Json | undefined): number | null =>
    typeof value === "number" && Math.abs(value) < HUGE ? (Math.abs(value) < 1e-300 ? 0 : value / scale) : null;
  return {
    node,
    name: String(descriptor.name),
    about: about!.replaceAll("`", ""),
    type: descriptor.type,
    unit,
    scale,
    least: bound(range.from_value),
    most: bound(range.to_value),
    step: typeof range.step === "number" ? range.step / scale : 0,
    choices: /(?:^|, )one of (.+)$/.exec(constraints)?.[1]?.split(", ") ?? [],
    constraints,
    isReadOnly: descriptor.read_only === true,
  };
}

/** Returns how numbers of a unit are shown: angles in degrees, shares in percent. */
function shownUnit(unit: string): { unit: string; scale: number } {
  if (unit === "0 to 1") return { unit: "%", scale: 0.01 };
  if (/^rad\b/.test(unit)) return { unit: unit.replace("rad", "\u00b0").replace("^2", "\u00b2"), scale: Math.PI / 180 };
  return { unit: unit.replace("^2", "\u00b2"), scale: 1 };
}

/** Returns the value of `rcl_interfaces/msg/ParameterValue`, or null if it is not set. */
export function valueOf(setting: Setting, message: Json): Value | null {
  const field = FIELDS[setting.type];
  if (!isMessage(message) || !field || message.type !== setting.type) return null;
  const value = message[field];
  return isValue(value) ? value : null;
}

export function isValue(value: Json | undefined): value is Value {
  return typeof value === "boolean" || typeof value === "number" || typeof value === "string";
}

/** Returns a value as `rcl_interfaces/msg/Parameter`. */
export function parameterOf(setting: Setting, value: Value): Message {
  return { name: setting.name, value: { type: setting.type, [FIELDS[setting.type]!]: setting.type === INTEGER ? Math.round(Number(value)) : value } };
}

/** Returns a value in the unit that is shown. */
export function shownOf(setting: Setting, value: Value): Value {
  return typeof value === "number" ? tidy(value / setting.scale) : value;
}

/** Returns a value as its field shows it, where a number has six digits. */
export function textOf(setting: Setting, value: Value): string {
  const shown = shownOf(setting, value);
  return String(typeof shown === "number" ? Number(shown.toPrecision(6)) : shown);
}

/** Returns a typed text as a value, or why it is none; the text of the present value is that value, with all its digits. */
export function parsed(setting: Setting, text: string, present: Value): { value: Value } | { why: string } {
  if (setting.type === STRING) return { value: text };
  if (text.trim() === textOf(setting, present)) return { value: present };
  const value = numberIn(text);
  if (!Number.isFinite(value)) return { why: "This is no number." };
  if (setting.type === INTEGER && !Number.isInteger(value)) return { why: "This must be a whole number." };
  if (setting.least !== null && value < setting.least) return { why: `At least ${tidy(setting.least)} ${setting.unit}`.trim() + "." };
  if (setting.most !== null && value > setting.most) return { why: `At most ${tidy(setting.most)} ${setting.unit}`.trim() + "." };
  return { value: value * setting.scale };
}

/** Returns the limits of a number in words, empty if it has none. */
export function limitsOf({ least, most, step, unit }: Setting): string {
  const shown = (value: number) => `${tidy(value)} ${unit}`.trim();
  const both = least !== null && most !== null ? `${shown(least)} to ${shown(most)}` : "";
  const limits = both || (least !== null ? `from ${shown(least)}` : most !== null ? `up to ${shown(most)}` : "");
  return [limits, step > 0 ? `in steps of ${shown(step)}` : ""].filter(Boolean).join(", ");
}

export interface Slide {
  least: number;
  most: number;
  step: number;
}

/** Returns the ends of a slider, or null for what is no number; without a limit it reaches to twice a round value. */
export function slideOf(setting: Setting, present: Value): Slide | null {
  const value = Number(shownOf(setting, present));
  if (setting.type !== INTEGER && setting.type !== DOUBLE) return null;
  if (setting.least === null && setting.most === null) return null;
  const least = setting.least ?? Math.min(0, -round(2 * Math.abs(value)));
  const most = setting.most ?? Math.max(round(2 * value), least + 1);
  const fine = setting.type === INTEGER ? 1 : 10 ** Math.floor(Math.log10((most - least) / 100));
  return { least, most, step: setting.step || fine };
}

/** Returns the next of 1, 2, 5, 10, ... that is not smaller. */
function round(value: number): number {
  const power = 10 ** Math.floor(Math.log10(Math.max(value, 1e-6)));
  return [1, 2, 5, 10].map((digit) => digit * power).find((one) => one >= value * (1 - 1e-9)) ?? value;
}

/** Returns a number without the rounding errors of scaling. */
export function tidy(value: number): number {
  return Number(value.toPrecision(12));
}

/** Something that is changed: `value` is the newest, whether it has arrived or not. */
interface Changing {
  readonly value: Value;
  readonly isSending: boolean;
}

/** What can be taken back, the last change first; `find` returns what has a key now. */
export class Changes {
  readonly #find: (key: string) => Changing | undefined;
  readonly #all: { key: string; before: Value }[] = [];

  constructor(find: (key: string) => Changing | undefined) {
    this.#find = find;
  }

  /** Keeps what a value was before a change; a slider that moves is one change. */
  put(key: string, before: Value): void {
    if (this.#all.at(-1)?.key !== key || !this.#find(key)?.isSending) this.#all.push({ key, before });
  }

  /** Whether nothing can be taken back; what was refused, is as it was before, or is gone, is forgotten. */
  get isEmpty(): boolean {
    for (let last; (last = this.#all.at(-1)); this.#all.pop()) {
      const present = this.#find(last.key)?.value ?? last.before;
      if (present !== last.before) return false;
    }
    return true;
  }

  takeBack(): { key: string; before: Value } | undefined {
    return this.isEmpty ? undefined : this.#all.pop();
  }
}

/**
 * Sends values one after the other: while one is on its way, only the newest waits, and there is a pause between two.
 * A slider makes hundreds of values in a second; the robot gets a few of them, and always the last.
 */
export class Sender<T = Value> {
  readonly #send: (value: T) => Promise<void>;
  readonly #pause: number;
  #waiting: { value: T } | null = null;
  #isBusy = false;
  #running: Promise<void> = Promise.resolve();

  constructor(send: (value: T) => Promise<void>, pause: number) {
    this.#send = send;
    this.#pause = pause;
  }

  /** Whether what was put last has not arrived. */
  get isBusy(): boolean {
    return this.#isBusy;
  }

  /** Resolves when everything that was put has arrived or was refused. */
  get settled(): Promise<void> {
    return this.#running;
  }

  put(value: T): void {
    this.#waiting = { value };
    if (!this.#isBusy) this.#running = this.#run();
  }

  async #run(): Promise<void> {
    this.#isBusy = true;
    while (this.#waiting) {
      const { value } = this.#waiting;
      this.#waiting = null;
      await this.#send(value);
      await new Promise((then) => setTimeout(then, this.#pause));
    }
    this.#isBusy = false;
  }
}
