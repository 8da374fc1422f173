/** Fleet: the robots of a system, each with its charge, mission, diagnostics and place, and the way to its console. */
import { pluck, tokenOf } from "../config";
import { watchComponents } from "../description";
import { levelOf } from "../diagnostics";
import { h, icon, setText, svg, type Icon } from "../dom";
import { BatteryGauge } from "../elements/battery_gauge";
import { frameOf, gridOf, pageOf } from "../fleet";
import { formatName, formatNumber } from "../format";
import { runningText } from "../mission";
import type { Page, Robot } from "../page";
import { recall, remember } from "../remembered";
import { isMessage, Rosbridge, type Json } from "../rosbridge";
import { Whereabouts } from "../whereabouts";
import "./fleet.css";

const SLOW = 1_000; // [ms] between two looks at a robot
const LOOK = 2_000; // [ms] between two looks at its topics
const DRAW = 500; // [ms]

export const page: Page = {
  name: "fleet",
  title: "Fleet",
  order: 5,
  isFor: ({ config }) => Object.keys(config.fleet).length > 0,
  open(host, robot) {
    const map = new FleetMap();
    const rows = Object.entries(robot.config.fleet).map(([name, address]) => robotCard(robot, name, address, map));
    host.append(
      h(
        "div",
        { class: "fleet" },
        h("section", { class: "robots", "aria-label": "Robots" }, ...rows.map(({ element }) => element)),
        map.element,
      ),
    );
    const timer = setInterval(() => map.draw(), DRAW);
    return () => {
      clearInterval(timer);
      rows.forEach(({ close }) => close());
    };
  },
};

function robotCard(robot: Robot, name: string, address: string, map: FleetMap) {
  const url = pageOf(address, location);
  const isOwn = name === robot.config.robot;
  const link = isOwn ? robot.link : new Rosbridge(`${url.replace(/^http/, "ws")}rosbridge`);
  const state = h("p", { class: "fleet-state", role: "status" });
  const mission = h("p", { class: "fleet-mission" });
  const health = h("p", { class: "fleet-health" });
  const charges = h("div", { class: "fleet-charges" });
  const given = h("input", { type: "password", autocomplete: "off", required: "", "aria-label": `Link of ${formatName(name)}` });
  const door = h("form", { class: "fleet-door", hidden: "" }, given, h("button", {}, "Show"));
  door.onsubmit = (event) => {
    event.preventDefault();
    link.token = tokenOf(given.value) || given.value.trim();
    remember(keyOf(address), link.token);
    link.reconnect();
  };
  const open = isOwn ? h("span", { class: "label" }, "This page") : h("a", { href: url, class: "button" }, "Open");
  const element = h(
    "article",
    { class: "card fleet-robot" },
    h("header", {}, h("h2", {}, formatName(name)), open),
    state,
    door,
    mission,
    health,
    charges,
  );
  let stoppedBy = "";
  let isKnown = false; // it has said how it is since the connection was opened
  let isRefused = false; // it tells nothing to who has not opened its link
  const showState = () => {
    door.hidden = isKnown || !isRefused;
    element.classList.toggle("unknown", !isKnown);
    if (!isKnown) {
      place.pose = null;
      setText(mission, "");
      health.replaceChildren();
    }
    const [picture, words]: [Icon, string] = isKnown
      ? stoppedBy
        ? ["stop", `Stopped by ${stoppedBy}`]
        : ["link", "Up"]
      : isRefused
        ? ["unlink", "Nothing is known of it. Paste its link, which `rbxcompose up` printed."]
        : ["unlink", link.state.value.is === "lost" ? "Does not answer" : "Connecting\u2026"];
    state.replaceChildren(icon(picture), words);
  };
  const gauges = new Map<string, () => void>();
  const showStatus = (status: Json) => {
    if (!isMessage(status)) return;
    isKnown = true;
    isRefused = false;
    stoppedBy = isMessage(status.stop) ? String(status.stop.by) : "";
    showState();
    for (const [battery, gauge] of Object.entries(isMessage(status.batteries) ? status.batteries : {})) {
      if (gauges.has(battery) || !isMessage(gauge)) continue;
      const value = { name: battery, topic: String(gauge.topic), type: String(gauge.message), field: "data" };
      const shown = new BatteryGauge().describe({ ...value, unit: String(gauge.unit ?? "") });
      charges.append(shown);
      const stop = link.subscribe(value.topic, (message) => shown.show(pluck(message, "data"), performance.now()), {
        type: value.type,
        throttle: SLOW,
      });
      gauges.set(battery, stop);
    }
  };
  const place = new Whereabouts();
  map.places.set(name, place);
  const followed = new Map<string, (() => void) | null>();
  const follow = async () => {
    const found = await link.call("/rosapi/topics").catch(() => null); // there is another look soon
    if (isClosed || !isMessage(found) || !Array.isArray(found.topics) || !Array.isArray(found.types)) return;
    for (const [turn, topic] of found.topics.map(String).entries()) {
      if (!followed.has(topic)) followed.set(topic, place.follow(link, topic, String(found.types[turn])));
    }
  };
  const timer = setInterval(() => void follow(), LOOK);
  let isClosed = false;
  let wasOpen = false;
  if (!isOwn) {
    link.token = recall(keyOf(address)) ?? "";
    link.onStatus = ({ level }) => {
      isRefused ||= level === "error" && !isKnown;
      showState();
    };
  }
  const closers = [
    link.state.watch(({ is }) => {
      isKnown &&= is === "open";
      isRefused &&= is !== "lost" || wasOpen; // it lets strangers go after a while
      wasOpen = is === "open";
      showState();
      if (is === "open") void follow();
    }),
    link.watch("robot/RobotStatus", showStatus, SLOW),
    link.watch("mission/ListMissions", (missions) => setText(mission, runningText(missions)), SLOW),
    link.subscribe(
      "/diagnostics_toplevel_state",
      ({ level, message }) => {
        const shown = levelOf(level);
        health.dataset.kind = shown.kind;
        health.replaceChildren(icon(shown.icon), [shown.word, level ? String(message ?? "") : ""].filter(Boolean).join(": "));
      },
      { type: "diagnostic_msgs/DiagnosticStatus" },
    ),
    watchComponents(link, (components) => place.learn(components)),
    () => clearInterval(timer),
    () => followed.forEach((end) => end?.()),
  ];
  return {
    element,
    close: () => {
      isClosed = true;
      for (const close of [...closers, ...gauges.values()]) close();
      if (!isOwn) link.close();
    },
  };
}

/** Returns under which name this browser keeps what lets it in at an address. */
function keyOf(address: string): string {
  return `token of ${address}`;
}

/** All robots from above, in `map`, or where their odometry has them if they have no such frame; x points right. */
class FleetMap {
  readonly #drawing = svg("svg", { role: "img", "aria-label": "Where the robots are" });
  readonly #caption = h("p", { class: "label" });
  readonly element = h("section", { class: "card fleet-map", "aria-label": "Map" }, this.#drawing, this.#caption);
  readonly places = new Map<string, Whereabouts>();

  constructor() {
    this.draw();
  }

  draw(): void {
    const known = [...this.places].flatMap(([name, { pose, fixed }]) => (pose ? [{ name, pose, fixed }] : []));
    const words = known.map(({ name, pose: { x, y }, fixed }) => {
      const where = `${formatName(name)} at ${formatNumber(x, "m")}, ${formatNumber(y, "m")} m`;
      return fixed === "map" ? where : `${where} in ${fixed}`;
    });
    setText(this.#caption, words.join("; ") || "Waiting for the first position\u2026");
    this.#drawing.replaceChildren();
    if (known.length === 0) return;
    const { left, top, size } = frameOf(known.map(({ pose }) => pose));
    this.#drawing.setAttribute("viewBox", `${left} ${top} ${size} ${size}`);
    const unit = size / 100;
    this.#drawing.append(svg("path", { d: gridOf(left, top, size), class: "fleet-grid" }));
    for (const { name, pose: { x, y, heading } } of known) {
      const turn = `translate(${x} ${-y}) rotate(${(-heading * 180) / Math.PI}) scale(${unit})`;
      const arrow = svg("path", { d: "M3 0L-2.500 2L-1.500 0L-2.500 -2Z", transform: turn, class: "fleet-arrow" });
      const label = svg("text", { x: String(x), y: String(-y + 7 * unit), class: "fleet-label" });
      label.setAttribute("font-size", String(4 * unit));
      label.textContent = formatName(name);
      this.#drawing.append(arrow, label);
    }
  }
}
