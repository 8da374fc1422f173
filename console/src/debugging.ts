/** Debugging a mission: its breakpoints by where they stand in the tree, and what the page says while it is stopped. */
import type { Drawn, Picture } from "./mission";

/** A breakpoint: how it was written, and the nodes and transitions where it stops the mission. */
export interface Breakpoint {
  mission: string;
  where: string;
  place: string;
  text: string;
  spots: [number, string | null][];
}

/** Where a mission was stopped: before a node begins, or `after` a state has ended so. */
export interface Stop {
  node: number;
  place: string;
  text: string;
  after: string;
}

/** A datum of a mission that runs, as it would be written; null if that cannot be. */
export interface Datum {
  name: string;
  about: string;
  choices: string[];
  text: string | null;
}

/** Returns the key of the start of a node, or of its transition by an outcome. */
export function spotOf(node: number, outcome: string | null = null): string {
  return outcome === null ? `${node}` : `${node} ${outcome}`;
}

/** Returns the breakpoints of a mission, as they were written, by the spots at which they stop it. */
export function breakpointsAt(listed: Breakpoint[], mission: string): Map<string, string[]> {
  const found = new Map<string, string[]>();
  for (const { where, spots } of listed.filter((one) => one.mission === mission)) {
    for (const [node, outcome] of spots) {
      const spot = spotOf(node, outcome);
      found.set(spot, [...(found.get(spot) ?? []), where]);
    }
  }
  return found;
}

/** Returns how the row of a node at which a mission was stopped says so. */
export function stoppedHere({ after }: Stop): string {
  return after ? `stopped here, after ${after}` : "stopped here, before it begins";
}

/** Returns where a mission was stopped, in the words of the robot's log. */
export function stoppedText(stops: Stop[]): string {
  return stops
    .map(({ place, text, after }) => `Stopped at ${place}, ${after ? `after ${text}: ${after}` : `before ${text}`}.`)
    .join(" ");
}

/** Returns what a run lacks that people have changed; empty if nobody has. */
export function byHandText(count: number): string {
  if (count === 0) return "";
  return count === 1
    ? "Changed by hand once: this run cannot be reproduced without that."
    : `Changed by hand ${count} times: this run cannot be reproduced without these changes.`;
}

/** Returns the machine whose state this is, by its number: a picture that came later has others; null for every other node. */
export function machineOf(state: Drawn, picture: Picture): Drawn | null {
  if (state.form !== "state") return null;
  const within = (node: Drawn): Drawn | null => {
    if (node.children.some(({ number }) => number === state.number)) return node;
    for (const child of node.children) {
      const found = within(child);
      if (found) return found;
    }
    return null;
  };
  for (const root of [picture.main, ...picture.interrupts]) {
    const found = within(root);
    if (found) return found;
  }
  return null;
}
