/** Map: where the robot is, what it sees and where it goes; press a pose or choose a place, and it drives there. */
import { whyNot, type Place } from "../config";
import { watchComponents, type Component, type Port } from "../description";
import { disable, h, icon, setText, type Icon } from "../dom";
import { MapCanvas, type Drag, type ShownPlace, type Tool } from "../elements/map_canvas";
import { formatAge, formatName, formatNumber, formatValue } from "../format";
import {
  applied,
  distance,
  frameOf,
  isOn,
  poseMessage,
  readGrid,
  readMarkers,
  readPath,
  readScan,
  Trail,
  type Grid,
  type Markers,
  type Point,
  type Pose,
  type Transform,
  type Vector,
} from "../map";
import type { Page, Robot } from "../page";
import { PlacesEditor } from "../places_editor";
import { remember, wasOn } from "../remembered";
import { thingMarkers } from "../seen";
import { isMessage, type Json, type Message, type Rosbridge } from "../rosbridge";
import { Trip, type TripState } from "../trip";
import { Whereabouts } from "../whereabouts";
import { outlineOf, readWorld, type World } from "../world";
import "./map.css";

const LOOK = 2_000; // [ms] between two looks at the topics
const TICK = 500;
const OLD = 2_000; // [ms] after which a position is called old
const NAVIGATE = "nav2_msgs/action/NavigateToPose";
const STATUS = "action_msgs/msg/GoalStatusArray";
const INITIAL = "/initialpose";
const SPREAD: Record<number, number> = { 0: 0.25, 7: 0.25, 35: 0.07 }; // of a pose shown by hand [m², m², rad²]
const NUMBER = { type: "number", step: "any", required: "", value: "0" };
const UNKNOWN = "Where the robot is, is not known yet: nobody publishes its odometry or transforms.";
const OFFLINE = "Where the robot is, is not known: there is no connection.";
const NOT_IN_MAP = "Places are poses in map, and no transform leads there: they are not drawn.";
const DEGREES = 180 / Math.PI;

const TOOLS: Record<Tool, readonly [words: string, hint: string]> = {
  move: ["Move view", ""],
  go: ["Go", "Press where the robot is to go, and drag to where it is to look."],
  initial: ["Initial pose", "Press where the robot is, and drag to where it looks."],
  measure: ["Measure", "Drag from one point to another."],
  places: [
    "Edit places",
    "Drag a place, or the handle of the chosen one to turn it; press elsewhere to add one. Arrow keys, Page Up and Page Down move and turn the chosen place, with Shift by 1 cm.",
  ],
};
const KEYS =
  "wheel, pinch, + and \u2212 zoom; 0 fits everything; Escape gives a drag up. " +
  "x points right, y up. The dotted line is where the robot was in the last minute.";
const ICONS: Record<Exclude<TripState["is"], "none">, Icon> = {
  driving: "play",
  arrived: "check",
  canceled: "cross",
  failed: "warning",
  unknown: "unlink",
};

interface Layer {
  words: string;
  /** [ms] between two messages */
  throttle: number;
  /** What the topic is called, if only such ones are drawn. */
  only?: RegExp;
  /** The name under which it is remembered whether it is shown. */
  remembered?: string;
  read(message: Message, topic: string): Drawn | null;
}

/** Topics that are drawn, by type. */
const LAYERS: Record<string, Layer> = {
  Path: {
    words: "Path: green line",
    throttle: 500,
    read: (path) => ({ is: "path", frame: frameOf(path), points: readPath(path) }),
  },
  LaserScan: {
    words: "Laser: red dots",
    throttle: 200,
    read: (scan) => ({ is: "scan", frame: frameOf(scan), points: readScan(scan) }),
  },
  OccupancyGrid: {
    words: "Obstacles",
    throttle: 1_000,
    read: (message, topic) => {
      const grid = readGrid(message);
      return grid && { is: "grid", frame: grid.frame, grid, isCost: /cost/.test(topic) };
    },
  },
  MarkerArray: {
    words: "Zones: hatched, people: circles",
    throttle: 200,
    only: /zone|people/,
    read: (message) => ({ is: "markers", ...readMarkers(message) }),
  },
  Detection3DArray: {
    words: "Seen things: blue, with names",
    throttle: 200,
    read: (message) => ({ is: "markers", ...thingMarkers(message) }),
  },
  World: {
    words: "World: thin outlines",
    throttle: 1_000,
    remembered: "map.world",
    read: (message) => ({ is: "world", frame: "map", world: readWorld(message) }),
  },
};

type Drawn =
  | { is: "path" | "scan"; frame: string; points: Vector[] }
  | { is: "grid"; frame: string; grid: Grid; isCost: boolean }
  | ({ is: "markers" } & Markers)
  | { is: "world"; frame: string; world: World };

const trips = new WeakMap<Rosbridge, Trip>();

export const page: Page = {
  name: "map",
  title: "Map",
  order: 20,
  isFor: ({ config }) => config.drive !== null || config.places.length > 0,
  open(host, robot) {
    const view = new MapView(robot);
    host.append(view.element);
    return () => view.close();
  },
};

class MapView {
  readonly element: HTMLElement;
  readonly #robot: Robot;
  readonly #trip: Trip;
  readonly #canvas = new MapCanvas();
  readonly #where = h("p", { class: "label" });
  readonly #hint = h("p", { class: "map-hint", role: "status" });
  readonly #keys = h("p", { class: "label map-keys", id: "map-keys" });
  readonly #tools = new Map<Tool, HTMLButtonElement>();
  readonly #state = h("p", { class: "map-state", role: "status" });
  readonly #note = h("p", { class: "label" });
  readonly #cancel = button([icon("cross"), "Cancel"], () => this.#trip.cancel());
  readonly #numbers: HTMLFormElement;
  readonly #places: { place: Place; note: HTMLElement; go: HTMLButtonElement }[];
  readonly #placesCard = h("section", { class: "card", "aria-label": "Places" });
  #editor: PlacesEditor | null = null;
  readonly #layers = h("ul", { class: "map-list" });
  readonly #layersCard = h("section", { class: "card", "aria-label": "Layers" }, h("h2", {}, "Layers"), this.#layers);
  readonly #closers: (() => void)[] = [];
  readonly #place = new Whereabouts(() => this.#moved());
  readonly #trail = new Trail();
  readonly #drawn = new Map<string, Drawn | null>();
  readonly #followed = new Map<string, () => void>();
  #fixed = "map";
  #isPlaced = false;
  #navigator: Port | null = null;
  #isDescribed = false;
  #docks: ReadonlySet<string> = new Set();
  #hasLocaliser = false;
  #driver = ""; // the mission that moves the base
  #tool: Tool = "move";
  #measured = "";
  #failure = "";
  #isClosed = false;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #frame = 0;

  constructor(robot: Robot) {
    this.#robot = robot;
    const { link, config } = robot;
    this.#trip = trips.get(link) ?? new Trip(link);
    trips.set(link, this.#trip);
    for (const [tool, [words]] of Object.entries(TOOLS) as [Tool, (typeof TOOLS)[Tool]][]) {
      this.#tools.set(tool, button([words], () => this.#choose(tool)));
      if (tool === "places") this.#tools.get(tool)!.hidden = config.role !== "configure";
    }
    this.#places = config.places.map((place) => {
      const go = button(["Go"], () => this.#go(place, formatName(place.name), "map"));
      go.setAttribute("aria-label", `Go to ${formatName(place.name)}`);
      return { place, note: h("small", { class: "label" }), go };
    });
    this.#numbers = this.#numbersForm();
    const goal = h("section", { class: "card map-goal", "aria-label": "Goal" }, h("h2", {}, "Goal"));
    goal.append(this.#state, this.#note, this.#cancel);
    this.element = h("div", { class: "map" }, goal, this.#chart(), this.#side());
    this.#canvas.onDrag = (drag) => this.#dragged(drag);
    this.#canvas.onGesture = (gesture) => {
      if (this.#placesAreOnMap()) this.#editor?.take(gesture);
      else this.#robot.notify("Places are poses in map, and no transform leads there: write their numbers instead.");
    };
    this.#canvas.onPress = (event) => this.#editor?.press(event) ?? false;
    this.element.onkeydown = ({ key }) => {
      if (key === "Escape") this.#choose("move");
    };
    this.#choose("move");
    const ticker = setInterval(() => this.#tick(), TICK);
    this.#closers.push(
      () => clearInterval(ticker),
      () => cancelAnimationFrame(this.#frame),
      this.#trip.state.watch((state) => this.#showTrip(state)),
      watchComponents(link, (components) => this.#learn(components)),
      link.watch("mission/ListMissions", (missions) => this.#learnMissions(missions), LOOK),
      robot.stopped.watch(() => this.#enable()),
      link.state.watch(({ is }) => {
        if (is === "open") void this.#findTopics();
        else this.#place.seenAt = -Infinity;
        this.#tick();
      }),
    );
  }

  close(): void {
    this.#isClosed = true;
    clearTimeout(this.#timer);
    this.#editor?.close();
    for (const close of [...this.#closers, ...this.#followed.values()]) close();
  }

  #chart(): HTMLElement {
    const zooms = [
      button(["+"], () => this.#canvas.zoom(1.3), "Zoom in"),
      button(["\u2212"], () => this.#canvas.zoom(1 / 1.3), "Zoom out"),
      button(["Fit"], () => this.#canvas.fit(), "Fit everything into the view"),
    ];
    const group = { class: "map-tools", role: "group", "aria-label": "What a drag does" };
    const tools = h("div", group, ...this.#tools.values());
    return h(
      "section",
      { class: "card map-chart", "aria-label": "View" },
      tools,
      h("div", { class: "map-box" }, this.#canvas, h("div", { class: "map-zooms" }, ...zooms)),
      this.#hint,
      this.#where,
      this.#keys,
    );
  }

  #side(): HTMLElement {
    const rows = this.#places.map(({ place, note, go }) =>
      h("li", {}, h("div", {}, h("strong", {}, formatName(place.name)), note), go),
    );
    const places = rows.length
      ? h("ul", { class: "map-list" }, ...rows)
      : h("p", { class: "label" }, "This robot has no places. They are written under `places:` in its manifest.");
    const byNumbers = h("details", {}, h("summary", {}, "Another pose"), this.#numbers);
    this.#layersCard.hidden = true;
    this.#placesCard.append(h("h2", {}, "Places"), places, byNumbers);
    return h(
      "div",
      { class: "map-side" },
      this.#placesCard,
      this.#layersCard,
    );
  }

  #numbersForm(): HTMLFormElement {
    const field = (name: string, words: string) =>
      h("label", { class: "field" }, words, h("input", { name, ...NUMBER }));
    const set = h("button", { value: "initial" }, "Set initial pose");
    const form = h(
      "form",
      { class: "map-numbers" },
      field("x", "x [m]"),
      field("y", "y [m]"),
      field("heading", "heading [°]"),
      h("button", { value: "go" }, "Go"),
      set,
    );
    form.onsubmit = (event) => {
      event.preventDefault();
      const [x, y, heading] = ["x", "y", "heading"].map((name) => Number(new FormData(form).get(name)));
      const pose = { x: x!, y: y!, heading: heading! / DEGREES };
      if (event.submitter === set) this.#setInitial(pose);
      else this.#go(pose, nameOf(pose), this.#fixed);
    };
    return form;
  }

  // What there is

  #learn(components: Component[]): void {
    const servers = components.flatMap(({ ports, capabilities }) => {
      const goals = (capabilities.Navigates ?? []).map((navigates) => navigates.goals);
      const found = ports.filter(({ kind, type }) => kind === "serves_action" && type === NAVIGATE);
      return found.map((port) => ({ port, isDeclared: goals.includes(port.name) }));
    });
    this.#navigator = (servers.find(({ isDeclared }) => isDeclared) ?? servers[0])?.port ?? null;
    if (this.#navigator) this.#watchGoals(this.#navigator.topic);
    const docks = components.flatMap(({ capabilities }) => (capabilities.Charges ?? []).map(({ place }) => place));
    this.#docks = new Set(docks.filter(isMessage).map(({ name }) => String(name)));
    this.#place.learn(components);
    this.#isDescribed = components.length > 0;
    this.#showTrip(this.#trip.state.value);
    this.#tick();
  }

  /** Learns which goals run: one that was sent before the page was loaded can be canceled all the same. */
  #watchGoals(action: string): void {
    const topic = `${action}/_action/status`;
    if (this.#followed.has(topic)) return;
    const listener = (message: Message) => this.#trip.learn(action, message);
    this.#followed.set(topic, this.#robot.link.subscribe(topic, listener, { type: STATUS }));
  }

  #learnMissions(missions: Json): void {
    const driver = (Array.isArray(missions) ? missions.filter(isMessage) : []).find(
      ({ state, claims }) =>
        state === "running" && Array.isArray(claims) && claims.includes(this.#navigator?.claims ?? ""),
    );
    this.#driver = driver ? formatName(String(driver.name)) : "";
    this.#showTrip(this.#trip.state.value);
  }

  /** Looks again and again which topics there are: programs come and go. */
  async #findTopics(): Promise<void> {
    clearTimeout(this.#timer);
    const { link } = this.#robot;
    try {
      const [found, listeners] = await Promise.all([
        link.call("/rosapi/topics"),
        link.call("/rosapi/subscribers", { topic: INITIAL }),
      ]);
      if (this.#isClosed) return;
      if (isMessage(found) && Array.isArray(found.topics) && Array.isArray(found.types)) {
        for (const [turn, topic] of found.topics.entries()) this.#follow(String(topic), String(found.types[turn]));
      }
      const nodes = isMessage(listeners) && Array.isArray(listeners.subscribers) ? listeners.subscribers : [];
      this.#hasLocaliser = nodes.some((node) => !String(node).startsWith("/_")); // those are tools that look on
      if (this.#hasLocaliser) link.advertise(INITIAL, "geometry_msgs/PoseWithCovarianceStamped");
      this.#failure = "";
    } catch (error) {
      if (this.#isClosed) return;
      this.#failure = `What the robot publishes is not known: ${(error as Error).message}.`;
    }
    this.#enable();
    this.#showHint();
    if (link.state.value.is === "open") this.#timer = setTimeout(() => void this.#findTopics(), LOOK);
  }

  #follow(topic: string, type: string): void {
    if (this.#followed.has(topic)) return;
    const { link } = this.#robot;
    const kind = type.split("/").at(-1)!;
    const close = this.#place.follow(link, topic, type);
    if (close) this.#followed.set(topic, close);
    else if (LAYERS[kind]?.only?.test(topic) ?? LAYERS[kind]) this.#addLayer(topic, type, LAYERS[kind]);
  }

  #addLayer(topic: string, type: string, { words, throttle, read, remembered }: Layer): void {
    const listen = () =>
      this.#robot.link.subscribe(
        topic,
        (message) => {
          this.#drawn.set(topic, read(message, topic));
          this.#draw();
        },
        { type, throttle },
      );
    let isShown = !remembered || wasOn(remembered);
    const show = () => {
      this.#followed.get(topic)?.();
      this.#followed.set(topic, isShown ? listen() : () => undefined);
      this.#drawn.delete(topic);
      toggle.setAttribute("aria-pressed", String(isShown));
      toggle.firstChild?.replaceWith(icon(isShown ? "check" : "dot"));
      this.#draw();
    };
    const toggle = button([icon("check"), topic, h("small", { class: "label" }, /cost/.test(topic) ? "Costs: orange" : words)], () => {
      isShown = !isShown;
      if (remembered) remember(remembered, String(isShown));
      show();
    });
    show();
    this.#layers.append(h("li", {}, toggle));
    this.#layersCard.hidden = false;
  }

  // Where the robot is

  #moved(): void {
    const { fixed, pose } = this.#place;
    if (fixed !== this.#fixed) this.#trail.clear();
    const isFirst = !this.#isPlaced;
    [this.#fixed, this.#isPlaced] = [fixed, pose !== null];
    if (pose) this.#trail.add(pose, performance.now());
    if (isFirst) this.#tick();
    this.#draw();
  }

  #isOld(): boolean {
    return performance.now() - this.#place.seenAt > OLD;
  }

  // What is shown

  #draw(): void {
    this.#frame ||= requestAnimationFrame(() => {
      this.#frame = 0;
      this.#paint();
    });
  }

  #paint(): void {
    const drawn = [...this.#drawn.values()].flatMap((each) => {
      const place = each && this.#place.frames.lookUp(this.#fixed, each.frame);
      return each && place ? [{ each, place }] : [];
    });
    const lines = (is: "path" | "scan") =>
      drawn.flatMap(({ each, place }) => (each.is === is ? [each.points.map((point) => applied(place, point))] : []));
    const { pose, frame } = this.#trip.state.value;
    const on = (place: Transform, points: readonly Point[]) => points.map(({ x, y }) => applied(place, { x, y, z: 0 }));
    const markers = drawn.flatMap(({ each, place }) => (each.is === "markers" ? [{ each, place }] : []));
    this.#canvas.show({
      robot: this.#place.pose,
      isOld: this.#isOld(),
      trail: this.#trail.points,
      places: this.#shownPlaces(),
      grids: drawn
        .flatMap(({ each, place }) => (each.is === "grid" ? [{ grid: each.grid, isCost: each.isCost, place }] : []))
        .sort((one, other) => Number(one.isCost) - Number(other.isCost)), // costs lie over the map
      areas: markers.flatMap(({ each, place }) =>
        each.areas.map(({ corners, colour }) => ({ corners: on(place, corners), colour })),
      ),
      labels: markers.flatMap(({ each, place }) => each.labels.map(({ at, text }) => ({ text, ...applied(place, at) }))),
      outlines: drawn.flatMap(({ each, place }) =>
        each.is === "world" ? each.world.shapes.map((shape) => on(place, outlineOf(shape, each.world.epoch + this.#place.stamp))) : [],
      ),
      paths: lines("path"),
      scans: lines("scan"),
      goal: frame === this.#fixed ? pose : null,
    });
  }

  /** Returns whether places, which are poses in `map`, can be drawn. */
  #placesAreOnMap(): boolean {
    return this.#fixed === "map";
  }

  #shownPlaces(): ShownPlace[] {
    if (!this.#placesAreOnMap()) return [];
    if (!this.#editor) return this.#robot.config.places.map((place) => this.#shownPlace(place));
    return this.#editor.shown().map((place) => ({ ...place, isDock: this.#docks.has(place.name) }));
  }

  #shownPlace(place: Place) {
    const isDock = this.#docks.has(place.name);
    const name = formatName(place.name);
    const label = isDock && !/dock/i.test(name) ? `${name} (dock)` : name;
    return { ...place, label, isDock };
  }

  #tick(): void {
    const old = this.#isOld();
    for (const { place, note } of this.#places) {
      const from = !old && this.#placesAreOnMap() ? this.#place.pose : null;
      const away = from ? `, ${metres(distance(from, place))} away` : "";
      setText(note, `${this.#docks.has(place.name) ? "Dock: it charges here. " : ""}${numbersOf(place)}${away}`);
    }
    if (this.#place.pose) {
      const age = Number.isFinite(this.#place.seenAt) ? ` ${formatAge(performance.now() - this.#place.seenAt)} ago` : " before";
      setText(this.#where, `${old ? `Robot, as it was${age}` : "Robot"}: ${numbersOf(this.#place.pose)}, in ${this.#fixed}`);
    }
    this.#enable();
    this.#showHint();
    this.#draw();
  }

  #showHint(): void {
    const texts = [
      this.#measured,
      TOOLS[this.#tool][1],
      this.#failure,
      this.#place.pose ? "" : this.#robot.link.state.value.is === "open" ? UNKNOWN : OFFLINE,
      this.#placesAreOnMap() || !this.#places.length ? "" : NOT_IN_MAP,
    ];
    setText(this.#hint, texts.find(Boolean) ?? "");
  }

  #enable(): void {
    const isOpen = this.#robot.link.state.value.is === "open";
    const mayNot = whyNot(this.#robot.config, "operate") || (isOpen ? "" : "Not connected.");
    const mayNotGo = mayNot || (this.#robot.stopped.value ? "The robot is stopped." : "");
    for (const { go } of this.#places) {
      disable(mayNotGo, go);
      go.hidden = this.#navigator === null;
    }
    const [go, initial] = [this.#tools.get("go")!, this.#tools.get("initial")!];
    disable(mayNotGo, go);
    go.hidden = this.#navigator === null;
    disable(mayNot, initial);
    initial.hidden = !this.#hasLocaliser;
    const [byNumbers, set] = this.#numbers.querySelectorAll("button");
    disable(mayNotGo, byNumbers!);
    byNumbers!.hidden = this.#navigator === null;
    disable(mayNot, set!);
    set!.hidden = !this.#hasLocaliser;
    this.#numbers.parentElement!.hidden = this.#navigator === null && !this.#hasLocaliser;
    if (this.#tools.get(this.#tool)!.matches(":disabled, [hidden]")) this.#choose("move");
  }

  #showTrip(state: TripState): void {
    const isDriving = state.is === "driving";
    if (this.#state.dataset.is !== state.is || this.#state.textContent !== state.text) {
      this.#state.dataset.is = state.is;
      this.#state.replaceChildren(...(state.is === "none" ? [] : [icon(ICONS[state.is])]), h("span", {}, state.text));
    }
    this.#cancel.hidden = !isDriving;
    const left = state.left === null ? "" : `${metres(state.left)} to go`;
    const missing = this.#navigator || !this.#isDescribed ? "" : "This robot has no skill that drives to a pose.";
    this.#state.hidden = state.is === "none" && missing !== "";
    const mission = `Mission ${this.#driver} is running: a goal of yours replaces the one it drives to.`;
    setText(this.#note, isDriving ? left : missing || (this.#driver ? mission : ""));
    this.#draw();
  }

  // What people do

  #choose(tool: Tool): void {
    this.#tool = tool;
    if (tool === "places") this.#edit();
    this.#measured = "";
    this.#canvas.tool = tool;
    const ways = { move: "Drag or arrow keys move the view; ", places: "On the map, " }; // where arrow keys move a place
    setText(this.#keys, ((ways as Partial<Record<Tool, string>>)[tool] ?? "Arrow keys move the view; ") + KEYS);
    for (const [name, each] of this.#tools) each.setAttribute("aria-pressed", String(name === tool));
    this.#showHint();
  }

  /** Opens the editor of places in place of their list; it stays while the view is moved or something is measured. */
  #edit(): void {
    if (this.#editor) return;
    const stands = () => (this.#placesAreOnMap() ? this.#place.pose : null);
    this.#editor = new PlacesEditor(this.#robot, () => this.#draw(), () => this.#endEdit(), stands);
    this.#placesCard.hidden = true;
    this.#placesCard.before(this.#editor.element);
  }

  #endEdit(): void {
    this.#editor?.close();
    this.#editor?.element.remove();
    this.#editor = null;
    this.#placesCard.hidden = false;
    this.#choose("move");
    this.#tools.get("places")!.focus();
    this.#draw();
  }

  #dragged(drag: Drag): void {
    if (drag.tool === "measure") {
      this.#measured = metres(distance(drag.pose, drag.end));
      this.#showHint();
      return;
    }
    this.#choose("move"); // so that the next touch moves the view and not the robot
    if (drag.tool === "go") this.#go(drag.pose, nameOf(drag.pose), this.#fixed);
    if (drag.tool === "initial") this.#setInitial(drag.pose);
  }

  #go({ x, y, heading }: Pose, name: string, frame: string): void {
    if (!this.#navigator) return;
    const pose = { x, y, heading };
    const goal = { pose: { header: { frame_id: frame }, pose: poseMessage(pose) } };
    this.#trip.begin(this.#navigator.topic, this.#navigator.type, goal, { name, pose, frame });
  }

  #setInitial(pose: Pose): void {
    const maps = [...this.#drawn.values()].flatMap((each) => (each?.is === "grid" && !each.isCost ? [each.grid] : []));
    const isOnMap = (grid: Grid) => {
      const place = this.#place.frames.lookUp(grid.frame, this.#fixed);
      return !place || isOn(grid, applied(place, { ...pose, z: 0 }));
    };
    if (maps.length > 0 && !maps.some(isOnMap)) return this.#robot.notify(`${nameOf(pose)} is outside of the map: nothing was sent`);
    const covariance = Array.from({ length: 36 }, (_, turn) => SPREAD[turn] ?? 0);
    const message = { header: { frame_id: this.#fixed }, pose: { pose: poseMessage(pose), covariance } };
    const isSent = this.#robot.link.publish(INITIAL, message);
    this.#robot.notify(isSent ? `The robot was told that it is at ${nameOf(pose)}` : "Not connected: nothing was sent");
  }
}

function button(content: (Node | string)[], action: () => void, words = ""): HTMLButtonElement {
  const element = h("button", { type: "button" }, ...content);
  if (words) element.setAttribute("aria-label", words);
  element.onclick = action;
  return element;
}

function nameOf({ x, y }: Pose): string {
  return `(${formatNumber(x, "m")}, ${formatNumber(y, "m")})`;
}

function metres(length: number): string {
  return formatValue(length, "m");
}

function numbersOf({ x, y, heading }: Pose): string {
  const degrees = formatNumber(Math.round(heading * DEGREES) || 0, "%");
  return `x ${metres(x)}, y ${metres(y)}, heading ${degrees}°`;
}
