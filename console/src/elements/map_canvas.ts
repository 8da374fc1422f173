/** `<map-canvas>`: a map to look at, to move by fingers, wheel and keys, and to press poses into. */
import { h } from "../dom";
import {
  composed,
  distance,
  draggedPose,
  fitted,
  formatLength,
  costPixels,
  gridPixels,
  gridStep,
  niceLength,
  panned,
  poseOf,
  toScreen,
  toWorld,
  zoomed,
  type Colour,
  type Grid,
  type Point,
  type Pose,
  type Transform,
  type View,
} from "../map";

export interface ShownPlace extends Pose {
  name: string;
  label: string;
  colour: string;
  isDock: boolean;
  /** Whether it is being edited: it has a handle by which it is turned. */
  isChosen?: boolean;
}

/** A grid, and the transform from its frame to that of the map. */
export interface ShownGrid {
  grid: Grid;
  /** Whether it lies over maps and is seen through. */
  isCost: boolean;
  place: Transform;
}

/** What is on the map, all in its frame. */
export interface Scene {
  robot: Pose | null;
  /** Whether that is where the robot was, and perhaps is no more. */
  isOld: boolean;
  trail: readonly Point[];
  places: readonly ShownPlace[];
  grids: readonly ShownGrid[];
  /** Parts of the map, hatched. */
  areas: readonly { corners: readonly Point[]; colour: string }[];
  labels: readonly (Point & { text: string })[];
  /** Closed lines around what is only known since the world is simulated. */
  outlines: readonly (readonly Point[])[];
  paths: readonly (readonly Point[])[];
  scans: readonly (readonly Point[])[];
  goal: Pose | null;
}

/** What a drag does: it moves the view, or it is a pose or a distance. */
export type Tool = "move" | "go" | "initial" | "measure" | "places";

/** What a finished drag meant. */
export interface Drag {
  tool: Exclude<Tool, "move" | "places">;
  pose: Pose;
  end: Point;
}

/** What a finished drag means while places are edited; `pose` is where the place is then. */
export interface MapGesture {
  is: "add" | "move" | "turn" | "choose";
  name: string;
  pose: Pose;
}

const ZOOM = 1.3; // by a key or a button
const STEP = 60; // [px] by an arrow key
const ROBOT = 13; // [px] from the middle of the robot to its nose
const PLACE = 9; // [px] half the size of a place
const ARROW = 36; // [px]
const HANDLE = 52; // [px] from the middle of a place to what turns it
const REACH = 22; // [px] around what a finger takes hold of
const HATCH = 10; // [px] between two lines
const FONT = "13px system-ui, sans-serif";
const KEYS: Record<string, readonly [right: number, down: number]> = {
  ArrowLeft: [STEP, 0],
  ArrowRight: [-STEP, 0],
  ArrowUp: [0, STEP],
  ArrowDown: [0, -STEP],
};

export class MapCanvas extends HTMLElement {
  /** Called when a drag with a tool has ended. */
  onDrag: (drag: Drag) => void = () => undefined;
  /** Called when a drag has ended while places are edited. */
  onGesture: (gesture: MapGesture) => void = () => undefined;
  /** Called for keys while places are edited; returns whether they mean something there. */
  onPress: (event: KeyboardEvent) => boolean = () => false;

  #scene: Scene = {
    robot: null,
    isOld: false,
    trail: [],
    places: [],
    grids: [],
    areas: [],
    labels: [],
    outlines: [],
    paths: [],
    scans: [],
    goal: null,
  };
  #view: View = fitted([], 1, 1);
  #isMovedByHand = false;
  #tool: Tool = "move";
  readonly #pointers = new Map<number, Point>();
  #drag: { pointer: number; from: Point; to: Point; held: Held | null } | null = null;
  #measured: { from: Point; to: Point } | null = null;
  #frame = 0;
  readonly #canvas = h("canvas", {
    tabindex: "0",
    role: "application",
    "aria-label": "Map",
    "aria-describedby": "map-keys",
  });
  readonly #resized = new ResizeObserver(() => this.#resize());
  readonly #scheme = matchMedia("(prefers-color-scheme: dark)");
  #pictures = new WeakMap<Grid, HTMLCanvasElement>();
  readonly #redraw = () => {
    this.#pictures = new WeakMap();
    this.#schedule();
  };

  constructor() {
    super();
    const canvas = this.#canvas;
    canvas.onpointerdown = (event) => this.#down(event);
    canvas.onpointermove = (event) => this.#move(event);
    canvas.onpointerup = (event) => this.#up(event, true);
    canvas.onpointercancel = (event) => this.#up(event, false);
    canvas.oncontextmenu = (event) => event.preventDefault();
    canvas.onkeydown = (event) => this.#key(event);
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? event.deltaY * 30 : event.deltaY;
        this.zoom(1.0015 ** -lines, { x: event.offsetX, y: event.offsetY });
      },
      { passive: false },
    );
  }

  connectedCallback(): void {
    this.append(this.#canvas);
    this.#resized.observe(this);
    this.#scheme.addEventListener("change", this.#redraw);
  }

  disconnectedCallback(): void {
    this.#resized.disconnect();
    this.#scheme.removeEventListener("change", this.#redraw);
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
  }

  show(scene: Scene): void {
    const { goal } = this.#scene; // the view has room for it, which is wanted no longer once it has gone
    this.#scene = scene;
    if (!this.#isMovedByHand && this.#pointers.size === 0) this.#fit(goal !== null && goal !== scene.goal);
    this.#draw();
  }

  /** What a drag does from now on. */
  set tool(tool: Tool) {
    this.#tool = tool;
    this.dataset.tool = tool;
    if (this.#drag) this.#pointers.clear(); // what is held down has lost its meaning
    this.#drag = null;
    if (tool !== "measure") this.#measured = null;
    this.#schedule();
  }

  /** Shows everything, and follows what comes until the view is moved. */
  fit(): void {
    this.#isMovedByHand = false;
    this.#fit(true);
    this.#schedule();
  }

  /** Zooms around a pixel, or the middle. */
  zoom(factor: number, at: Point = { x: this.#view.width / 2, y: this.#view.height / 2 }): void {
    this.#look(zoomed(this.#view, factor, at));
  }

  #look(view: View): void {
    this.#isMovedByHand = true;
    this.#view = view;
    this.#schedule();
  }

  #fit(isNew: boolean): void {
    const { robot, places, grids, paths, goal } = this.#scene;
    const points: Point[] = [...places, ...paths.flat()];
    if (robot) points.push(robot);
    if (goal) points.push(goal);
    for (const { grid, place } of grids) {
      const corner = composed(place, grid.origin);
      for (const x of [0, grid.width * grid.resolution]) {
        for (const y of [0, grid.height * grid.resolution]) {
          const at = { translation: { x, y, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } };
          points.push(poseOf(composed(corner, at)));
        }
      }
    }
    // A robot that drives within the view does not move it.
    if (isNew || !this.#shows(points)) this.#view = fitted(points, this.#view.width, this.#view.height);
  }

  #shows(points: readonly Point[]): boolean {
    const { width, height } = this.#view;
    return points.every((point) => {
      const { x, y } = toScreen(this.#view, point);
      return x >= 16 && y >= 16 && x <= width - 16 && y <= height - 16;
    });
  }

  // Pointers and keys

  #down(event: PointerEvent): void {
    this.#canvas.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    if (this.#pointers.size > 1) {
      this.#drag = null; // a second finger: the view is meant
    } else if (this.#tool !== "move" && event.button === 0) {
      const at = { x: event.offsetX, y: event.offsetY };
      const held = this.#tool === "places" ? heldAt(this.#view, this.#scene.places, at) : null;
      this.#drag = { pointer: event.pointerId, from: at, to: at, held };
      this.#measure();
    }
    this.#schedule();
  }

  #move(event: PointerEvent): void {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    const now = { x: event.offsetX, y: event.offsetY };
    const others = [...this.#pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    this.#pointers.set(event.pointerId, now);
    const [other] = others;
    if (this.#drag?.pointer === event.pointerId) {
      this.#drag.to = now;
      this.#measure();
      this.#schedule();
    } else if (other) {
      const middle = (at: Point) => ({ x: (at.x + other.x) / 2, y: (at.y + other.y) / 2 });
      const [from, to] = [middle(before), middle(now)];
      const moved = panned(this.#view, to.x - from.x, to.y - from.y);
      this.#look(zoomed(moved, Math.max(1, distance(now, other)) / Math.max(1, distance(before, other)), to));
    } else {
      this.#look(panned(this.#view, now.x - before.x, now.y - before.y));
    }
  }

  #up(event: PointerEvent, isMeant: boolean): void {
    this.#pointers.delete(event.pointerId);
    const drag = this.#drag;
    if (drag?.pointer !== event.pointerId) return;
    this.#drag = null;
    this.#schedule();
    if (this.#tool === "move" || !isMeant) return;
    if (this.#tool === "places") this.onGesture(this.#gesture(drag));
    else this.onDrag({ tool: this.#tool, pose: this.#posed(drag), end: toWorld(this.#view, drag.to) });
  }

  /** Returns the pose of a drag; a tap looks away from the robot, which comes from there. */
  #posed({ from, to }: { from: Point; to: Point }): Pose {
    const { robot } = this.#scene;
    const at = toWorld(this.#view, from);
    const ahead = robot ? Math.atan2(at.y - robot.y, at.x - robot.x) : 0;
    const otherwise = { initial: robot?.heading ?? 0, places: 0 }[this.#tool as string] ?? ahead;
    return draggedPose(this.#view, from, to, otherwise);
  }

  /** Returns what a drag means: a place is moved or turned by its hold, and made where there is none. */
  #gesture({ from, to, held }: { from: Point; to: Point; held: Held | null }): MapGesture {
    if (!held) return { is: "add", name: "", pose: draggedPose(this.#view, from, to, 0) };
    const { place, is } = held;
    if (distance(from, to) < STILL) return { is: "choose", name: place.name, pose: place };
    return { is, name: place.name, pose: heldPose(this.#view, held, from, to) };
  }

  #measure(): void {
    if (this.#tool !== "measure" || !this.#drag) return;
    this.#measured = { from: toWorld(this.#view, this.#drag.from), to: toWorld(this.#view, this.#drag.to) };
  }

  #key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = KEYS[event.key];
    if (this.#tool === "places" && this.onPress(event)) event.stopPropagation();
    else if (step) this.#look(panned(this.#view, ...step));
    else if (event.key === "+" || event.key === "=") this.zoom(ZOOM);
    else if (event.key === "-") this.zoom(1 / ZOOM);
    else if (event.key === "0" || event.key === "Home") this.fit();
    else return;
    event.preventDefault();
  }

  // Drawing

  #resize(): void {
    const { width, height } = this.getBoundingClientRect();
    if (width === 0 || height === 0) return;
    const ratio = devicePixelRatio;
    this.#canvas.width = Math.round(width * ratio);
    this.#canvas.height = Math.round(height * ratio);
    this.#view = { ...this.#view, width, height };
    if (!this.#isMovedByHand) this.#fit(true);
    this.#draw();
  }

  #schedule(): void {
    this.#frame ||= requestAnimationFrame(() => {
      this.#frame = 0;
      this.#draw();
    });
  }

  #draw(): void {
    const context = this.#canvas.getContext("2d");
    if (!context) return;
    const ratio = this.#canvas.width / this.#view.width;
    const styles = getComputedStyle(this);
    const colour = (name: string) => styles.getPropertyValue(`--${name}`).trim();
    const pen = new Pen(context, this.#view, ratio, colour);
    const scene = this.#scene;
    pen.clear();
    for (const each of scene.grids) pen.grid(each, this.#pictureOf(each, colour));
    pen.lines();
    for (const { corners, colour } of scene.areas) pen.hatch(corners, colour);
    for (const outline of scene.outlines) pen.stroke([...outline, outline[0]!], "faint", 1);
    pen.stroke(scene.trail, "faint", 2, [2, 4]);
    for (const path of scene.paths) pen.stroke(path, "good", 3);
    for (const scan of scene.scans) pen.dots(scan);
    const places = scene.places.map((place) => this.#asHeld(place));
    for (const place of places) pen.place(place);
    if (scene.goal) pen.arrow(scene.goal, "good", [6, 4]);
    if (scene.robot) pen.robot(scene.robot, scene.isOld);
    for (const { label, ...at } of places) pen.label(at, label, 2.6 * PLACE);
    for (const { text, ...at } of scene.labels) pen.label(at, text, 0);
    if (this.#measured) pen.measure(this.#measured.from, this.#measured.to);
    if (this.#drag && this.#tool !== "measure" && !this.#drag.held) pen.arrow(this.#posed(this.#drag), "good");
    pen.scaleBar();
  }

  /** Returns a place as it is while it is dragged. */
  #asHeld(place: ShownPlace): ShownPlace {
    const held = this.#drag?.held;
    if (!this.#drag || held?.place.name !== place.name) return place;
    return { ...place, ...heldPose(this.#view, held, this.#drag.from, this.#drag.to) };
  }

  #pictureOf({ grid, isCost }: ShownGrid, colour: (name: string) => string): HTMLCanvasElement {
    let picture = this.#pictures.get(grid);
    if (!picture) {
      picture = h("canvas", { width: String(grid.width), height: String(grid.height) });
      const context = picture.getContext("2d")!;
      const pixels = isCost
        ? costPixels(grid, partsOf(context, colour("cost")))
        : gridPixels(grid, partsOf(context, colour("free")), partsOf(context, colour("occupied")));
      context.putImageData(new ImageData(pixels, grid.width, grid.height), 0, 0);
      this.#pictures.set(grid, picture);
    }
    return picture;
  }
}

/** A place that is held by a drag, at itself or at the handle that turns it. */
interface Held {
  place: ShownPlace;
  is: "move" | "turn";
}

const STILL = 6; // [px] that a hand moves without meaning it

/** Returns what is held at a pixel: the handle of the chosen place goes before places, and the nearest place before others. */
function heldAt(view: View, places: readonly ShownPlace[], at: Point): Held | null {
  const chosen = places.find(({ isChosen }) => isChosen);
  if (chosen && distance(handleOf(view, chosen), at) <= REACH) return { place: chosen, is: "turn" };
  const away = (place: ShownPlace) => distance(toScreen(view, place), at);
  const [nearest] = [...places].sort((one, other) => away(one) - away(other));
  return nearest && away(nearest) <= REACH ? { place: nearest, is: "move" } : null;
}

function handleOf(view: View, { heading, ...at }: Pose): Point {
  const { x, y } = toScreen(view, at);
  return { x: x + HANDLE * Math.cos(heading), y: y - HANDLE * Math.sin(heading) };
}

/** Returns where a place is while it is dragged. */
function heldPose(view: View, { place, is }: Held, from: Point, to: Point): Pose {
  const at = toScreen(view, place);
  const pose = { x: place.x, y: place.y, heading: place.heading };
  if (is === "turn") return { ...pose, heading: Math.atan2(at.y - to.y, to.x - at.x) };
  return { ...pose, ...toWorld(view, { x: at.x + to.x - from.x, y: at.y + to.y - from.y }) };
}

/** Returns the parts of a colour, however it is written: a context knows them all. */
function partsOf(context: CanvasRenderingContext2D, colour: string): Colour {
  context.fillStyle = colour;
  const [red, green, blue] = [1, 3, 5].map((at) => parseInt(String(context.fillStyle).slice(at, at + 2), 16));
  return [red!, green!, blue!];
}

/** Draws on a canvas what is at points of the map. */
class Pen {
  readonly #context: CanvasRenderingContext2D;
  readonly #view: View;
  readonly #ratio: number;
  readonly #colour: (name: string) => string;

  constructor(
    context: CanvasRenderingContext2D,
    view: View,
    ratio: number,
    colour: (name: string) => string,
  ) {
    this.#context = context;
    this.#view = view;
    this.#ratio = ratio;
    this.#colour = colour;
    context.font = FONT;
    context.lineCap = "round";
    context.lineJoin = "round";
  }

  clear(): void {
    this.#context.setTransform(this.#ratio, 0, 0, this.#ratio, 0, 0);
    this.#context.clearRect(0, 0, this.#view.width, this.#view.height);
  }

  /** Begins to draw in pixels around a point of the map, with x along a heading. */
  #at({ x, y }: Point, heading = 0): CanvasRenderingContext2D {
    const at = toScreen(this.#view, { x, y });
    const [cos, sin] = [Math.cos(heading) * this.#ratio, Math.sin(heading) * this.#ratio];
    this.#context.setTransform(cos, -sin, sin, cos, at.x * this.#ratio, at.y * this.#ratio);
    this.#context.setLineDash([]);
    this.#context.beginPath();
    return this.#context;
  }

  #onScreen(): CanvasRenderingContext2D {
    this.#context.setTransform(this.#ratio, 0, 0, this.#ratio, 0, 0);
    this.#context.setLineDash([]);
    this.#context.beginPath();
    return this.#context;
  }

  grid({ grid, place }: ShownGrid, picture: HTMLCanvasElement): void {
    const origin = poseOf(composed(place, grid.origin));
    const context = this.#at(origin, origin.heading);
    const cell = grid.resolution * this.#view.scale;
    context.imageSmoothingEnabled = false;
    context.drawImage(picture, 0, -grid.height * cell, grid.width * cell, grid.height * cell);
  }

  lines(): void {
    const { width, height, scale } = this.#view;
    const step = gridStep(scale);
    const [from, to] = [toWorld(this.#view, { x: 0, y: height }), toWorld(this.#view, { x: width, y: 0 })];
    const context = this.#onScreen();
    for (let x = Math.ceil(from.x / step); x <= to.x / step; x += 1) {
      const at = toScreen(this.#view, { x: x * step, y: 0 }).x;
      context.moveTo(at, 0);
      context.lineTo(at, height);
    }
    for (let y = Math.ceil(from.y / step); y <= to.y / step; y += 1) {
      const at = toScreen(this.#view, { x: 0, y: y * step }).y;
      context.moveTo(0, at);
      context.lineTo(width, at);
    }
    context.strokeStyle = this.#colour("edge");
    context.lineWidth = 1;
    context.stroke();
  }

  stroke(points: readonly Point[], name: string, width: number, dash: number[] = []): void {
    const context = this.#onScreen();
    for (const point of points) {
      const { x, y } = toScreen(this.#view, point);
      context.lineTo(x, y);
    }
    context.setLineDash(dash);
    context.strokeStyle = this.#colour(name);
    context.lineWidth = width;
    context.stroke();
  }

  /** Fills an area with diagonal lines that stay where they are on the map. */
  hatch(corners: readonly Point[], colour: string): void {
    const context = this.#onScreen();
    const points = corners.map((corner) => toScreen(this.#view, corner));
    for (const { x, y } of points) context.lineTo(x, y);
    context.closePath();
    context.strokeStyle = colour;
    context.lineWidth = 2;
    context.stroke();
    context.save();
    context.clip();
    context.beginPath();
    const start = toScreen(this.#view, { x: 0, y: 0 });
    const { width, height } = this.#view;
    for (let x = ((start.x + start.y) % HATCH) - HATCH; x <= width + height; x += HATCH) {
      context.moveTo(x, 0);
      context.lineTo(x - height, height);
    }
    context.lineWidth = 1.5;
    context.stroke();
    context.restore();
  }

  dots(points: readonly Point[]): void {
    const context = this.#onScreen();
    context.fillStyle = this.#colour("bad");
    for (const point of points) {
      const { x, y } = toScreen(this.#view, point);
      context.fillRect(x - 1.5, y - 1.5, 3, 3);
    }
  }

  /** A place is a square, the dock a ring; a line shows the heading. One that is chosen has a handle to turn it by. */
  place({ colour, isDock, isChosen, ...pose }: ShownPlace): void {
    if (isChosen) this.handle(pose);
    const context = this.#at(pose, pose.heading);
    context.lineWidth = 2;
    context.strokeStyle = this.#colour("ink");
    context.fillStyle = this.#colour("accent");
    context.fillStyle = colour; // ignored if it is none
    if (isDock) context.arc(0, 0, 1.4 * PLACE, 0, 2 * Math.PI);
    else context.rect(-PLACE, -PLACE, 2 * PLACE, 2 * PLACE);
    context.fill();
    context.stroke();
    if (isDock) {
      context.beginPath();
      context.arc(0, 0, 0.7 * PLACE, 0, 2 * Math.PI);
      context.fillStyle = this.#colour("card");
      context.fill();
      context.stroke();
    }
    context.beginPath();
    context.moveTo(isDock ? 1.4 * PLACE : PLACE, 0);
    context.lineTo(2.6 * PLACE, 0);
    context.stroke();
  }

  handle(pose: Pose): void {
    const context = this.#at(pose, pose.heading);
    context.lineWidth = 2;
    context.strokeStyle = this.#colour("accent");
    context.fillStyle = this.#colour("card");
    context.moveTo(0, 0);
    context.lineTo(HANDLE, 0);
    context.stroke();
    context.beginPath();
    context.arc(HANDLE, 0, 8, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
    context.beginPath();
    context.setLineDash([4, 4]);
    context.arc(0, 0, REACH, 0, 2 * Math.PI);
    context.stroke();
  }

  label(at: Point, text: string, below: number): void {
    const context = this.#at(at);
    context.textAlign = "center";
    context.textBaseline = "top";
    context.lineWidth = 4;
    context.strokeStyle = this.#colour("card");
    context.strokeText(text, 0, below);
    context.fillStyle = this.#colour("ink");
    context.fillText(text, 0, below);
  }

  /** The robot is a filled triangle; a hollow one is where it was. */
  robot(pose: Pose, isOld: boolean): void {
    const context = this.#at(pose, pose.heading);
    const size = Math.max(ROBOT, 0.12 * this.#view.scale);
    context.moveTo(size, 0);
    context.lineTo(-0.8 * size, 0.75 * size);
    context.lineTo(-0.45 * size, 0);
    context.lineTo(-0.8 * size, -0.75 * size);
    context.closePath();
    context.lineWidth = 5;
    context.strokeStyle = this.#colour("card");
    context.stroke();
    context.lineWidth = 2;
    context.fillStyle = this.#colour(isOld ? "card" : "accent");
    context.fill();
    context.strokeStyle = this.#colour(isOld ? "faint" : "accent");
    context.stroke();
  }

  arrow(pose: Pose, name: string, dash: number[] = []): void {
    const context = this.#at(pose, pose.heading);
    const ring = new Path2D();
    ring.arc(0, 0, 0.5 * ARROW, 0, 2 * Math.PI);
    const shaft = new Path2D();
    shaft.moveTo(0, 0);
    shaft.lineTo(ARROW, 0);
    shaft.moveTo(0.7 * ARROW, -0.25 * ARROW);
    shaft.lineTo(ARROW, 0);
    shaft.lineTo(0.7 * ARROW, 0.25 * ARROW);
    for (const [colour, width] of [["card", 7], [name, 3]] as const) {
      context.strokeStyle = this.#colour(colour);
      context.lineWidth = width;
      context.setLineDash(dash);
      context.stroke(ring);
      context.setLineDash([]);
      context.stroke(shaft);
    }
  }

  measure(from: Point, to: Point): void {
    this.stroke([from, to], "ink", 2);
    const middle = { x: (from.x + to.x) / 2, y: (from.y + to.y) / 2 };
    this.label(middle, `${distance(from, to).toFixed(2)}\u202fm`, 6);
  }

  scaleBar(): void {
    const { height, scale } = this.#view;
    const length = niceLength(scale, 120);
    const context = this.#onScreen();
    const [left, bottom] = [12.5, height - 12.5];
    context.moveTo(left, bottom - 6);
    context.lineTo(left, bottom);
    context.lineTo(left + length * scale, bottom);
    context.lineTo(left + length * scale, bottom - 6);
    context.strokeStyle = this.#colour("ink");
    context.lineWidth = 1.5;
    context.stroke();
    context.textAlign = "left";
    context.textBaseline = "bottom";
    context.lineWidth = 4;
    context.strokeStyle = this.#colour("card");
    context.strokeText(formatLength(length), left + 6, bottom - 6);
    context.fillStyle = this.#colour("ink");
    context.fillText(formatLength(length), left + 6, bottom - 6);
  }
}

customElements.define("map-canvas", MapCanvas);
