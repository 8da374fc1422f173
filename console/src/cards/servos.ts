/** Servos: where each joint is, and buttons that enable and relax it. */
import type { Card } from "../cards";
import { whyNot } from "../config";
import type { Component } from "../description";
import { disable, h, icon, setText } from "../dom";
import { formatName, formatValue, UNKNOWN } from "../format";
import { isOfJoint, jointsOf, slidingJoints } from "../joints";
import type { Robot } from "../page";
import { isMessage, type Message } from "../rosbridge";

const STALE = 2_000; // [ms] after which nobody knows where a joint is

export const card: Card = {
  isFor: (component) => jointsOf(component).length > 0,
  shows: (port) => (isOfJoint(port) && /_(enable|relax)$/.test(port.name)) || /^joint_(states|commands)$/.test(port.name),
  open(body, component, robot) {
    const cells = new Map<string, { cell: HTMLElement; at: number }>();
    const says = h("p", { class: "says", role: "status" });
    const button = (title: string, joint: string, service: string, request: { data: boolean } | Record<string, never>) => {
      const made = h("button", { type: "button", "aria-label": `${title} ${joint}` }, title);
      const tell = (text: string, kind: string) => {
        says.dataset.kind = kind;
        setText(says, `${formatName(joint)}: ${text}`);
      };
      const done = title.toLowerCase().replace(/e?$/, "ed");
      made.onclick = () => {
        setText(says, "\u2026");
        robot.link.call(service, request).then(
          (answer) => {
            const { success, message } = isMessage(answer) ? answer : {};
            if (success === false) tell([`not ${done}`, message].filter(Boolean).join(": "), "bad");
            else tell(done, "good");
          },
          (error: Error) => tell(error.message, "bad"),
        );
      };
      disable(whyNot(robot.config, "operate"), made);
      return made;
    };
    const rows = jointsOf(component).map(({ name, enable, relax }) => {
      const cell = h("td", { class: "value" }, UNKNOWN);
      cells.set(name, { cell, at: -Infinity });
      const buttons = h("td", {}, h("div", { class: "row" }, button("Enable", name, enable.topic, { data: true })));
      if (relax) buttons.firstElementChild!.append(button("Relax", name, relax.topic, {}));
      return h("tr", {}, h("th", { scope: "row" }, formatName(name.replace(/_joint$/, ""))), cell, buttons);
    });
    const trouble = "servo_bus.ListFaults" in component.requests ? [faultForm(component, robot)] : [];
    body.append(h("div", { class: "joints", tabindex: "0", role: "region", "aria-label": "Joints" }, h("table", {}, ...rows)), says, ...trouble);
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
          const shown = cells.get(String(joint));
          const value = position[at];
          if (!shown || typeof value !== "number") return;
          shown.at = performance.now();
          setText(shown.cell, sliding.has(String(joint)) ? formatValue(value * 1000, "mm") : formatValue((value * 180) / Math.PI, "\u00b0"));
        });
      },
      { type: states.type, throttle: 250 },
    );
    const timer = setInterval(() => {
      for (const { cell, at } of cells.values()) if (performance.now() - at > STALE) setText(cell, UNKNOWN);
    }, STALE / 4);
    return () => {
      clearInterval(timer);
      closeModel();
      closeStates();
    };
  },
};

/** Returns the form that lets something go wrong with simulated servos. */
function faultForm(component: Component, robot: Robot): HTMLElement {
  const box = h("details", { class: "skill" }, h("summary", {}, "Simulate a fault"));
  const says = h("p", { class: "says", role: "status" });
  const fill = async () => {
    try {
      const faults = await robot.link.ask({ type: "servo_bus.ListFaults", component: component.name });
      if (isMessage(faults)) box.append(formOf(faults), says);
    } catch (error) {
      setText(says, (error as Error).message);
      box.append(says);
    }
  };
  const formOf = (faults: Message) => {
    const what = Object.entries(faults).map(([name, about]) => h("option", { value: name }, `${formatName(name)}: ${String(about)}`));
    const of = jointsOf(component).map(({ name }) => h("option", { value: name }, formatName(name)));
    const [joint, fault, lasts] = [h("select", { id: `of-${component.name}` }, ...of), h("select", { id: `fault-${component.name}` }, ...what), h("input", { id: `lasts-${component.name}`, type: "number", min: "1", value: "10", required: "" })];
    const field = (title: string, input: HTMLElement) => h("div", { class: "field" }, h("label", { for: input.id }, title), input);
    const simulate = h("button", {}, icon("warning"), "Simulate it");
    disable(whyNot(robot.config, "operate"), simulate);
    const form = h("form", {}, field("Joint", joint), field("Fault", fault), field("For how long, s", lasts), simulate);
    form.onsubmit = (event) => {
      event.preventDefault();
      const request = { type: "servo_bus.InjectFault", fault: fault.value, joint: joint.value, lasts: Number(lasts.value) };
      robot.link.ask(request).then(
        (answer) => setText(says, String(answer)),
        (error: Error) => setText(says, error.message),
      );
    };
    return form;
  };
  box.addEventListener("toggle", () => {
    if (box.open && box.childElementCount === 1) void fill();
  });
  return box;
}
