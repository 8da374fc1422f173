/** A run of a mission that did not end, since its process crashed or the machine lost power: what it was, and what now. */
import { h, icon } from "./dom";
import type { AskMission } from "./mission_tree";

/** What is left of such a run; `waits` if it is restored and paused, `changed` if it cannot go on. */
export interface LeftOver {
  mission: string;
  at: number;
  doing: string;
  inputs: Record<string, string>;
  changed: string;
  waits: boolean;
}

/** Returns what a person is told of it. */
export function leftOverText(left: LeftOver, when: string): string {
  const run = left.waits ? "This run did not end" : "An earlier run did not end";
  const where = left.doing ? `, at: ${left.doing}` : "";
  const changed = left.changed ? ` It cannot go on, because ${left.changed} changed since.` : "";
  return `${run}: its process crashed or the power was lost (${when}${where}).${changed}`;
}

/** One thing that can be done, as requests that follow each other while none is refused. */
export interface WayOn {
  text: string;
  requests: string[];
}

/** Returns what can be done about it; `isActive` is whether the mission runs, again or still. */
export function waysOn(left: LeftOver, isActive: boolean): WayOn[] {
  if (left.waits) {
    return [
      { text: "Go on from where it was", requests: ["ResumeMission"] },
      { text: "Start again", requests: ["CancelMission", "RunMission"] },
    ];
  }
  const drop = { text: "Forget that run", requests: ["ForgetMission"] };
  const again = { text: "Start again", requests: ["RunMission"] };
  if (isActive) {
    const instead = { text: "Cancel this run, go on with that one", requests: ["CancelMission", "RestoreMission"] };
    return left.changed ? [drop] : [instead, drop];
  }
  return left.changed ? [again, drop] : [{ text: "Go on from where it was", requests: ["RestoreMission"] }, again, drop];
}

/** Shows it, with buttons for who may operate the robot. */
export function showLeftOver(left: LeftOver, isActive: boolean, mayOperate: boolean, ask: AskMission): HTMLElement {
  const when = new Date(left.at * 1000).toLocaleString();
  const box = h("div", { class: "left-over", role: "status" }, h("p", {}, icon("warning"), h("span", {}, leftOverText(left, when))));
  const buttons = waysOn(left, isActive).map(({ text, requests }) => {
    const button = h("button", { type: "button" }, text);
    button.onclick = async () => {
      for (const name of requests) {
        const more = name === "RunMission" ? { inputs: left.inputs, start: "" } : {};
        if (!(await ask({ type: `mission.${name}`, mission: left.mission, ...more }, button))) return;
      }
    };
    return button;
  });
  if (mayOperate && buttons.length > 0) box.append(h("div", { class: "row" }, ...buttons));
  return box;
}
