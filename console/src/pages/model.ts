/** Model: the robot in 3D, its joints by sliders, its links, and goals for arms by dragging their tips. */
import { watchComponents, type Component } from "../description";
import { whyNot } from "../config";
import { disable, emptyCard, h, icon, setText } from "../dom";
import type { RobotScene, Pose, View } from "../elements/robot_scene";
import { formatName, numberIn } from "../format";
import { runningGoal, sendGoal, type KeptGoal } from "../goals";
import { armsOf, centred, JointDrive, moversOf, onWay, planOf, positionsOf, randomized, reason, sliderOf, thingsOf, wayOf, type Arm, type JointSlider, type Waypoint } from "../model";
import type { Page, Robot } from "../page";
import { PartsEditor } from "../parts_editor";
import { tidy } from "../parameters";
import { isMessage, type Json, type Message } from "../rosbridge";
import { quaternionOf } from "../forms";
import { Surroundings } from "../surroundings";
import "./model.css";

const LOOK = 50; // [ms] between two positions of joints
const SOLVED = 1; // moveit_msgs/MoveItErrorCodes
const MOVING = "Moving\u2026";
const FINISHED = 4; // action_msgs/GoalStatus
const STOPPED = "The robot is stopped.";
const NOT_CONNECTED = "The robot's model cannot be loaded: not connected.";

export const page: Page = {
  name: "model",
  title: "Model",
  order: 25,
  open(host, robot) {
    const box = h("div", {}, emptyCard("wait", "Loading the body\u2026"));
    host.append(box);
    let view: ModelView | null = null;
    let turn = 0; // of the attempt to load whose outcome counts
    const attempt = async () => {
      const own = (turn += 1);
      box.replaceChildren(emptyCard("wait", "Loading the body\u2026"));
      try {
        const made = await load(robot);
        if (own !== turn) return made.close();
        view = made;
        box.replaceChildren(made.element);
      } catch (error) {
        if (own === turn) box.replaceChildren(emptyCard("warning", (error as Error).message));
      }
    };
    const unwatch = robot.link.state.watch(({ is }) => {
      if (view) return;
      if (is === "open") void attempt();
      else if (is === "lost") box.replaceChildren(emptyCard("warning", NOT_CONNECTED));
    });
    return () => {
      turn += 1;
      unwatch();
      view?.close();
    };
  },
};

async function load(robot: Robot): Promise<ModelView> {
  const fail = () => {
    throw new Error(NOT_CONNECTED);
  };
  const response = await fetch("console/model.urdf").catch(fail);
  if (response.status === 404) throw new Error("This robot has no body. It is described by `body:` in its manifest.");
  if (!response.ok) throw new Error(`The robot's model cannot be loaded (${response.status}).`);
  const urdf = await response.text().catch(fail);
  const { RobotScene } = await import("../elements/robot_scene").catch(fail);
  return new ModelView(robot, new RobotScene(), urdf);
}

class ModelView {
  readonly element = h("div", { class: "model" });
  readonly #robot: Robot;
  readonly #scene: RobotScene;
  readonly #sliders: JointSlider[];
  readonly #rows = new Map<string, JointRow>();
  readonly #moves = h("input", { id: "moves", type: "checkbox" });
  readonly #says = h("p", { class: "says", role: "status" });
  readonly #missing = h("p", { class: "label", role: "status" });
  readonly #arms = h("div", { class: "model-arms" });
  readonly #parts = h("div", { class: "model-parts" });
  #editor: PartsEditor | null = null;
  readonly #surroundings: Surroundings;
  readonly #closers: (() => void)[] = [];
  #drives = new Map<string, JointDrive>(); // by the joints that they move
  readonly #failures = new Map<JointDrive, string>();
  #described = "";
  #known: Arm[] = [];
  #wanted: Record<string, number> = {};
  #dragged: ArmGoal | null = null;

  constructor(robot: Robot, scene: RobotScene, urdf: string) {
    this.#robot = robot;
    this.#scene = scene;
    this.#sliders = scene.load(urdf, () => this.#showMissing()).map(sliderOf);
    this.#surroundings = new Surroundings(robot.link, scene);
    const stage = h("section", { class: "card stage", "aria-label": "The robot in 3D" }, scene.element, this.#views(), this.#missing);
    this.element.append(stage, h("div", { class: "model-side" }, this.#parts, this.#arms, this.#joints(), this.#links()));
    if (robot.config.role === "configure") this.#offerParts();
    this.#closers.push(
      robot.stopped.watch((isStopped) => {
        if (!isStopped) this.#failures.clear();
        this.#enable();
      }),
      watchComponents(robot.link, (components) => this.#learn(components)),
      robot.link.subscribe("/joint_states", (state) => this.#moved(state), { type: "sensor_msgs/msg/JointState", throttle: LOOK }),
      robot.link.subscribe("/scene", (message) => scene.setThings(thingsOf(message)), { type: "rbxcompose_msgs/msg/SceneObjects" }),
    );
    this.#showMissing();
  }

  close(): void {
    this.#editor?.close();
    this.#dragged?.close();
    this.#surroundings.close();
    this.#closers.forEach((close) => close());
    this.#scene.close();
  }

  // Parts

  #offerParts(): HTMLButtonElement {
    const edit = h("button", { type: "button" }, icon("edit"), "Edit parts");
    edit.onclick = () => {
      this.#dragged?.close(); // there is one handle
      this.#dragged = null;
      this.#arms.hidden = true;
      this.#editor = new PartsEditor(this.#robot, this.#scene, () => this.#showMissing(), () => this.#endParts());
      this.#parts.replaceChildren(this.#editor.element);
    };
    this.#parts.replaceChildren(edit);
    return edit;
  }

  #endParts(): void {
    this.#editor?.close();
    this.#editor = null;
    this.#arms.hidden = false;
    this.#showArms();
    this.#offerParts().focus();
  }

  #showMissing(): void {
    const { missing, drawn } = this.#scene;
    this.#scene.element.dataset.drawn = String(drawn);
    setText(this.#missing, missing.length > 0 ? `Not shown, since they cannot be read: ${missing.map((path) => decodeURIComponent(path.split("/").pop()!)).join(", ")}` : "");
  }

  #views(): HTMLElement {
    const button = (text: string, press: () => void, label = text) => {
      const made = h("button", { type: "button", "aria-label": label }, text);
      made.onclick = press;
      return made;
    };
    const views = (["Corner", "Front", "Side", "Top"] as View[]).map((view) => button(view, () => this.#scene.look(view)));
    const zooms = [button("+", () => this.#scene.zoom(1.25), "Closer"), button("\u2212", () => this.#scene.zoom(0.8), "Further away")];
    return h("div", { class: "row views" }, ...views, ...zooms, this.#surroundings.element);
  }

  #learn(components: Component[]): void {
    const described = JSON.stringify(components);
    if (described === this.#described || components.length === 0) return;
    this.#described = described;
    this.#drives.clear();
    this.#failures.clear();
    for (const mover of moversOf(components).reverse()) { // the first that moves a joint counts
      const drive = new JointDrive(this.#robot.link, mover, (joints, why) => this.#ended(drive, joints, why));
      for (const name of mover.names.keys()) this.#drives.set(name, drive);
    }
    this.#enable();
    this.#known = armsOf(components);
    this.#showArms();
    this.#surroundings.learn(components);
  }

  #showArms(): void {
    this.#arms.replaceChildren(...this.#known.map((arm) => this.#armCard(arm)));
  }

  #moved(state: Message): void {
    const positions = positionsOf(state);
    this.#scene.setJoints(positions);
    for (const [name, row] of this.#rows) row.measured(positions[name]);
    this.#scene.element.dataset.joints = JSON.stringify(positions);
  }

  // Joints

  #joints(): HTMLElement {
    if (this.#sliders.length === 0) return h("section", { class: "card" }, h("h2", {}, "Joints"), h("p", { class: "label" }, "No joint of this body can be moved."));
    const rows = this.#sliders.map((slider) => {
      const row = new JointRow(slider, (value) => this.#want({ [slider.name]: value }));
      this.#rows.set(slider.name, row);
      return row.element;
    });
    const button = (text: string, positions: () => Record<string, number>) => {
      const made = h("button", { type: "button" }, text);
      made.onclick = () => this.#want(positions());
      return made;
    };
    const hide = h("button", { type: "button" }, "Hide the ghost");
    hide.onclick = () => this.#forget();
    this.#moves.onchange = () => this.#forget();
    const moves = h("div", { class: "field check" }, this.#moves, h("label", { for: "moves" }, "Move the joints of the robot"));
    const buttons = h("div", { class: "row" }, button("Centre", () => centred(this.#sliders)), button("Randomize", () => randomized(this.#sliders)), hide);
    return h("section", { class: "card", "aria-label": "Joints" }, h("h2", {}, "Joints"), moves, buttons, this.#says, ...rows);
  }

  /** Shows wanted positions [rad, m]: by the ghost, or if joints are moved, by the robot itself. */
  #want(positions: Record<string, number>): void {
    const may = Object.entries(positions).filter(([name]) => !this.#rows.get(name)?.isDisabled);
    for (const [name, value] of may) this.#rows.get(name)?.want(value);
    if (this.#moves.checked) {
      for (const drive of new Set(may.map(([name]) => this.#drives.get(name)!))) {
        this.#failures.delete(drive);
        drive.move(Object.fromEntries(may.filter(([name]) => this.#drives.get(name) === drive)));
      }
      return this.#say();
    }
    this.#wanted = { ...this.#wanted, ...positions };
    this.#ghost(this.#wanted);
  }

  #ghost(positions: Record<string, number> | null): void {
    this.#scene.setGhost(positions);
    this.#scene.element.dataset.ghost = positions ? JSON.stringify(positions) : "";
  }

  #forget(): void {
    this.#wanted = {};
    this.#ghost(null);
    for (const row of this.#rows.values()) row.follow();
    this.#failures.clear();
    this.#enable();
  }

  /** Takes how the newest goal of joints has ended: their sliders follow the robot again. */
  #ended(drive: JointDrive, joints: string[], why: string): void {
    for (const name of joints) this.#rows.get(name)?.follow();
    if (why) this.#failures.set(drive, `${joints.map(nameOf).join(", ")} stopped: ${why}.`);
    this.#say();
  }

  /** Lets sliders that would move the robot be moved only where they can. */
  #enable(): void {
    disable(whyNot(this.#robot.config, "operate") || (this.#drives.size > 0 ? "" : "Nothing of the robot moves joints by goals."), this.#moves);
    const stop = this.#robot.stopped.value ? STOPPED : "";
    for (const [name, row] of this.#rows) {
      const why = stop || (this.#drives.has(name) ? "" : `Nothing of the robot moves ${nameOf(name).toLowerCase()} by a goal.`);
      row.disable(this.#moves.checked ? why : "");
    }
    this.#say();
  }

  #say(): void {
    const stop = this.#moves.checked && this.#robot.stopped.value ? [STOPPED] : [];
    setText(this.#says, [...stop, ...this.#failures.values()].join(" "));
  }

  // Links

  #links(): HTMLElement {
    const all = h("input", { id: "all-axes", type: "checkbox" });
    const boxes: HTMLInputElement[] = [];
    const seen = new Set(this.#scene.links);
    const rows = this.#scene.frames.map((name) => {
      const axes = h("input", { type: "checkbox", "aria-label": `Axes of ${name}` });
      axes.onchange = () => this.#scene.setAxes(name, axes.checked);
      boxes.push(axes);
      const alpha = h("input", { type: "range", min: "0", max: "100", step: "5", value: "100", "aria-label": `Opacity of ${name}` });
      alpha.style.setProperty("--share", "1");
      alpha.oninput = () => {
        alpha.style.setProperty("--share", String(Number(alpha.value) / 100));
        this.#scene.setAlpha(name, Number(alpha.value) / 100);
      };
      return h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, axes), h("td", {}, ...(seen.has(name) ? [alpha] : [])));
    });
    all.onchange = () => {
      for (const box of boxes) {
        box.checked = all.checked;
        box.dispatchEvent(new Event("change"));
      }
    };
    const head = h("thead", {}, h("tr", {}, ...["Link", "Axes", "Opacity"].map((title) => h("th", { scope: "col" }, title))));
    const check = h("div", { class: "field check" }, all, h("label", { for: "all-axes" }, "All axes: x red, y green, z blue"));
    const table = h("div", { class: "wide" }, h("table", {}, head, h("tbody", {}, ...rows)));
    return h("details", { class: "card links" }, h("summary", {}, `Links (${rows.length})`), check, table);
  }

  // Arms

  #armCard(arm: Arm): HTMLElement {
    const card = h("section", { class: "card", "aria-label": formatName(arm.name) }, h("h2", {}, formatName(arm.name)));
    const goal = new ArmGoal(this.#robot, this.#scene, arm, (positions) => this.#ghost(positions));
    const start = h("button", { type: "button" }, "Drag its tip");
    start.onclick = () => {
      if (this.#dragged === goal) {
        goal.close();
        this.#dragged = null;
      } else {
        this.#dragged?.close();
        this.#dragged = goal;
        this.#forget();
        void goal.open();
      }
      setText(start, this.#dragged === goal ? "Let go of its tip" : "Drag its tip");
    };
    card.append(start, goal.element);
    return card;
  }
}

/** A goal for an arm: dragged, planned and shown as a ghost, then executed. */
class ArmGoal {
  readonly element = h("div", { class: "arm-goal" });
  readonly #tools = h("div", { class: "arm-goal", hidden: "" });
  readonly #robot: Robot;
  readonly #scene: RobotScene;
  readonly #arm: Arm;
  readonly #ghost: (positions: Record<string, number> | null) => void;
  readonly #says = h("p", { class: "says", role: "status" });
  readonly #execute = h("button", { type: "button" }, icon("play"), "Execute");
  readonly #cancel = h("button", { type: "button", hidden: "" }, icon("cross"), "Cancel");
  readonly #poses: HTMLInputElement[];
  #plan: Json = null;
  #way: Waypoint[] = [];
  #frame = 0;
  #running: KeptGoal | undefined;
  #turn = 0;

  constructor(robot: Robot, scene: RobotScene, arm: Arm, ghost: (positions: Record<string, number> | null) => void) {
    [this.#robot, this.#scene, this.#arm, this.#ghost] = [robot, scene, arm, ghost];
    const modes = (["translate", "rotate"] as const).map((mode) => {
      const button = h("button", { type: "button" }, mode === "translate" ? "Move" : "Turn");
      button.onclick = () => scene.setHandleMode(mode);
      return button;
    });
    this.#execute.onclick = () => void this.#go();
    this.#cancel.onclick = () => this.#running?.cancel();
    this.#execute.disabled = true;
    const fields = ["x", "y", "z", "roll", "pitch", "yaw"].map((name, at) => {
      const input = h("input", { id: `tip-${arm.name}-${name}`, inputmode: "decimal", autocomplete: "off" });
      const unit = at < 3 ? "cm" : "\u00b0";
      return { input, element: h("div", { class: "field" }, h("label", { for: input.id }, `${formatName(name)} `, h("span", { class: "label" }, unit)), input) };
    });
    this.#poses = fields.map(({ input }) => input);
    const plan = h("button", {}, "Plan");
    const form = h("form", { class: "tip-form" }, ...fields.map(({ element }) => element), plan);
    form.onsubmit = (event) => {
      event.preventDefault();
      const values = this.#poses.map((input, at) => numberIn(input.value) * (at < 3 ? 0.01 : Math.PI / 180));
      if (values.some((value) => !Number.isFinite(value))) return this.#say("Each of the six must be a number.", "bad");
      const [x, y, z, roll, pitch, yaw] = values as [number, number, number, number, number, number];
      const pose = { x, y, z, roll, pitch, yaw };
      scene.setHandle(pose);
      void this.#planTo(pose);
    };
    const words = h("p", { class: "label" }, "Drag the arrows at the tip, or write where it is to be. The plan is shown as a ghost.");
    this.#tools.append(h("div", { class: "row" }, ...modes, this.#execute), words, form);
    this.element.append(this.#tools, this.#says, this.#cancel);
    const kept = runningGoal(robot.link, arm.execute);
    if (kept) void this.#follow(kept);
  }

  async open(): Promise<void> {
    this.#tools.hidden = false;
    this.#scene.onDrag = (pose) => {
      this.#write(pose);
      void this.#planTo(pose);
    };
    try {
      const where = await this.#robot.link.call(this.#arm.locate);
      if (!isMessage(where) || where.success !== true) throw new Error(isMessage(where) ? String(where.message) : "The tip cannot be located.");
      const pose = where as unknown as Pose;
      this.#write(pose);
      this.#scene.setHandle(pose);
    } catch (error) {
      this.#say((error as Error).message, "bad");
    }
  }

  close(): void {
    this.#tools.hidden = true;
    this.#turn += 1;
    this.#stopShowing();
    this.#scene.setHandle(null);
    this.#scene.onDrag = () => undefined;
    if (this.#running) this.#say(MOVING, "");
    else this.#say("", "");
  }

  #write(pose: Pose): void {
    const values = [pose.x * 100, pose.y * 100, pose.z * 100, ...[pose.roll, pose.pitch, pose.yaw].map((angle) => (angle * 180) / Math.PI)];
    this.#poses.forEach((input, at) => (input.value = String(tidy(Number(values[at]!.toFixed(1))))));
  }

  /** Plans a way to a pose of the tip: joints that reach it, then a way to them that hits nothing. */
  async #planTo(pose: Pose): Promise<void> {
    const turn = (this.#turn += 1);
    this.#stopShowing();
    this.#say("Planning\u2026", "");
    try {
      const { x, y, z, roll, pitch, yaw } = pose;
      const pose_stamped = { pose: { position: { x, y, z }, orientation: quaternionOf(roll, pitch, yaw) } };
      const ik = { ik_request: { group_name: this.#arm.name, avoid_collisions: true, pose_stamped, timeout: { sec: 1, nanosec: 0 } } };
      const solved = await this.#robot.link.call(this.#arm.inverse, ik, 10_000);
      if (turn !== this.#turn) return;
      const positions = isMessage(solved) && isMessage(solved.solution ?? null) ? positionsOf((solved.solution as Message).joint_state) : {};
      if (codeOf(solved) !== SOLVED) return this.#say(`The tip cannot be there: ${reason(solved) || "it is out of reach, or something is in the way"}`, "bad");
      this.#ghost(positions);
      const { status, values } = await this.#robot.link.act(this.#arm.plan, "moveit_msgs/action/MoveGroup", planOf(positions)).done;
      if (turn !== this.#turn) return;
      this.#plan = isMessage(values) ? (values.planned_trajectory ?? null) : null;
      this.#way = wayOf(this.#plan ?? undefined);
      if (status !== FINISHED || this.#way.length === 0) return this.#say(`No way was found: ${reason(values)}`, "bad");
      this.#execute.disabled = false;
      this.#say(`A way of ${this.#way.at(-1)!.time.toFixed(1)}\u202fs. Execute moves the arm.`, "good");
      this.#show();
    } catch (error) {
      if (turn === this.#turn) this.#say((error as Error).message, "bad");
    }
  }

  /** Lets the ghost go the way, again and again; without motion for who wants none. */
  #show(): void {
    const end = this.#way.at(-1)!.time;
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) return this.#ghost(onWay(this.#way, end));
    const began = performance.now();
    const step = () => {
      this.#ghost(onWay(this.#way, ((performance.now() - began) / 1000) % (end + 1)));
      this.#frame = requestAnimationFrame(step);
    };
    step();
  }

  #stopShowing(): void {
    cancelAnimationFrame(this.#frame);
    this.#execute.disabled = true;
    this.#ghost(null);
  }

  async #go(): Promise<void> {
    const trajectory = this.#plan;
    this.#stopShowing();
    const { execute } = this.#arm;
    await this.#follow(sendGoal(this.#robot.link, execute, execute, "moveit_msgs/action/ExecuteTrajectory", { trajectory }));
  }

  /** Shows a goal that runs, until it has ended or another has taken its place. */
  async #follow(goal: KeptGoal): Promise<void> {
    this.#running = goal;
    this.#cancel.hidden = false;
    this.#say(MOVING, "");
    const end = (text: string, kind: string) => {
      if (this.#running !== goal) return;
      this.#running = undefined;
      this.#cancel.hidden = true;
      this.#say(text, kind);
    };
    try {
      const { status, values } = await goal.done;
      if (status === FINISHED) end("It is there.", "good");
      else end(`It stopped: ${reason(values) || "canceled"}`, "bad");
    } catch (error) {
      end((error as Error).message, "bad");
    }
  }

  #say(text: string, kind: string): void {
    this.#says.dataset.kind = kind;
    setText(this.#says, text);
  }
}

function codeOf(answer: Json): number {
  const code = isMessage(answer) ? answer.error_code : null;
  return isMessage(code ?? null) ? Number((code as Message).val) : 0;
}

function nameOf(joint: string): string {
  return formatName(joint.replace(/_joint$/, ""));
}

/** A joint with its slider: it follows the robot until it is moved. */
class JointRow {
  readonly element: HTMLElement;
  readonly #slider: JointSlider;
  readonly #input: HTMLInputElement;
  readonly #output = h("output", {}, "\u2013");
  #isOwn = false;

  constructor(slider: JointSlider, wanted: (value: number) => void) {
    this.#slider = slider;
    const { name, least, most, step, unit } = slider;
    this.#input = h("input", { id: `joint-${name}`, type: "range", min: String(least), max: String(most), step: String(step) });
    this.#input.oninput = () => wanted(Number(this.#input.value) * slider.scale);
    const limits = h("span", { class: "label" }, ` ${least} to ${most}\u202f${unit}`);
    const label = h("label", { for: this.#input.id }, nameOf(name), limits);
    this.element = h("div", { class: "slider" }, label, this.#output, this.#input);
    this.#show(0);
  }

  /** Shows a wanted position [rad, m]. */
  want(value: number): void {
    this.#isOwn = true;
    this.#show(value);
  }

  get isDisabled(): boolean {
    return this.#input.disabled;
  }

  disable(why: string): void {
    disable(why, this.#input);
  }

  /** Shows where the robot has it, as soon as it says so. */
  follow(): void {
    this.#isOwn = false;
  }

  measured(value: number | undefined): void {
    if (value === undefined || this.#isOwn) return;
    this.#show(value);
  }

  #show(value: number): void {
    const { scale, unit, least, most } = this.#slider;
    const shown = value / scale;
    this.#input.value = String(shown);
    this.#input.style.setProperty("--share", String(Math.min(1, Math.max(0, (shown - least) / (most - least)))));
    setText(this.#output, `${shown.toFixed(1)}\u202f${unit}`);
    this.#input.setAttribute("aria-valuetext", `${shown.toFixed(1)} ${unit}`);
  }
}
