/** How components are wired, as a graph to draw: who publishes or calls, and who listens or answers. */
import type { Component } from "./description";

export interface Wire {
  from: string;
  to: string;
  /** Topics, services and actions between the two, sorted. */
  names: string[];
  /** Whether the robot moves by one of them. */
  isCommand: boolean;
}

const GIVES = new Set(["out", "calls", "calls_action"]);
const TAKES = new Set(["in", "serves", "serves_action", "serves_topic"]);

/** Returns one wire for each pair of components that are connected; what everybody is connected to is left out. */
export function wiresOf(components: readonly Component[], isShown: (topic: string) => boolean = () => true): Wire[] {
  const wires = new Map<string, Wire>();
  for (const from of components) {
    for (const given of from.ports) {
      if (!GIVES.has(given.kind) || !given.topic || !isShown(given.topic)) continue;
      for (const to of components) {
        if (to === from) continue;
        for (const taken of to.ports) {
          if (!TAKES.has(taken.kind) || taken.topic !== given.topic) continue;
          const key = `${from.name}\n${to.name}`;
          const wire = wires.get(key) ?? { from: from.name, to: to.name, names: [], isCommand: false };
          wires.set(key, wire);
          if (!wire.names.includes(given.topic)) wire.names.push(given.topic);
          wire.isCommand ||= taken.is_command;
        }
      }
    }
  }
  for (const wire of wires.values()) wire.names.sort();
  return [...wires.values()];
}
