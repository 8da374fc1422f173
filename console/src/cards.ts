/** Cards of components, drawn from what they declare; a domain may bring a better one as a file in `cards/`. */
import { whyNot } from "./config";
import type { Component, Port } from "./description";
import { levelOf } from "./diagnostics";
import { disable, h, icon, setText } from "./dom";
import { FieldError, fieldsOf, labelOf, leavesOf, messageOf, NO_HINTS, type Field, type TypeDef } from "./forms";
import { formatName, formatNumber, UNKNOWN } from "./format";
import { runningGoal, sendGoal, type KeptGoal } from "./goals";
import type { Robot } from "./page";
import { isMessage, type Json, type Message } from "./rosbridge";
import { plain, unitsIn } from "./units";

export interface Card {
  isFor(component: Component): boolean;
  /** Whether the card shows a port itself; the others follow below it. */
  shows(port: Port): boolean;
  /** Fills the upper part of a card, and returns what closes it. */
  open(body: HTMLElement, component: Component, robot: Robot): () => void;
}

const found = Object.values(import.meta.glob<Card>("./cards/*.ts", { eager: true, import: "card" }));

const LOOK = 500; // [ms] between two values
const MOST = 6; // values of one message
const LONGEST = 80; // letters of a text
const SETTLED: Record<string, string> = { "4": "Done", "5": "Canceled", "6": "Failed" };
/** Messages that are drawn or followed, not read. */
const UNREADABLE = /robot_description|Image$|PointCloud|OccupancyGrid|LaserScan|TFMessage|Marker|Path$|Trajectory|DiagnosticArray|SceneObjects|PlanningScene/;
/** What people read of messages of a type, in place of their values. */
const READERS: Record<string, (message: Message) => string> = {
  "diagnostic_msgs/DiagnosticStatus": ({ level, message }) => [levelOf(level).word, level ? message : ""].filter(Boolean).join(": "),
};
const FINISHED = 4;

/** Fills a card with all that a component offers, and returns what closes it. */
export function fillCard(body: HTMLElement, component: Component, robot: Robot): () => void {
  const cards = found.filter((card) => card.isFor(component));
  const closers = cards.map((card) => card.open(body, component, robot));
  const ports = component.ports.filter((port) => !cards.some((card) => card.shows(port)));
  const values = h("div");
  for (const port of ports) if (isReadable(port)) closers.push(showValue(values, port, robot));
  if (values.childElementCount > 0) body.append(values);
  const actions = ports.filter(({ kind }) => kind === "serves" || kind === "serves_action");
  const named = actions.filter(({ skill }) => skill).sort((a, b) => a.skill.localeCompare(b.skill));
  if (named.length > 0) body.append(h("div", { class: "skills" }, ...named.map((port) => skillOf(port, robot))));
  const plain = actions.filter(({ skill }) => !skill);
  const more = h("details", { class: "more" }, h("summary", {}, "Connections"));
  if (plain.length > 0) more.append(h("div", { class: "skills" }, ...plain.map((port) => skillOf(port, robot))));
  more.append(connections(component));
  more.open = more.querySelector("details[open]") !== null;
  body.append(more);
  return () => closers.forEach((close) => close());
}

function isReadable(port: Port): boolean {
  return port.kind === "out" && port.topic !== "" && !UNREADABLE.test(`${port.topic} ${port.type}`);
}

function showValue(list: HTMLElement, port: Port, robot: Robot): () => void {
  const group = h("dl", { class: "values value-group" });
  const rows = new Map<string, HTMLElement>();
  const row = (name: string): HTMLElement => {
    let cell = rows.get(name);
    if (!cell) {
      cell = h("dd", { class: "value" }, UNKNOWN);
      rows.set(name, cell);
      const label = [port.name, name === "data" ? "" : name].filter(Boolean).join(" ");
      group.append(h("div", {}, h("dt", {}, formatName(label)), cell));
    }
    return cell;
  };
  row("data");
  list.append(group);
  const [read, units] = [READERS[plain(port.type)], unitsIn(port.type)];
  return robot.link.subscribe(
    port.topic,
    (message) => {
      const leaves = leavesOf(read ? { data: read(message) } : message, MOST, units);
      if (leaves.length === 0) leaves.push(["data", null, ""]);
      for (const [name, value, unit] of leaves) setText(row(name), shown(value, name === "data" ? port.unit : unit));
      for (const [name, cell] of rows) cell.parentElement!.hidden = !leaves.some(([own]) => own === name);
    },
    { type: port.type, throttle: LOOK },
  );
}

/** Returns a value as people read it. */
export function shown(value: Json, unit = ""): string {
  if (Array.isArray(value)) return value.map((each) => shown(each)).join(", ") + (unit && `\u202f${unit}`);
  if (typeof value === "string" && value.length > LONGEST) return `${value.slice(0, LONGEST)}\u2026`;
  const text = typeof value === "number" ? (Number.isInteger(value) && !unit ? String(value) : formatNumber(value, unit)) : value === null ? UNKNOWN : String(value);
  return unit && value !== null ? `${text}\u202f${unit}` : text;
}

function connections(component: Component): HTMLElement {
  const words: Record<string, string> = {
    in: "listens to",
    out: "publishes",
    serves_topic: "follows",
    serves: "offers",
    calls: "calls",
    serves_action: "offers",
    calls_action: "uses",
    looks: "looks up transforms",
  };
  const rows = component.ports.map(({ kind, topic, name, type, unit, is_command }) =>
    h(
      "tr",
      {},
      h("th", { scope: "row" }, `${words[kind] ?? kind}${is_command ? " (moves the robot)" : ""}`),
      h("td", {}, topic || name, h("small", {}, ` ${type}${unit ? ` [${unit}]` : ""}`)),
    ),
  );
  const declared = Object.entries(component.capabilities).map(([name, all]) =>
    h("tr", {}, h("th", { scope: "row" }, formatName(name.replace(/(?<=[a-z])(?=[A-Z])/g, " ").toLowerCase())), h("td", {}, all.map(declaredText).join("; "))),
  );
  return h("table", {}, ...rows, ...declared);
}

function declaredText(fields: Record<string, Json>): string {
  return Object.entries(fields)
    .filter(([, value]) => value !== null)
    .map(([name, value]) => `${formatName(name).toLowerCase()} ${typeof value === "object" ? JSON.stringify(value) : shown(value)}`)
    .join(", ");
}

// Services and actions

/** Returns the button of a service or action, with its form if it has one. */
export function skillOf(port: Port, robot: Robot, title = formatName(port.skill || port.name)): HTMLElement {
  const says = h("p", { class: "says", role: "status" });
  if (/\/(Trigger|Empty)$/.test(port.type)) return h("div", { class: "skill" }, runButton(port, robot, title, () => ({}), says), says);
  if (/\/SetBool$/.test(port.type)) {
    const on = runButton(port, robot, `${title}: on`, () => ({ data: true }), says);
    const off = runButton(port, robot, `${title}: off`, () => ({ data: false }), says);
    return h("div", { class: "skill" }, h("div", { class: "row" }, on, off), says);
  }
  const box = h("details", { class: "skill" }, h("summary", {}, title));
  box.addEventListener("toggle", () => {
    if (box.open && box.childElementCount === 1) void fillForm(box, port, robot, title, says);
  });
  box.open = runningGoal(robot.link, goalName(port, title)) !== undefined;
  return box;
}

async function fillForm(box: HTMLElement, port: Port, robot: Robot, title: string, says: HTMLElement): Promise<void> {
  box.append(says);
  setText(says, "Asking for its fields\u2026");
  let fields: Field[];
  try {
    fields = await fieldsAsked(port, robot);
  } catch (error) {
    says.remove();
    box.append(h("p", { class: "says", role: "alert" }, (error as Error).message));
    return;
  }
  setText(says, "");
  const inputs = fields.map((one) => inputOf(one, port));
  const form = h("form", {}, ...inputs.map(({ element }) => element));
  const run = runButton(port, robot, title, () => messageOf(fields, inputs.map(({ read }) => read())), says);
  run.type = "submit";
  form.append(run);
  form.onsubmit = (event) => event.preventDefault();
  box.append(form, says);
}

async function fieldsAsked(port: Port, robot: Robot): Promise<Field[]> {
  const isAction = port.kind === "serves_action";
  const service = isAction ? "/rosapi/action_goal_details" : "/rosapi/service_request_details";
  const answer = await robot.link.call(service, { type: port.type });
  const types = isMessage(answer) && Array.isArray(answer.typedefs) ? (answer.typedefs as unknown as TypeDef[]) : [];
  const root = `${port.type}_${isAction ? "Goal" : "Request"}`;
  return fieldsOf(types, root, { ...NO_HINTS, measures: port.measures, choices: port.choices, unit: port.unit });
}

let lastId = 0;

function inputOf(one: Field, port: Port): { element: HTMLElement; read: () => string } {
  lastId += 1;
  const id = `field-${lastId}`;
  const limits = one.least !== null && one.most !== null ? `${one.least} to ${one.most}` : "";
  const label = h("label", { for: id }, formatName(labelOf(one.path)), h("span", { class: "label" }, ` ${[limits, one.unit].filter(Boolean).join(" ")}`));
  if (one.kind === "boolean") {
    const box = h("input", { id, type: "checkbox" });
    return { element: h("div", { class: "field check" }, box, label), read: () => String(box.checked) };
  }
  if (one.choices.length > 0) {
    const select = h("select", { id }, h("option", { value: "" }, "\u2013"), ...one.choices.map((word) => h("option", { value: word }, formatName(word))));
    return { element: h("div", { class: "field" }, label, select), read: () => select.value };
  }
  const isNumber = one.kind !== "text" && one.kind !== "json";
  const input = h("input", { id, type: "text", autocomplete: "off", ...(isNumber ? { inputmode: "decimal" } : {}) });
  input.value = one.value;
  input.name = `${port.topic} ${one.path.join(".")}`;
  return { element: h("div", { class: "field" }, label, input), read: () => input.value };
}

function goalName(port: Port, title: string): string {
  return `${port.topic} ${title}`;
}

/** Returns a button that calls a service, or sends a goal and becomes the one that cancels it, also if it runs already. */
export function runButton(port: Port, robot: Robot, title: string, message: () => Message, says: HTMLElement): HTMLButtonElement {
  const isAction = port.kind === "serves_action";
  const button = h("button", { type: "button" }, icon(isAction ? "play" : "skip"), title);
  disable(whyNot(robot.config, "operate"), button);
  let cancel: (() => void) | null = null;
  const run = async (kept?: KeptGoal) => {
    try {
      if (isAction) {
        const sent = kept ?? sendGoal(robot.link, goalName(port, title), port.topic, port.type, message());
        cancel = sent.cancel;
        button.replaceChildren(icon("cross"), `Cancel ${title.toLowerCase()}`);
        sent.feedback.watch((feedback) => setText(says, feedback ? sentence(feedback) : "\u2026"));
        const { status, values } = await sent.done;
        says.dataset.kind = status === FINISHED ? "good" : "bad";
        setText(says, [SETTLED[status] ?? "Ended", sentence(values)].filter(Boolean).join(": "));
      } else {
        const request = message();
        setText(says, "\u2026");
        const answer = await robot.link.call(port.topic, request, 15_000);
        const failed = isMessage(answer) && answer.success === false;
        says.dataset.kind = failed ? "bad" : "good";
        setText(says, [failed ? "Failed" : "Done", sentence(answer)].filter(Boolean).join(": "));
      }
    } catch (error) {
      says.dataset.kind = "bad";
      setText(says, error instanceof FieldError ? error.message : `Failed: ${(error as Error).message}`);
    } finally {
      cancel = null;
      button.replaceChildren(icon(isAction ? "play" : "skip"), title);
    }
  };
  button.onclick = () => (cancel ? cancel() : void run());
  const kept = runningGoal(robot.link, goalName(port, title));
  if (kept) void run(kept);
  return button;
}

/** Returns what an answer says: its texts, or its first values. */
function sentence(answer: Json): string {
  const leaves = leavesOf(answer, MOST).filter(([name, value]) => name && value !== "" && name !== "success");
  const texts = leaves.filter(([name]) => name === "message" || name === "error_string" || name === "error_msg");
  if (texts.length > 0) return texts.map(([, text]) => String(text)).join(", ");
  return leaves.map(([name, value]) => `${name} ${shown(value)}`).join(", ");
}
