/** Missions: which run, and the way to the page that starts and follows them. */
import type { Card } from "../cards";
import { h, icon, setText } from "../dom";
import { UNKNOWN } from "../format";
import { runningText } from "../mission";

const LOOK = 1_000; // [ms]

export const card: Card = {
  isFor: ({ requests }) => "mission.ListMissions" in requests,
  shows: ({ kind, topic }) => kind === "out" && topic.endsWith("/mission/events"),
  open(body, _, robot) {
    const running = h("p", { class: "value" }, UNKNOWN);
    body.append(running, h("a", { class: "button", href: "./#mission" }, icon("play"), "Start or follow one"));
    return robot.link.watch("mission/ListMissions", (missions) => setText(running, runningText(missions)), LOOK);
  },
};
