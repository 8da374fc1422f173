/** A mission as its page shows it: rows of its picture, with the status of each node. */
import type { Stop } from "./debugging";
import { formatName } from "./format";
import { isMessage, type Json, type Message } from "./rosbridge";

/** One node of the picture; an interrupt is a node without a number. */
export interface Drawn {
  number: number | null;
  kind: string;
  text: string;
  name: string;
  role: string;
  notes: string[];
  arrows: { outcome: string; to: string }[];
  is_start: boolean;
  children: Drawn[];
  sign: string;
  form: string;
}

export interface Picture {
  name: string;
  about: string;
  main: Drawn;
  interrupts: Drawn[];
  count: number;
}

export interface Transition {
  time: number;
  state: string;
  to: string;
  outcome: string;
}

/** What a look at a mission shows; statuses are by node number, `shown` are its data for people. `by_hand` is what people changed while it ran. */
export interface Seen {
  mission: string;
  state: string;
  began: number | null;
  stopped_at?: Stop[];
  by_hand?: number;
  statuses: Record<string, number>;
  shown: Record<string, string>;
  transitions: Transition[];
  picture: Picture;
}

export interface Input {
  name: string;
  about: string;
  choices: string[];
  default: string | null;
}

export interface Listed {
  name: string;
  about: string;
  state: string;
  claims: string[];
  inputs: Input[];
  starts: string[];
}

export const STATUSES = ["idle", "running", "success", "failure", "skipped"] as const;
export type Status = (typeof STATUSES)[number];

export const ACTIVE: ReadonlySet<string> = new Set(["running", "paused", "waiting"]);

/** Returns the status of a node; an interrupt has that of its reaction. */
export function statusOf(node: Drawn, statuses: Record<string, number>): Status {
  const number = node.number ?? node.children[0]?.number;
  return STATUSES[number == null ? 0 : (statuses[number] ?? 0)] ?? "idle";
}

/** Returns what stands in the row of a node: its role, its name and what it does. */
export function titleOf(node: Drawn): { role: string; name: string; what: string } {
  const isState = node.form === "state";
  return {
    role: node.role,
    name: node.name,
    what: isState ? (node.kind === "state" ? node.text : `${node.kind} ${node.text}`.trim()) : `${node.kind} ${node.text}`.trim(),
  };
}

/** Returns the deepest node that runs, which a viewer wants to see; null if none does. */
export function activeNode(picture: Picture, statuses: Record<string, number>): Drawn | null {
  const within = (node: Drawn): Drawn | null => {
    if (statusOf(node, statuses) !== "running") return null;
    for (const child of node.children) {
      const found = within(child);
      if (found) return found;
    }
    return node;
  };
  for (const root of [...picture.interrupts, picture.main]) {
    const found = within(root);
    if (found) return found;
  }
  return null;
}

export function isSeen(answer: Json): answer is Message & Seen {
  return isMessage(answer) && isMessage(answer.picture) && isMessage(answer.statuses);
}

/** Returns what is seen of a mission that has not run: its picture alone. */
export function unseen(picture: Message): Seen {
  const nothing = { began: null, statuses: {}, shown: {}, transitions: [] };
  return { mission: String(picture.name), state: "idle", ...nothing, picture: picture as unknown as Picture };
}

/** What tests have tried of a mission: `rbxcompose test --coverage` keeps it. */
export interface Tested {
  at: number;
  tests: number;
  ways: number;
  count: number;
  missing: { node: number; text: string }[];
}

/** Returns what no test has tried, by number of a node: the ends of ways such as `do.for.go_to: failure`. */
export function untried(tested: Tested): Map<number, string[]> {
  const found = new Map<number, string[]>();
  for (const { node, text } of tested.missing) {
    found.set(node, [...(found.get(node) ?? []), text.slice(text.lastIndexOf(": ") + 1).trim()]);
  }
  return found;
}

/** Returns how much tests have tried, in a sentence; or that the mission was changed since. */
export function testedText(tested: Tested, picture: Picture): string {
  const when = new Date(tested.at * 1000).toLocaleString();
  if (tested.count !== picture.count) return `The tests of ${when} were for another version of this mission.`;
  const tried = tested.ways - tested.missing.length;
  return `Tests took ${tried} of ${tested.ways} ways (${tested.tests} test${tested.tests === 1 ? "" : "s"}, ${when}).`;
}

/** Returns which missions run, of the answer to `ListMissions`. */
export function runningText(missions: Json): string {
  const running = (Array.isArray(missions) ? missions.filter(isMessage) : []).filter(({ state }) => ["running", "paused", "waiting"].includes(String(state)));
  return running.map(({ name, state }) => `${formatName(String(name))} is ${String(state)}`).join(", ") || "No mission is running";
}
