/** The state machines of an outline as graphs: states and ends as boxes, transitions as arrows between them. */
import { blocksAround, isSame, type Block, type Outline, type Path, type Slot } from "./edited";
import { ACTIVE, statusOf, type Drawn, type Seen } from "./mission";

export interface StateBox {
  name: string;
  /** Null for an end. */
  block: Block | null;
  isStart: boolean;
  /** Whether another machine is in it. */
  isNested: boolean;
}

export interface StateArrow {
  from: string;
  to: string;
  /** The outcomes on which it is taken; none are any. */
  outcomes: string[];
}

export interface MachineGraph {
  title: string;
  boxes: StateBox[];
  arrows: StateArrow[];
}

/** Returns the machines around and in the chosen block, the outermost first; without a choice, the first one. */
export function machinesAround(outline: Outline, chosen: Block | null): MachineGraph[] {
  const around: (Block | null)[] = chosen ? blocksAround(outline.blocks, chosen).reverse() : [];
  const found = [null, ...around].flatMap((block) => machinesIn(block, outline));
  if (found.length > 0) return found;
  const all = (blocks: readonly Block[]): MachineGraph[] => blocks.flatMap((block) => [...machinesIn(block, outline), ...all(block.children)]);
  return all(outline.blocks).slice(0, 1);
}

function machinesIn(block: Block | null, outline: Outline): MachineGraph[] {
  const [slots, children] = block ? [block.slots, block.children] : [outline.slots, outline.blocks];
  const title = block ? block.name || `${block.kind} ${block.text}`.trim() : "The mission";
  return slots.filter(({ of, is_there: isThere }) => of === "state" && isThere).map((slot) => graphOf(title, slot, children));
}

/** Returns the graph of a machine; `blocks` are those of its states, among others. */
export function graphOf(title: string, slot: Slot, blocks: readonly Block[]): MachineGraph {
  const states = blocks.filter(({ path }) => isSame(path.slice(0, -1), slot.path));
  const boxes: StateBox[] = states.map((block) => ({
    name: block.name,
    block,
    isStart: block.name === slot.start,
    isNested: block.slots.some(({ of }) => of === "state"),
  }));
  const arrows = new Map<string, StateArrow>();
  for (const { name, leads } of states) {
    for (const { outcome, to } of leads) {
      const key = JSON.stringify([name, to]);
      const arrow = arrows.get(key) ?? { from: name, to, outcomes: [] };
      arrows.set(key, arrow);
      if (outcome) arrow.outcomes.push(outcome);
      if (!boxes.some((box) => box.name === to)) boxes.push({ name: to, block: null, isStart: false, isNested: false });
    }
  }
  return { title, boxes, arrows: [...arrows.values()] };
}

/** Returns an arrow in words. */
export function arrowWords({ from, to, outcomes }: StateArrow): string {
  return `${from} leads to ${to}${outcomes.length > 0 ? ` after ${outcomes.join(" or ")}` : ""}`;
}

/** Returns the states in which a mission is on the robot, each as its name behind those of the states around it. */
export function activeStates({ state, picture, statuses }: Seen): ReadonlySet<string> {
  const found = new Set<string>();
  const walk = (node: Drawn, around: string[]): void => {
    const names = node.form === "state" ? [...around, node.name || node.role] : around;
    if (names !== around && statusOf(node, statuses) === "running") found.add(JSON.stringify(names));
    for (const child of node.children) walk(child, names);
  };
  if (ACTIVE.has(state)) for (const root of [picture.main, ...picture.interrupts]) walk(root, []);
  return found;
}

/** Returns the name of a state behind those of the states around it. */
export function namesOf(path: Path): string {
  return JSON.stringify(path.filter((_, turn) => path[turn - 1] === "states" && path[turn - 2] === "machine"));
}
