/** The robot's body in 3D: moved by its joints, with a ghost, axes of its links, things around it, and a handle to drag. */
import * as three from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { TransformControls } from "three/examples/jsm/controls/TransformControls.js";
import { ColladaLoader } from "three/examples/jsm/loaders/ColladaLoader.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";
import URDFLoader, { type URDFJoint, type URDFRobot } from "urdf-loader";
import type { JointLimits, RosPose, Shape, Thing } from "../model";

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
const SAME = 1e-3; // [rad, m]
const VIEWS = { Front: [1, 0, 0.25], Side: [0, 1, 0.25], Top: [0.001, 0, 1], Corner: [1, 1, 0.7] } as const;
export type View = keyof typeof VIEWS;

export class RobotScene {
  readonly element = document.createElement("div");
  /** Called when the handle was let go, with where it is in the frame of the robot's root. */
  onDrag: (pose: Pose) => void = () => undefined;
  /** Names of meshes that could not be read. */
  readonly missing: string[] = [];
  readonly #scene = new three.Scene();
  readonly #camera = new three.PerspectiveCamera(45, 1, 0.01, 100);
  readonly #renderer = new three.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  readonly #orbit: OrbitControls;
  readonly #handle = new three.Object3D();
  readonly #gizmo: TransformControls;
  readonly #axes = new Map<string, three.Object3D>();
  readonly #observer = new ResizeObserver(() => this.#resize());
  #robot: URDFRobot | null = null;
  #ghost: URDFRobot | null = null;
  #things: three.Mesh[] = [];
  #frame = 0;

  constructor() {
    this.element.className = "scene";
    this.element.append(this.#renderer.domElement);
    this.#renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.#camera.up.set(0, 0, 1);
    const sun = new three.DirectionalLight(0xffffff, 2.2);
    sun.position.set(2, 1.5, 4);
    const grid = new three.GridHelper(10, 20, 0x808890, 0x808890);
    grid.rotation.x = Math.PI / 2;
    (grid.material as three.Material).transparent = true;
    (grid.material as three.Material).opacity = 0.35;
    this.#scene.add(new three.HemisphereLight(0xffffff, 0x8a8f98, 1.6), sun, grid, this.#handle);
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
    const parse = () => {
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
    };
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
    this.#draw();
  }

  /** Shows the ghost with these positions, or hides it. */
  setGhost(positions: Record<string, number> | null): void {
    if (!this.#ghost || !this.#robot) return;
    this.#ghost.visible = positions !== null;
    if (positions) {
      const now = Object.fromEntries(Object.values(this.#robot.joints).map((joint) => [joint.urdfName, Number(joint.angle)]));
      this.#ghost.setJointValues({ ...now, ...positions });
      const moved = new Set(Object.keys(positions).filter((name) => Math.abs(positions[name]! - (now[name] ?? 0)) > SAME));
      showBelow(this.#ghost, moved, false);
    }
    this.#draw();
  }

  /** Puts the body where the robot is: x, y [m], heading [rad]. */
  place(x: number, y: number, heading: number): void {
    for (const body of [this.#robot, this.#ghost]) {
      body?.position.set(x, y, 0);
      body?.rotation.set(0, 0, heading);
    }
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

  /** Shows a handle at a pose in the frame of the robot's root, or none. */
  setHandle(pose: Pose | null): void {
    if (!pose || !this.#robot) {
      this.#gizmo.detach();
      this.#scene.remove(this.#gizmo.getHelper());
    } else {
      this.#robot.add(this.#handle);
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

  /** Looks at the whole robot from a side. */
  look(view: View): void {
    if (!this.#robot) return;
    const box = new three.Box3().setFromObject(this.#robot);
    if (box.isEmpty()) box.set(new three.Vector3(-0.5, -0.5, 0), new three.Vector3(0.5, 0.5, 1));
    const ball = box.getBoundingSphere(new three.Sphere());
    const distance = (1.25 * ball.radius) / Math.sin((this.#camera.fov * Math.PI) / 360);
    const [x, y, z] = VIEWS[view];
    this.#camera.position.copy(ball.center).add(new three.Vector3(x, y, z).normalize().multiplyScalar(distance));
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
    this.#ghost?.traverse((object) => {
      if (object instanceof three.Mesh) object.material = GHOST;
    });
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
function geometryOf({ kind, size }: Shape): three.BufferGeometry | null {
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
