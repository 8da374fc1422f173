/** Servos: where each joint is, and buttons that enable and relax it. */
import type { Card } from "../cards";
import { h, setText } from "../dom";
import { formatName, formatValue, UNKNOWN } from "../format";
import { isOfJoint, jointsOf, slidingJoints } from "../joints";

export const card: Card = {
  isFor: (component) => jointsOf(component).length > 0,
  shows: (port) => (isOfJoint(port) && /_(enable|relax)$/.test(port.name)) || port.name === "joint_states",
  open(body, component, robot) {
    const cells = new Map<string, HTMLElement>();
    const says = h("p", { class: "says", role: "status" });
    const button = (title: string, joint: string, service: string, request: { data: boolean } | Record<string, never>) => {
      const made = h("button", { type: "button", "aria-label": `${title} ${joint}` }, title);
      made.onclick = () => {
        setText(says, "\u2026");
        robot.link.call(service, request).then(
          () => setText(says, `${formatName(joint)}: ${title.toLowerCase().replace(/e?$/, "ed")}`),
          (error: Error) => setText(says, `${formatName(joint)}: ${error.message}`),
        );
      };
      return made;
    };
    const rows = jointsOf(component).map(({ name, enable, relax }) => {
      const cell = h("td", { class: "value" }, UNKNOWN);
      cells.set(name, cell);
      const buttons = h("td", {}, h("div", { class: "row" }, button("Enable", name, enable.topic, { data: true })));
      if (relax) buttons.firstElementChild!.append(button("Relax", name, relax.topic, {}));
      return h("tr", {}, h("th", { scope: "row" }, formatName(name.replace(/_joint$/, ""))), cell, buttons);
    });
    body.append(h("div", { class: "joints", tabindex: "0", role: "region", "aria-label": "Joints" }, h("table", {}, ...rows)), says);
    const states = component.ports.find(({ name, kind }) => name === "joint_states" && kind === "out");
    if (!states) return () => undefined;
    let sliding = new Set<string>();
    const closeModel = robot.link.subscribe("/robot_description", ({ data }) => (sliding = slidingJoints(String(data))), {
      type: "std_msgs/msg/String",
    });
    const closeStates = robot.link.subscribe(
      states.topic,
      ({ name, position }) => {
        if (!Array.isArray(name) || !Array.isArray(position)) return;
        name.forEach((joint, at) => {
          const cell = cells.get(String(joint));
          const value = position[at];
          if (!cell || typeof value !== "number") return;
          setText(cell, sliding.has(String(joint)) ? formatValue(value * 1000, "mm") : formatValue((value * 180) / Math.PI, "\u00b0"));
        });
      },
      { type: states.type, throttle: 250 },
    );
    return () => {
      closeModel();
      closeStates();
    };
  },
};
