/** Grippers: how far each one is open, closing it, and opening it as far as is written. */
import { runButton, type Card } from "../cards";
import type { Component } from "../description";
import { h } from "../dom";
import { formatName, numberIn } from "../format";
import { FieldError } from "../forms";

const GRIP = "rbxcompose_msgs/action/Grip";
const gripsOf = (component: Component) => component.ports.filter(({ kind, type }) => kind === "serves_action" && type === GRIP);
const WIDE = 50; // [mm], what stands in the field at first

export const card: Card = {
  isFor: (component) => gripsOf(component).length > 0,
  shows: ({ type }) => type === GRIP || type === "control_msgs/action/GripperCommand",
  open(body, component, robot) {
    for (const grip of gripsOf(component)) {
      const name = formatName(grip.skill || grip.name);
      const says = h("p", { class: "says", role: "status" });
      const id = `opening-${component.name}-${grip.name}`;
      const opening = h("input", { id, type: "number", min: "0", step: "1", value: String(WIDE) });
      const open = () => {
        const width = numberIn(opening.value);
        if (!Number.isFinite(width)) throw new FieldError("The opening is no number.");
        return { opening: width / 1000 };
      };
      body.append(
        h("div", { class: "field" }, h("label", { for: id }, name, h("span", { class: "label" }, " opening, mm")), opening),
        h("div", { class: "row" }, runButton(grip, robot, "Open", open, says), runButton(grip, robot, "Close", () => ({ opening: 0 }), says)),
        says,
      );
    }
    return () => undefined;
  },
};
