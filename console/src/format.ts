/** How values are written: with the same number of digits always, so that nothing jumps, and a real minus sign. */

const DIGITS: Record<string, number> = { "%": 0, V: 1, A: 1, "m/s": 2, "rad/s": 2, "°C": 0, "°": 0, mm: 0 };
export const MINUS = "\u2212";
export const UNKNOWN = "\u2013";

/** Returns a number with the digits that its unit has, without the unit; a dash if there is none. */
export function formatNumber(value: number | null, unit: string): string {
  if (value === null || !Number.isFinite(value)) return UNKNOWN;
  const text = Math.abs(value).toFixed(DIGITS[unit] ?? 2);
  return value < 0 && Number(text) !== 0 ? MINUS + text : text;
}

/** Returns a number and its unit; a percent sign stands close. */
export function formatValue(value: number | null, unit: string): string {
  const number = formatNumber(value, unit);
  if (value === null || !unit) return number;
  return unit === "%" ? number + unit : `${number}\u202f${unit}`;
}

/** Returns the number that a person typed, with a point or a comma; NaN if there is none. */
export function numberIn(text: string): number {
  return text.trim() === "" ? Number.NaN : Number(text.replace(",", "."));
}

/** Returns what a name of a manifest is for people: `main_battery` is "Main battery". */
export function formatName(name: string): string {
  const words = name.replaceAll(/[_/]+/g, " ").trim();
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** Returns a time that passed [ms] in the largest fitting unit. */
export function formatAge(age: number): string {
  const seconds = Math.max(0, Math.round(age / 1000));
  if (seconds < 60) return `${seconds}\u202fs`;
  return seconds < 3600 ? `${Math.floor(seconds / 60)}\u202fmin` : `${Math.floor(seconds / 3600)}\u202fh`;
}

export type Charge = "good" | "fair" | "low";

/** Returns how full a battery is: up to 30 % low, up to 50 % fair. */
export function chargeOf(percent: number): Charge {
  if (percent <= 30) return "low";
  return percent <= 50 ? "fair" : "good";
}
