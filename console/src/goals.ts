/** Goals that this browser sent. They outlive the page that sent them: opened again, it follows them and can cancel them. */
import type { Goal, Message, Rosbridge } from "./rosbridge";
import { Signal } from "./signal";

/** A goal with its last feedback. */
export interface KeptGoal extends Goal {
  feedback: Signal<Message | null>;
}

const running = new WeakMap<Rosbridge, Map<string, KeptGoal>>();

/** Sends a goal, and keeps it by a name until it ends. */
export function sendGoal(link: Rosbridge, name: string, action: string, type: string, message: Message): KeptGoal {
  const feedback = new Signal<Message | null>(null);
  const goal = { ...link.act(action, type, message, (values) => feedback.set(values)), feedback };
  const goals = running.get(link) ?? new Map<string, KeptGoal>();
  running.set(link, goals.set(name, goal));
  const forget = () => {
    if (goals.get(name) === goal) goals.delete(name);
  };
  goal.done.then(forget, forget);
  return goal;
}

/** Returns the goal of a name, if it still runs. */
export function runningGoal(link: Rosbridge, name: string): KeptGoal | undefined {
  return running.get(link)?.get(name);
}
