/** The robot's body in 3D: moved by its joints, with a ghost, axes of its links, things around it, and a handle to drag. */
import * as three from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { TransformControls } from "three/examples/jsm/controls/TransformControls.js";
import { ColladaLoader } from "three/examples/jsm/loaders/ColladaLoader.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";
import URDFLoader, { type URDFJoint, type URDFRobot } from "urdf-loader";
import { IDENTITY, type Point, type Transform, type Vector } from "../map";
import type { JointLimits, RosPose, Shape, Thing } from "../model";
import type { SeenThing } from "../seen";
import { heightOf, placeAt, wallMesh, type World, type WorldLight, type WorldShape } from "../world";

export interface Pose {
  x: number;
  y: number;
  z: number;
  roll: number;
  pitch: number;
  yaw: number;
}


const GHOST = new three.MeshStandardMaterial({ color: 0xf0a020, transparent: true, opacity: 0.45, depthWrite: false });
const THING = new three.MeshStandardMaterial({ color: 0x3a8f5a, transparent: true, opacity: 0.5 });
const WALL = new three.MeshStandardMaterial({ color: 0x7d8a99, transparent: true, opacity: 0.4, depthWrite: false });
const FLOOR = new three.MeshBasicMaterial({ color: 0x9aa6b3, transparent: true, opacity: 0.2, depthWrite: false });
const LINE = new three.LineBasicMaterial({ color: 0x808890, transparent: true, opacity: 0.3 });
const SEEN = new three.PointsMaterial({ color: 0xd8262c, size: 4, sizeAttenuation: false });
const TAG = new three.MeshBasicMaterial({ color: 0x146ebe, transparent: true, opacity: 0.6, side: three.DoubleSide });
const HOLE = 0x181818;
const LAMP = 12; // candela of a lamp of full strength
const GREY = "#8a94a0"; // of shapes without a colour
const VEILED = { transparent: true, opacity: 0.75 }; // so that the robot is seen behind it
const TALL = 0.6; // [m] of walls: a map does not say how high they are
const AROUND = 2.5; // [m] the least distance from which a robot is seen in its world
const FAR = 100; // [m]
const FADED = 0.2; // of links that a changed robot has no more
const SAME = 1e-3; // [rad, m]
const SQUARE = 0.5; // [m] of the lines on the ground
const VIEWS = { Front: [1, 0, 0.25], Side: [0, 1, 0.25], Top: [0.001, 0, 1], Corner: [1, 1, 0.7], All: [-0.3, -0.8, 1] } as const;
export type View = keyof typeof VIEWS;

function newRenderer(): three.WebGLRenderer {
  try {
    return new three.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  } catch {
    throw new Error("This browser draws nothing in 3D, since WebGL is off or blocked: switch it on, or take another browser.");
  }
}

export class RobotScene {
  readonly element = document.createElement("div");
  /** Called when the handle was let go, with where it is in the frame that it was shown in. */
  onDrag: (pose: Pose) => void = () => undefined;
  /** Names of meshes that could not be read. */
  readonly missing: string[] = [];
  readonly #scene = new three.Scene();
  readonly #camera = new three.PerspectiveCamera(45, 1, 0.01, FAR);
  readonly #renderer = newRenderer();
  readonly #orbit: OrbitControls;
  readonly #handle = new three.Object3D();
  readonly #gizmo: TransformControls;
  readonly #axes = new Map<string, three.Object3D>();
  readonly #observer = new ResizeObserver(() => this.#resize());
  #robot: URDFRobot | null = null;
  #ghost: URDFRobot | null = null;
  #draft: URDFRobot | null = null; // the robot with changes that nobody has saved
  #draftLinks: ReadonlySet<string> = new Set();
  #gone: readonly string[] = [];
  #things: three.Mesh[] = [];
  readonly #ground = new three.GridHelper(20 * SQUARE, 20, 0x808890, 0x808890);
  readonly #scans = new Map<string, three.Points>();
  readonly #seen = new Map<string, three.Group>();
  #world: three.Group | null = null;
  #shapes: { shape: WorldShape; mesh: three.Mesh }[] = [];
  #robots = new Map<string, three.Mesh>(); // others in the same world
  #isFollowed = true; // whether the camera goes with the robot
  #frame = 0;

  constructor() {
    this.element.className = "scene";
    this.element.append(this.#renderer.domElement);
    this.#renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.#camera.up.set(0, 0, 1);
    const sun = new three.DirectionalLight(0xffffff, 2.2);
    sun.position.set(2, 1.5, 4);
    this.#ground.rotation.x = Math.PI / 2;
    (this.#ground.material as three.Material).transparent = true;
    (this.#ground.material as three.Material).opacity = 0.35;
    this.#scene.add(new three.HemisphereLight(0xffffff, 0x8a8f98, 1.6), sun, this.#ground, this.#handle);
    this.#orbit = new OrbitControls(this.#camera, this.#renderer.domElement);
    this.#orbit.addEventListener("change", () => this.#draw());
    this.#gizmo = new TransformControls(this.#camera, this.#renderer.domElement);
    this.#gizmo.setSize(0.8);
    this.#gizmo.addEventListener("change", () => this.#draw());
    this.#gizmo.addEventListener("dragging-changed", ({ value }) => {
      this.#orbit.enabled = !value;
      if (!value) this.onDrag(this.#handlePose());
    });
    this.#observer.observe(this.element);
  }

  /** Shows a body; meshes that cannot be read are left out and named in `missing`. */
  load(urdf: string, changed: () => void): JointLimits[] {
    const parse = () => this.#parse(urdf, changed);
    this.#robot = parse();
    this.#ghost = parse();
    this.#ghost.visible = false;
    this.#scene.add(this.#robot, this.#ghost);
    this.#style();
    this.look("Corner");
    return Object.values(this.#robot.joints)
      .filter((joint) => ["revolute", "continuous", "prismatic"].includes(joint.jointType) && !("mimicJoint" in joint && joint.mimicJoint))
      .map(({ urdfName, jointType, limit }) => ({ name: urdfName, kind: jointType as JointLimits["kind"], lower: limit.lower, upper: limit.upper }));
  }

  #parse(urdf: string, changed: () => void): URDFRobot {
    const loader = new URDFLoader();
    loader.loadMeshCb = (path, _manager, _material, done) => {
      void readMesh(path).then(
        (mesh) => {
          done(mesh);
          this.#style();
          changed();
        },
        () => {
          if (!this.missing.includes(path)) this.missing.push(path);
          done(new three.Group());
          changed();
        },
      );
    };
    return loader.parse(urdf);
  }

  /** Shows links of a changed body as a ghost on the robot, and fades those that it has no more; or nothing of it. */
  preview(urdf: string, ghosts: ReadonlySet<string>, gone: readonly string[], changed: () => void): void {
    this.#draft?.removeFromParent();
    this.#draft = null;
    for (const link of this.#gone) this.setAlpha(link, 1);
    this.#gone = gone;
    for (const link of gone) this.setAlpha(link, FADED);
    this.#draftLinks = ghosts;
    if (urdf && ghosts.size > 0 && this.#robot) {
      this.#draft = this.#parse(urdf, changed);
      this.#draft.position.copy(this.#robot.position);
      this.#draft.quaternion.copy(this.#robot.quaternion);
      this.#draft.setJointValues(this.#angles());
      this.#scene.add(this.#draft);
      this.#style();
    }
    this.#draw();
  }

  #angles(): Record<string, number> {
    return Object.fromEntries(Object.values(this.#robot!.joints).map((joint) => [joint.urdfName, Number(joint.angle)]));
  }

  /** Names of the links that can be seen, sorted. */
  get links(): string[] {
    const all = Object.entries(this.#robot?.links ?? {});
    return all.filter(([, link]) => meshesOf(link).length > 0).map(([name]) => name).sort();
  }

  /** How many meshes are drawn. */
  get drawn(): number {
    let count = 0;
    this.#robot?.traverse((object) => (count += Number(object instanceof three.Mesh)));
    return count;
  }

  setJoints(positions: Record<string, number>): void {
    this.#robot?.setJointValues(positions);
    this.#draft?.setJointValues(positions);
    this.#draw();
  }

  /** Shows the ghost with these positions, or hides it. */
  setGhost(positions: Record<string, number> | null): void {
    if (!this.#ghost || !this.#robot) return;
    this.#ghost.visible = positions !== null;
    if (positions) {
      const now = this.#angles();
      this.#ghost.setJointValues({ ...now, ...positions });
      const moved = new Set(Object.keys(positions).filter((name) => Math.abs(positions[name]! - (now[name] ?? 0)) > SAME));
      showBelow(this.#ghost, moved, false);
    }
    this.#draw();
  }

  /** The link that is the root of the body. */
  get root(): string {
    return this.#robot?.urdfName ?? "";
  }

  /** Puts the body where the robot is in its world; the camera goes with it, unless it looks at the whole world. */
  place({ translation, rotation }: Transform): void {
    if (!this.#robot) return;
    const way = new three.Vector3(translation.x, translation.y, translation.z).sub(this.#robot.position);
    const turn = new three.Quaternion(rotation.x, rotation.y, rotation.z, rotation.w);
    if (way.lengthSq() === 0 && turn.equals(this.#robot.quaternion)) return; // it stands: there is nothing to draw
    for (const body of [this.#robot, this.#ghost!, ...(this.#draft ? [this.#draft] : [])]) {
      body.position.add(way);
      body.quaternion.copy(turn);
    }
    const { x, y } = this.#robot.position;
    this.#ground.position.set(SQUARE * Math.round(x / SQUARE), SQUARE * Math.round(y / SQUARE), 0);
    if (this.#isFollowed && way.lengthSq() > 0) {
      this.#camera.position.add(way);
      this.#orbit.target.add(way);
      this.#orbit.update();
    }
    this.#draw();
  }

  /** Shows the world around the robot, whose frame is that of the scene; without one, the robot is at its origin. */
  setWorld(world: World | null): void {
    this.#world?.traverse((object) => "geometry" in object && (object.geometry as three.BufferGeometry).dispose());
    this.#world?.removeFromParent();
    for (const topic of this.#scans.keys()) this.setScan(topic, []);
    for (const topic of this.#seen.keys()) this.setSeen(topic, []);
    this.#shapes = (world?.shapes ?? []).map((shape) => ({ shape, mesh: standing(shape) }));
    this.#robots = new Map((world?.robots ?? []).map((robot) => [robot.name, standing(robot)]));
    const meshes = [...this.#shapes.map(({ mesh }) => mesh), ...this.#robots.values()];
    this.#world = world && new three.Group().add(...wallsOf(world), ...meshes, ...world.lights.map(shining), ...world.holes.map(missing));
    if (this.#world) this.#scene.add(this.#world);
    else this.place(IDENTITY);
    this.#ground.visible = !world?.walls; // a floor has lines of its own
    this.#camera.far = Math.max(FAR, 4 * this.#extent().radius);
    this.#camera.updateProjectionMatrix();
    this.look("Corner");
  }

  /** Puts what moves in the world where it is at a robot time [s]. */
  moveShapes(time: number): void {
    for (const { shape, mesh } of this.#shapes) {
      if (shape.path.length === 0) continue;
      const { x, y } = placeAt(shape, time);
      mesh.position.set(x, y, mesh.position.z);
      this.#draw();
    }
  }

  /** Puts things of the world, by name, where the robot has pushed them: the pose of the middle of each. */
  pushShapes(places: ReadonlyMap<string, Transform>): void {
    for (const { shape, mesh } of this.#shapes) {
      const place = places.get(shape.name);
      if (!place) continue;
      const { translation: at, rotation } = place;
      mesh.position.set(at.x, at.y, at.z);
      mesh.quaternion.set(rotation.x, rotation.y, rotation.z, rotation.w);
      this.#draw();
    }
  }

  /** Puts other robots where they are, by name. */
  moveRobots(places: ReadonlyMap<string, Point>): void {
    for (const [name, { x, y }] of places) {
      const mesh = this.#robots.get(name);
      mesh?.position.set(x, y, mesh.position.z);
    }
    this.#draw();
  }

  /** Shows what a laser sees, in the frame of the world; no points take it away. */
  setScan(topic: string, points: readonly Vector[]): void {
    let scan = this.#scans.get(topic);
    if (!scan) {
      scan = new three.Points(new three.BufferGeometry(), SEEN);
      scan.frustumCulled = false;
      this.#scans.set(topic, scan);
      this.#scene.add(scan);
    }
    scan.geometry.dispose();
    scan.geometry = new three.BufferGeometry().setFromPoints(points.map(({ x, y, z }) => new three.Vector3(x, y, z)));
    this.#draw();
  }

  /** Shows tags and things that a camera sees, in the frame of the world, in place of those before. */
  setSeen(topic: string, things: readonly SeenThing[]): void {
    this.#seen.get(topic)?.removeFromParent();
    const group = new three.Group();
    for (const { name, pose, size } of things) {
      const mesh = new three.Mesh(new three.BoxGeometry(size.x, size.y, Math.max(size.z, SAME)), TAG);
      const { translation: at, rotation } = pose;
      mesh.position.set(at.x, at.y, at.z);
      mesh.quaternion.set(rotation.x, rotation.y, rotation.z, rotation.w);
      mesh.add(label(name));
      group.add(mesh);
    }
    this.#seen.set(topic, group);
    this.#scene.add(group);
    this.#draw();
  }

  /** Shows or hides the axes of a link: x red, y green, z blue. */
  setAxes(link: string, isShown: boolean): void {
    const frame = this.#robot?.links[link];
    if (!frame) return;
    let axes = this.#axes.get(link);
    if (!axes && isShown) {
      axes = new three.AxesHelper(0.12);
      (axes as three.AxesHelper).material = new three.LineBasicMaterial({ vertexColors: true, depthTest: false });
      axes.add(label(link));
      this.#axes.set(link, axes);
      frame.add(axes);
    }
    if (axes) axes.visible = isShown;
    this.#draw();
  }

  get frames(): string[] {
    return Object.keys(this.#robot?.links ?? {}).sort();
  }

  /** Sets how opaque a link is, from 0 to 1. */
  setAlpha(link: string, alpha: number): void {
    const frame = this.#robot?.links[link];
    for (const mesh of frame ? meshesOf(frame) : []) {
      for (const material of [mesh.material].flat()) {
        material.transparent = alpha < 1;
        material.opacity = alpha;
      }
      mesh.visible = alpha > 0;
    }
    this.#draw();
  }

  /** Shows a handle at a pose in the frame of the robot's root, or of a link, or none. */
  setHandle(pose: Pose | null, link = ""): void {
    const frame = link ? (this.#robot?.links[link] ?? this.#draft?.links[link]) : this.#robot;
    if (!pose || !frame) {
      this.#gizmo.detach();
      this.#scene.remove(this.#gizmo.getHelper());
    } else {
      frame.add(this.#handle);
      this.#handle.position.set(pose.x, pose.y, pose.z);
      this.#handle.rotation.set(pose.roll, pose.pitch, pose.yaw, "ZYX");
      this.#gizmo.attach(this.#handle);
      this.#scene.add(this.#gizmo.getHelper());
    }
    this.#draw();
  }

  setHandleMode(mode: "translate" | "rotate"): void {
    this.#gizmo.setMode(mode);
    this.#draw();
  }

  /** Shows the things around the robot, and those that it holds: each in the frame of its link. */
  setThings(things: readonly Thing[]): void {
    for (const old of this.#things) old.removeFromParent();
    this.#things = things.flatMap(({ link, pose, shapes }) => {
      const frame = this.#robot?.links[link] ?? this.#scene;
      return shapes.flatMap((shape) => {
        const geometry = geometryOf(shape);
        if (!geometry) return [];
        const mesh = new three.Mesh(geometry, THING);
        mesh.applyMatrix4(matrixOf(pose).multiply(matrixOf(shape.pose)));
        frame.add(mesh);
        return [mesh];
      });
    });
    this.#draw();
  }

  /** Looks at the whole robot from a side of it, and goes with it; or at all that there is, and stays. */
  look(view: View): void {
    if (!this.#robot) return;
    this.#isFollowed = view !== "All";
    const direction = new three.Vector3(...VIEWS[view]);
    if (this.#isFollowed) direction.applyQuaternion(this.#robot.quaternion);
    const ball = this.#isFollowed ? ballAround(this.#robot) : this.#extent();
    const half = Math.tan((this.#camera.fov * Math.PI) / 360) * Math.min(1, this.#camera.aspect); // of the narrower side
    const distance = ((this.#isFollowed ? 1.25 : 0.95) * ball.radius) / Math.sin(Math.atan(half));
    const away = direction.normalize().multiplyScalar(this.#world ? Math.max(AROUND, distance) : distance);
    this.#camera.position.copy(ball.center).add(away);
    this.#orbit.target.copy(ball.center);
    this.#orbit.update();
    this.#draw();
  }

  zoom(factor: number): void {
    const away = this.#camera.position.clone().sub(this.#orbit.target).multiplyScalar(1 / factor);
    this.#camera.position.copy(this.#orbit.target).add(away);
    this.#orbit.update();
    this.#draw();
  }

  close(): void {
    this.#observer.disconnect();
    cancelAnimationFrame(this.#frame);
    this.#gizmo.dispose();
    this.#orbit.dispose();
    this.#renderer.dispose();
    this.#renderer.forceContextLoss();
  }

  #extent(): three.Sphere {
    return ballAround(this.#world ?? this.#robot!);
  }

  #handlePose(): Pose {
    const { position, quaternion } = this.#handle;
    const angles = new three.Euler().setFromQuaternion(quaternion, "ZYX");
    return { x: position.x, y: position.y, z: position.z, roll: angles.x, pitch: angles.y, yaw: angles.z };
  }

  /** Gives each mesh a material of its own, so that links can be made transparent one by one; the ghost has one. */
  #style(): void {
    this.#robot?.traverse((object) => {
      if (!(object instanceof three.Mesh) || object.userData.styled) return;
      object.userData.styled = true;
      object.material = Array.isArray(object.material) ? object.material.map((one: three.Material) => one.clone()) : (object.material as three.Material).clone();
    });
    for (const ghost of [this.#ghost, this.#draft]) {
      ghost?.traverse((object) => {
        if (object instanceof three.Mesh) object.material = GHOST;
      });
    }
    for (const [name, link] of Object.entries(this.#draft?.links ?? {})) {
      for (const mesh of meshesOf(link)) mesh.visible = this.#draftLinks.has(name);
    }
    this.#draw();
  }

  #resize(): void {
    const { clientWidth, clientHeight } = this.element;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.#renderer.setSize(clientWidth, clientHeight, false);
    this.#camera.aspect = clientWidth / clientHeight;
    this.#camera.updateProjectionMatrix();
    this.#draw();
  }

  /** Draws once in the next frame of the screen; nothing is drawn while nothing changes. */
  #draw(): void {
    if (this.#frame) return;
    this.#frame = requestAnimationFrame(() => {
      this.#frame = 0;
      this.#renderer.render(this.#scene, this.#camera);
    });
  }
}

/** Returns the ball around what an object shows; around the origin if it shows nothing. */
function ballAround(object: three.Object3D): three.Sphere {
  const box = new three.Box3().setFromObject(object);
  if (box.isEmpty()) box.set(new three.Vector3(-0.5, -0.5, 0), new three.Vector3(0.5, 0.5, 1));
  return box.getBoundingSphere(new three.Sphere());
}

/** Returns the walls of a world and the floor between them: one object each, however large the map is. */
function wallsOf({ walls: grid }: World): three.Object3D[] {
  if (!grid) return [];
  const { positions, normals, indices } = wallMesh(grid, TALL);
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new three.BufferAttribute(normals, 3));
  geometry.setIndex(new three.BufferAttribute(indices, 1));
  const [right, up] = [grid.width * grid.resolution, grid.height * grid.resolution];
  const floor = new three.PlaneGeometry(right, up).translate(right / 2, up / 2, -SAME);
  const objects = [new three.Mesh(geometry, WALL), new three.Mesh(floor, FLOOR), linesOn(right, up)];
  const { translation, rotation } = grid.origin;
  for (const object of objects) object.applyMatrix4(matrixOf({ position: translation, orientation: rotation }));
  return objects;
}

/** Returns the lines of a floor of a size [m]. */
function linesOn(right: number, up: number): three.LineSegments {
  const ends: three.Vector3[] = [];
  for (let x = 0; x <= right; x += SQUARE) ends.push(new three.Vector3(x, 0, 0), new three.Vector3(x, up, 0));
  for (let y = 0; y <= up; y += SQUARE) ends.push(new three.Vector3(0, y, 0), new three.Vector3(right, y, 0));
  return new three.LineSegments(new three.BufferGeometry().setFromPoints(ends), LINE);
}

/** Returns a thing of a world, where it stands; its origin is at half of its height. */
function standing(shape: WorldShape): three.Mesh {
  const { kind, size, x, y, z, heading, colour } = shape;
  const geometry = kind === "mesh" ? hullGeometry(shape) : geometryOf({ kind, size })!;
  const mesh = new three.Mesh(geometry, new three.MeshStandardMaterial({ color: knownColour(colour), ...VEILED }));
  mesh.position.set(x, y, z + heightOf(shape) / 2);
  mesh.rotation.z = heading;
  return mesh;
}

/** Returns the convex parts of a mesh, around the middle of its height. */
function hullGeometry(shape: WorldShape): three.BufferGeometry {
  const places = shape.hulls.flatMap(({ corners, triangles }) => triangles.flatMap((at) => corners.slice(3 * at, 3 * at + 3)));
  const geometry = new three.BufferGeometry().setAttribute("position", new three.Float32BufferAttribute(places, 3));
  geometry.translate(0, 0, -heightOf(shape) / 2).computeVertexNormals();
  return geometry;
}

/** Returns a hole in the ground, as a dark area just above it. */
function missing(corners: readonly Point[]): three.Mesh {
  const outline = new three.Shape(corners.map(({ x, y }) => new three.Vector2(x, y)));
  const mesh = new three.Mesh(new three.ShapeGeometry(outline), new three.MeshBasicMaterial({ color: HOLE, side: three.DoubleSide }));
  mesh.position.z = 2e-3;
  return mesh;
}

/** Returns the lamp of a world. */
function shining({ x, y, z, colour, strength }: WorldLight): three.PointLight {
  const lamp = new three.PointLight(knownColour(colour || "white"), LAMP * strength);
  lamp.position.set(x, y, z);
  return lamp;
}

/** Returns a colour as numbers, however it is written: a context knows them all, and ignores what is none. */
function knownColour(colour: string): string {
  const context = document.createElement("canvas").getContext("2d")!;
  context.fillStyle = GREY;
  context.fillStyle = colour;
  return String(context.fillStyle);
}

/** Shows the meshes that hang on one of these joints, and hides the others: the ghost shows what is elsewhere. */
function showBelow(object: three.Object3D, joints: ReadonlySet<string>, isBelow: boolean): void {
  const below = isBelow || ("isURDFJoint" in object && joints.has((object as URDFJoint).urdfName));
  if (object instanceof three.Mesh) object.visible = below;
  for (const child of object.children) showBelow(child, joints, below);
}

/** Returns the meshes of a link itself, without those of links that hang on it. */
function meshesOf(link: three.Object3D): three.Mesh[] {
  const found: three.Mesh[] = [];
  for (const child of link.children) {
    if ("isURDFVisual" in child) child.traverse((object) => object instanceof three.Mesh && found.push(object));
  }
  return found;
}

function matrixOf({ position, orientation }: RosPose): three.Matrix4 {
  const { x, y, z, w } = orientation;
  const turn = new three.Quaternion(x, y, z, w);
  return new three.Matrix4().compose(new three.Vector3(position.x, position.y, position.z), turn, new three.Vector3(1, 1, 1));
}

/** Returns what is drawn of a shape; planes, meshes and octrees are left out. */
function geometryOf({ kind, size }: Pick<Shape, "kind" | "size">): three.BufferGeometry | null {
  const [a = 0, b = 0, c = 0] = size;
  if (kind === "box") return new three.BoxGeometry(a, b, c);
  if (kind === "sphere") return new three.SphereGeometry(a, 24, 16);
  // Their axis is z here, and y in three.js.
  if (kind === "cylinder") return new three.CylinderGeometry(a, a, b, 32).rotateX(Math.PI / 2);
  if (kind === "cone") return new three.ConeGeometry(a, b, 32).rotateX(Math.PI / 2);
  return null;
}

async function readMesh(path: string): Promise<three.Object3D> {
  const kind = path.split(".").pop()!.toLowerCase();
  if (kind === "stl") return new three.Mesh(await new STLLoader().loadAsync(path), new three.MeshStandardMaterial({ color: 0xb8bec6 }));
  if (kind === "dae") return (await new ColladaLoader().loadAsync(path))!.scene;
  if (kind === "obj") return await new OBJLoader().loadAsync(path);
  throw new Error(`no loader for ${path}`);
}

function label(text: string): three.Sprite {
  const canvas = document.createElement("canvas");
  const brush = canvas.getContext("2d")!;
  const font = "28px system-ui, sans-serif";
  brush.font = font;
  canvas.width = Math.ceil(brush.measureText(text).width) + 12;
  canvas.height = 40;
  brush.font = font;
  brush.fillStyle = "rgba(255, 255, 255, 0.85)";
  brush.fillRect(0, 0, canvas.width, canvas.height);
  brush.fillStyle = "#14181d";
  brush.fillText(text, 6, 29);
  const sprite = new three.Sprite(new three.SpriteMaterial({ map: new three.CanvasTexture(canvas), depthTest: false }));
  sprite.scale.set((0.035 * canvas.width) / canvas.height, 0.035, 1);
  sprite.center.set(-0.1, 0.5);
  return sprite;
}
