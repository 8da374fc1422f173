/** What came of a dry run of a mission, or of its tests, below its text. */
import { h, icon, type Icon } from "./dom";
import type { Path } from "./edited";
import type { Point, Pose } from "./map";

export type Statuses = readonly { path: Path; status: string }[];

export interface DryRun {
  /** Empty if the mission has not ended; `why` tells more. */
  outcome: string;
  why: string;
  /** [s] of robot time */
  time: number;
  left_out: number;
  story: { time: number; text: string; is_bad: boolean }[];
  statuses: { path: Path; status: string }[];
  /** The statuses of blocks in the order in which they got them, with the time [s]. */
  changes: { time: number; path: Path; status: string }[];
  /** Where the robot was: time [s], x [m], y [m] and heading [rad] in `map`. */
  track: number[][];
  places: { name: string; x: number; y: number; heading: number; colour: string }[];
}

export interface TestReport {
  tests: { name: string; passed: boolean; outcome: string; problems: { message: string; place: string }[] }[];
  coverage: { ways: number; taken: number; missing: { mission: string; line: number; way: string }[] };
}

const TRAIL = 60; // [s] of robot time

/** Returns the time [s] at a share of a run: at 1, its very end, so that nothing which happened then is left out. */
export function timeAt({ time }: DryRun, share: number): number {
  return share * time;
}

/** Returns the status that each block had last at a time [s]. */
export function statusesAt({ changes }: DryRun, time: number): Statuses {
  const found = new Map<string, { path: Path; status: string }>();
  for (const change of changes) {
    if (change.time > time) break;
    found.set(JSON.stringify(change.path), change);
  }
  return [...found.values()];
}

/** Returns where the robot was at a time [s], and the way to there in the minute before; null if nobody knew. */
export function poseAt({ track }: DryRun, time: number): { robot: Pose; trail: Point[] } | null {
  const before = track.filter(([at]) => at! <= time && at! > time - TRAIL);
  const last = before.at(-1) ?? track.filter(([at]) => at! <= time).at(-1);
  if (!last) return null;
  return { robot: { x: last[1]!, y: last[2]!, heading: last[3]! }, trail: before.map(([, x, y]) => ({ x: x!, y: y! })) };
}

/** Returns how a dry run ended, in a sentence. */
export function ending({ outcome, why, time }: DryRun): string {
  const when = `after ${Number(time.toFixed(1))} s of robot time`;
  if (!outcome) return `Not ended: ${why}`;
  return `It ended in ${outcome} ${when}${why ? `: ${why}` : ""}`;
}

/** Returns how many tests passed and how many ways they took, in a sentence. */
export function tested({ tests, coverage }: TestReport): string {
  const passed = tests.filter((one) => one.passed).length;
  return `${passed} of ${tests.length} test${tests.length === 1 ? "" : "s"} passed; they took ${coverage.taken} of ${coverage.ways} ways.`;
}

export function showDryRun(run: DryRun, ...more: Node[]): HTMLElement {
  const isGood = run.outcome === "success";
  const lines = run.story.map(({ time, text, is_bad: isBad }) => {
    const line = h("li", {}, h("time", {}, `${time.toFixed(1)} s`), ` ${text}`);
    if (isBad) line.prepend(icon("warning"));
    return line;
  });
  const left = run.left_out > 0 ? [h("p", { class: "label" }, `${run.left_out} lines before these are left out.`)] : [];
  const story = h("ol", { class: "lines", tabindex: "0", "aria-label": "Story of the dry run" }, ...lines);
  return card("Dry run", isGood ? "check" : run.outcome ? "cross" : "wait", ending(run), ...more, ...left, story);
}

export function showTests(report: TestReport, isUnsaved: boolean): HTMLElement {
  const rows = report.tests.map((one) =>
    h(
      "li",
      { "data-passed": String(one.passed) },
      icon(one.passed ? "check" : "cross"),
      h("span", {}, `${one.name}: ${one.passed ? "passed" : "failed"}`),
      ...one.problems.map(({ message, place }) => h("p", { class: "label" }, `${message} ${place}`)),
    ),
  );
  const missing = report.coverage.missing.map(({ way, line }) => h("li", { class: "label" }, `not tested: ${way} (line ${line})`));
  const all = report.tests.every((one) => one.passed);
  const of = isUnsaved ? [h("p", { class: "label" }, "They ran with the text as it is here, which is not saved yet.")] : [];
  return card("Tests", all ? "check" : "cross", tested(report), ...of, h("ul", { class: "lines", tabindex: "0", "aria-label": "Tests" }, ...rows, ...missing));
}

function card(title: string, picture: Icon, words: string, ...more: Node[]): HTMLElement {
  const head = h("p", { role: "status", class: "trial-head" }, icon(picture), words);
  return h("section", { class: "trial", "aria-label": title }, h("h2", {}, title), head, ...more);
}
