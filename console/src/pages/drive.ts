/** Drive: the pad, keys with a dead-man switch, speeds, batteries, and who drives. */
import { pluck, whyNot, type DriveConfig } from "../config";
import { disable, h, icon, setText } from "../dom";
import { drive, parked, PERIOD, STILL, wanted, type Direction, type DriveEvent, type Motion } from "../driving";
import { BatteryGauge } from "../elements/battery_gauge";
import { CameraView } from "../elements/camera_view";
import { DrivePad } from "../elements/drive_pad";
import { formatNumber, formatValue } from "../format";
import type { Page, Robot } from "../page";
import { isMessage, type Json, type Message } from "../rosbridge";
import "./drive.css";

const KEYS: Record<string, Direction> = {
  ArrowUp: "forward",
  ArrowDown: "back",
  ArrowLeft: "left",
  ArrowRight: "right",
  KeyW: "forward",
  KeyS: "back",
  KeyA: "left",
  KeyD: "right",
};
const NAME = "rbxcompose.name";
const NAME_LENGTH = 40;
const STALE = 1_000; // [ms] after which a measured speed is unknown
const AXES = [
  { key: "forward", label: "Forward", unit: "m/s", place: "twist.twist.linear.x" },
  { key: "turn", label: "Turn", unit: "rad/s", place: "twist.twist.angular.z" },
] as const;

export const page: Page = {
  name: "drive",
  title: "Drive",
  order: 10,
  open(host, robot) {
    const { drive: config, camera: topic } = robot.config;
    const camera = topic ? new CameraView(robot.link, topic) : null;
    if (!config) {
      const batteries = batteryCard(robot);
      host.append(
        h(
          "div",
          { class: "drive empty" },
          h("section", { class: "card" }, icon("wheel"), h("p", {}, "This robot has no base to drive.")),
          ...(camera ? [camera.element] : []),
          batteries.element,
        ),
      );
      return () => {
        batteries.close();
        camera?.close();
      };
    }
    return openDrive(host, robot, config, camera);
  },
};

function openDrive(host: HTMLElement, robot: Robot, config: DriveConfig, camera: CameraView | null): () => void {
  const { link } = robot;
  const cleanups: (() => void)[] = [];
  const limits: Motion = { forward: config.maxSpeed, turn: config.maxTurnRate };
  let state = parked({ forward: limits.forward / 2, turn: limits.turn / 2 });
  let name = storedName();
  let holder = "";
  let lastPublish = 0;
  const barred = whyNot(robot.config, "operate", "Driving"); // empty if this visitor may drive
  let blocked = ""; // why the last attempt to drive came to nothing

  const pad = new DrivePad();
  const hint = h("p", { class: "hint", id: "hint" });
  for (const [key, value] of Object.entries({
    tabindex: "0",
    role: "application",
    "aria-label": "Drive pad: hold and drag, or Shift with the arrow keys",
    "aria-describedby": "hint",
  })) {
    pad.setAttribute(key, value);
  }
  const lease = h("section", { class: "card lease", "aria-label": "Driver" });
  const speeds = speedCard(limits, state.speeds, (next) => dispatch({ is: "speeds", speeds: next }));
  disable(barred, ...speeds.querySelectorAll("input"));
  const velocity = velocityCard(limits);
  const batteries = batteryCard(robot);

  const dispatch = (event: DriveEvent) => {
    const next = drive(state, event, performance.now());
    state = next.state;
    for (const action of next.actions) {
      if (action.do === "publish") publish(action.motion);
      else if (action.do === "take") void take();
      else link.call("/console/drive", { take: false, name }).then(showHolder, () => undefined);
    }
    paint();
  };

  const publish = (motion: Motion) => {
    lastPublish += 1;
    const twist = { linear: { x: motion.forward, y: 0, z: 0 }, angular: { x: 0, y: 0, z: motion.turn } };
    link.publish(config.topic, config.type.endsWith("Stamped") ? { twist } : twist, {
      id: `drive:${lastPublish}`,
      sent: performance.now(),
    });
  };

  const refuse = (why: string) => {
    blocked = why;
    dispatch({ is: "refused" });
  };

  const take = async () => {
    if (!name) return refuse("Enter your name first.");
    try {
      const values = await link.call("/console/drive", { take: true, name });
      showHolder(values);
      if (isMessage(values) && values.success === false) {
        return refuse(holder ? `${holder} is driving.` : sentence(values.message));
      }
      blocked = "";
      dispatch({ is: "granted" });
    } catch (error) {
      refuse(`Cannot drive: ${(error as Error).message}.`);
    }
  };

  const showHolder = (values: Json) => {
    if (isMessage(values) && typeof values.holder === "string") holder = values.holder;
    paint();
  };

  const paint = () => {
    const motion = (state.connected && !state.stopped && !state.latched && wanted(state)) || STILL;
    const live = state.lease === "held" && motion !== STILL;
    pad.show({ x: -motion.turn / (state.speeds.turn || 1), y: motion.forward / (state.speeds.forward || 1) }, live);
    pad.setAttribute("aria-disabled", String(!state.connected || state.stopped));
    velocity.commanded(state.commanded);
    camera?.point(state.commanded.forward / limits.forward, state.commanded.turn / limits.turn);
    setText(hint, hintOf());
    hint.classList.toggle("urgent", hint.textContent !== instructions());
    paintLease();
  };

  const hintOf = (): string => {
    if (barred) return barred;
    if (!state.connected) return "Not connected.";
    if (state.stopped) return "Stopped. Press Release to drive again.";
    if (state.keys.size > 0 && !state.shift) return "Hold Shift as well to drive.";
    return blocked || instructions();
  };

  let painted = "";
  const paintLease = () => {
    const kind = barred ? (holder ? "other" : "barred") : !name ? "name" : state.lease === "held" ? "mine" : holder && holder !== name ? "other" : "free";
    const shown = `${kind} ${name} ${holder} ${state.connected}`;
    lease.classList.toggle("wanting", kind === "name" && blocked !== "");
    if (shown === painted) return;
    painted = shown;
    const held = lease.contains(document.activeElement);
    lease.dataset.kind = kind;
    const other = [icon("warning"), words(`${holder} is driving`, barred || `You can drive when ${holder} lets go`)];
    if (kind === "name") {
      lease.replaceChildren(...(holder ? other : []), nameForm);
    } else if (kind === "other") {
      lease.replaceChildren(...other);
    } else if (kind === "barred") {
      lease.replaceChildren(icon("person"), words("Nobody is driving", barred));
    } else if (kind === "mine") {
      lease.replaceChildren(
        icon("wheel"),
        words("You are driving", `as ${name}`),
        button("Hand back", () => dispatch({ is: "interrupted" })),
      );
    } else {
      const rename = button("Rename", () => {
        name = "";
        storeName("");
        paint();
        lease.querySelector("input")?.focus();
      });
      lease.replaceChildren(icon("person"), words("Nobody is driving", `You are ${name}`), rename);
    }
    if (held) lease.querySelector<HTMLElement>("button, input")?.focus();
  };

  const button = (text: string, action: () => void) => {
    const element = h("button", { type: "button" }, text);
    element.onclick = action;
    element.disabled = !state.connected;
    return element;
  };

  const nameInput = h("input", { id: "name", maxlength: String(NAME_LENGTH), autocomplete: "nickname", required: "" });
  const nameForm = h(
    "form",
    {},
    h("label", { for: "name" }, "Your name, shown to others while you drive"),
    h("div", { class: "row" }, nameInput, h("button", {}, "OK")),
  );
  nameForm.onsubmit = (event) => {
    event.preventDefault();
    name = nameInput.value.trim().slice(0, NAME_LENGTH);
    storeName(name);
    blocked = "";
    pad.focus();
    paint();
  };

  const interrupted = () => dispatch({ is: "interrupted" });
  const key = (event: KeyboardEvent, down: boolean) => {
    const direction = KEYS[event.code];
    const writes = event.target instanceof HTMLInputElement && event.target.type !== "range";
    const onSlider = event.target instanceof HTMLInputElement && event.target.type === "range";
    if (down && (writes || (onSlider && !event.shiftKey))) return;
    if (event.ctrlKey || event.metaKey || event.altKey) {
      if (state.keys.size > 0) interrupted();
    } else if (direction) {
      if (down) event.preventDefault(); // neither the page nor a slider moves meanwhile
      if (!event.repeat) dispatch({ is: "key", direction, down, shift: event.shiftKey });
    } else if (event.key === "Shift") {
      dispatch({ is: "shift", down: event.shiftKey });
    }
  };

  const listen = <T extends EventTarget>(target: T, type: string, listener: (event: Event) => void) => {
    target.addEventListener(type, listener);
    cleanups.push(() => target.removeEventListener(type, listener));
  };
  listen(window, "keydown", (event) => key(event as KeyboardEvent, true));
  listen(window, "keyup", (event) => key(event as KeyboardEvent, false));
  listen(window, "blur", interrupted);
  listen(window, "pagehide", interrupted);
  listen(document, "visibilitychange", () => {
    if (document.hidden) interrupted();
  });
  listen(pad, "pad", (event) => dispatch({ is: "pad", at: (event as CustomEvent).detail }));
  listen(pad, "padlost", interrupted);

  cleanups.push(
    link.state.watch(({ is }) => {
      if (is !== "open") holder = "";
      dispatch({ is: is === "open" && !barred ? "connected" : "disconnected" });
    }),
    robot.stopped.watch((stopped) => dispatch({ is: stopped ? "stopped" : "released" })),
    link.watch("drive", showHolder),
    link.subscribe("odom", velocity.measured, { type: "nav_msgs/Odometry", throttle: PERIOD }),
    batteries.close,
  );
  if (!barred) link.advertise(config.topic, config.type);
  link.onStatus = ({ id, level, msg }) => {
    if (level !== "error") return;
    if (!id.startsWith("drive:")) robot.notify(sentence(msg));
    else if (state.lease === "held") refuse("You no longer drive. Let go, then press again.");
  };
  const timer = setInterval(() => {
    dispatch({ is: "tick" });
    velocity.refresh(performance.now());
  }, PERIOD);
  cleanups.push(() => clearInterval(timer));

  const stick = h("section", { class: "card stick", "aria-label": "Pad" }, pad, hint);
  if (camera) cleanups.push(() => camera.close());
  host.append(h("div", { class: "drive" }, lease, ...(camera ? [camera.element] : []), stick, velocity.element, speeds, batteries.element));
  paint();
  return () => {
    interrupted();
    link.onStatus = () => undefined;
    for (const cleanup of cleanups) cleanup();
  };
}

const coarse = matchMedia("(pointer: coarse)");

function instructions(): string {
  return coarse.matches
    ? "Touch the pad and drag. Lift your finger to stop."
    : "Hold the pad and drag, or hold Shift with the arrow keys or WASD. Let go to stop.";
}

/** Returns a message of the robot as a sentence. */
function sentence(message: Json | undefined): string {
  const text = typeof message === "string" ? message.trim() : "";
  return text ? text.charAt(0).toUpperCase() + text.slice(1) + (/[.!?]$/.test(text) ? "" : ".") : "The robot refused.";
}

function words(first: string, second: string): HTMLElement {
  return h("div", { class: "words", role: "status" }, h("strong", {}, first), h("span", {}, second));
}

function speedCard(limits: Motion, start: Motion, changed: (speeds: Motion) => void): HTMLElement {
  let speeds = start;
  const rows = AXES.map(({ key, unit }) => {
    const label = key === "forward" ? "Top speed" : "Top turn rate";
    const step = limits[key] / 50;
    const input = h("input", {
      id: `top-${key}`,
      type: "range",
      min: String(step),
      max: String(limits[key]),
      step: String(step),
      value: String(start[key]),
    });
    const output = h("output", { for: input.id });
    const show = () => {
      speeds = { ...speeds, [key]: Math.min(limits[key], Number(input.value)) };
      const text = formatValue(speeds[key], unit);
      setText(output, text);
      input.setAttribute("aria-valuetext", text);
      input.style.setProperty("--share", String(speeds[key] / limits[key]));
    };
    input.oninput = () => {
      show();
      changed(speeds);
    };
    show();
    return h("div", { class: "slider" }, h("label", { for: input.id }, label), output, input);
  });
  return h("section", { class: "card speeds", "aria-label": "Speeds" }, ...rows);
}

/** Big: what the robot does; small: what it was asked to do; a bar from the middle shows both. */
function velocityCard(limits: Motion) {
  let at = -Infinity;
  const rows = AXES.map((axis) => ({
    ...axis,
    measured: h("span", { class: "value" }, formatNumber(null, axis.unit)),
    commanded: h("span", { class: "commanded" }),
    bar: h("div", { class: "bar", "aria-hidden": "true" }, h("i"), h("b")),
  }));
  const element = h(
    "section",
    { class: "card velocity", "aria-label": "Velocity" },
    ...rows.map(({ label, unit, measured, commanded, bar }) =>
      h(
        "div",
        { class: "axis" },
        h("span", { class: "label" }, label),
        h("p", {}, measured, h("span", { class: "unit" }, unit)),
        bar,
        commanded,
      ),
    ),
  );
  const share = (value: number, limit: number) => String(Math.max(-1, Math.min(1, value / limit)));
  return {
    element,
    commanded(motion: Motion) {
      for (const { key, unit, commanded, bar } of rows) {
        setText(commanded, `asked ${formatNumber(motion[key], unit)}`);
        bar.style.setProperty("--asked", share(motion[key], limits[key]));
      }
    },
    measured(message: Message) {
      at = performance.now();
      for (const { key, unit, place, measured, bar } of rows) {
        const value = pluck(message, place);
        setText(measured, formatNumber(value, unit));
        bar.style.setProperty("--measured", share(value ?? 0, limits[key]));
      }
    },
    refresh(now: number) {
      if (now - at <= STALE) return;
      for (const { unit, measured, bar } of rows) {
        setText(measured, formatNumber(null, unit));
        bar.style.setProperty("--measured", "0");
      }
    },
  };
}

function batteryCard({ config, link }: Robot): { element: HTMLElement; close: () => void } {
  const element = h("section", { class: "card batteries", "aria-label": "Batteries" });
  const gauges = config.values.map((value) => ({ value, gauge: new BatteryGauge().describe(value) }));
  if (gauges.length === 0) element.append(h("p", { class: "hint" }, "This robot reports no battery."));
  element.append(...gauges.map(({ gauge }) => gauge));
  const cleanups = gauges.map(({ value, gauge }) =>
    link.subscribe(value.topic, (message) => gauge.show(pluck(message, value.field), performance.now()), {
      throttle: 1_000,
      ...(value.type ? { type: value.type } : {}),
    }),
  );
  const timer = setInterval(() => gauges.forEach(({ gauge }) => gauge.refresh(performance.now())), 1_000);
  return {
    element,
    close: () => {
      clearInterval(timer);
      for (const cleanup of cleanups) cleanup();
    },
  };
}

/** A browser may forbid to store anything. */
function storedName(): string {
  try {
    return sessionStorage.getItem(NAME) ?? "";
  } catch {
    return "";
  }
}

function storeName(name: string): void {
  try {
    sessionStorage.setItem(NAME, name);
  } catch {
    // Asked again the next time.
  }
}
