/** An arm: buttons for the poses that have names, and the way to the page where its tip is dragged. */
import { runButton, type Card } from "../cards";
import type { Component } from "../description";
import { h, icon } from "../dom";
import { formatName } from "../format";

const movesOf = (component: Component) =>
  component.ports.find(({ kind, type }) => kind === "serves_action" && type === "rbxcompose_msgs/action/MoveArm");

export const card: Card = {
  isFor: (component) => movesOf(component) !== undefined,
  shows: () => false,
  open(body, component, robot) {
    const move = movesOf(component)!;
    const says = h("p", { class: "says", role: "status" });
    const poses = (move.choices.pose ?? []).map((pose) => runButton(move, robot, formatName(pose), () => ({ pose }), says));
    const drag = h("a", { class: "button", href: "./#model" }, icon("play"), "Drag its tip");
    body.append(h("div", { class: "row", role: "group", "aria-label": "Poses" }, ...poses, drag), says);
    return () => undefined;
  },
};
