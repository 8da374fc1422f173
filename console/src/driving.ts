/**
 * The logic of driving by hand: a state machine without a clock, a page or a socket.
 *
 * `drive` takes a state, an event and the time, and returns the next state with what is to be done. Motion needs the
 * dead-man switch (Shift beside a key, or a held pad) and the lease; whatever ends either stops the robot at once.
 */

/** Forward [m/s] and counter-clockwise [rad/s]. */
export interface Motion {
  forward: number;
  turn: number;
}

export type Direction = "forward" | "back" | "left" | "right";

/** Where a pad is held, from the middle: right and up are 1. */
export interface Point {
  x: number;
  y: number;
}

export interface Driving {
  readonly speeds: Motion;
  readonly keys: ReadonlySet<Direction>;
  readonly shift: boolean;
  readonly pad: Point | null;
  readonly connected: boolean;
  readonly stopped: boolean;
  readonly lease: "none" | "asked" | "held";
  /** After a refusal or an interruption, nothing drives until all inputs were let go. */
  readonly latched: boolean;
  /** What was published last, and when [ms]. */
  readonly commanded: Motion;
  readonly published: number;
  /** When the inputs were last in use [ms]. */
  readonly used: number;
}

export type DriveEvent =
  | { is: "key"; direction: Direction; down: boolean; shift: boolean }
  | { is: "shift"; down: boolean }
  | { is: "pad"; at: Point | null }
  | { is: "speeds"; speeds: Motion }
  | { is: "tick" }
  /** The window lost the focus or is hidden, or the pointer was taken away. */
  | { is: "interrupted" }
  | { is: "connected" }
  | { is: "disconnected" }
  | { is: "granted" }
  /** The lease was refused, or it is lost. */
  | { is: "refused" }
  | { is: "stopped" }
  | { is: "released" };

export type Action = { do: "publish"; motion: Motion } | { do: "take" } | { do: "give" };

export const PERIOD = 100; // [ms] of publishing; the gateway stops the base and ends the lease after 500 ms without
const SLACK = 15; // [ms] by which a timer may be early
const IDLE = 2_000; // [ms] without input, while zero is published, after which the lease is given back
const DEAD_ZONE = 0.06; // of the pad, around its middle

export const STILL: Motion = { forward: 0, turn: 0 };

export function parked(speeds: Motion): Driving {
  return {
    speeds,
    keys: new Set(),
    shift: false,
    pad: null,
    connected: false,
    stopped: false,
    lease: "none",
    latched: false,
    commanded: STILL,
    published: -Infinity,
    used: -Infinity,
  };
}

/** Returns the motion that the inputs ask for, or null while no dead-man switch is held. */
export function wanted(state: Driving): Motion | null {
  if (state.pad) {
    return { forward: state.speeds.forward * reach(state.pad.y), turn: state.speeds.turn * reach(-state.pad.x) };
  }
  if (!state.shift || state.keys.size === 0) return null;
  const held = (direction: Direction) => Number(state.keys.has(direction));
  return {
    forward: state.speeds.forward * (held("forward") - held("back")),
    turn: state.speeds.turn * (held("left") - held("right")),
  };
}

export function moves(motion: Motion): boolean {
  return motion.forward !== 0 || motion.turn !== 0;
}

export function drive(before: Driving, event: DriveEvent, now: number): { state: Driving; actions: Action[] } {
  const actions: Action[] = [];
  let state = after(before, event);
  if (event.is === "granted") state = { ...state, used: now };
  const inUse = state.pad !== null || state.keys.size > 0;
  if (!inUse && state.latched) state = { ...state, latched: false };
  const motion = state.connected && !state.stopped && !state.latched ? wanted(state) : null;
  if (motion) {
    state = { ...state, used: now };
    if (state.lease === "none") {
      actions.push({ do: "take" });
      state = { ...state, lease: "asked" };
    } else if (state.lease === "held" && (starts(before, motion) || now - state.published >= PERIOD - SLACK)) {
      actions.push({ do: "publish", motion });
      state = { ...state, commanded: motion, published: now };
    }
  } else if (state.lease === "held" && (moves(state.commanded) || now - state.published >= PERIOD - SLACK)) {
    actions.push({ do: "publish", motion: STILL });
    state = { ...state, commanded: STILL, published: now };
  } else if (state.lease !== "held") {
    state = { ...state, commanded: STILL };
  }
  const ends = event.is === "interrupted" || event.is === "stopped";
  if ((ends && state.lease !== "none") || (state.lease === "held" && !motion && now - state.used >= IDLE)) {
    actions.push({ do: "give" });
    state = { ...state, lease: "none" };
  }
  return { state, actions };
}

/** Returns the state with what an event itself says. */
function after(state: Driving, event: DriveEvent): Driving {
  switch (event.is) {
    case "key": {
      const keys = new Set(state.keys);
      if (event.down) keys.add(event.direction);
      else keys.delete(event.direction);
      return { ...state, keys, shift: event.shift };
    }
    case "shift":
      return { ...state, shift: event.down };
    case "pad":
      return { ...state, pad: event.at };
    case "speeds":
      return { ...state, speeds: event.speeds };
    case "interrupted":
      return { ...state, keys: new Set(), shift: false, pad: null };
    case "connected":
      return { ...state, connected: true, latched: true };
    case "disconnected":
      return { ...state, connected: false, lease: "none", keys: new Set(), shift: false, pad: null };
    case "granted":
      // Not if it was given back before the answer came: the robot does both in order.
      return state.lease === "asked" ? { ...state, lease: "held" } : state;
    case "refused":
      return { ...state, lease: "none", latched: true };
    case "stopped":
      return { ...state, stopped: true, latched: true };
    case "released":
      return { ...state, stopped: false, latched: true };
    case "tick":
      return state;
  }
}

function starts(before: Driving, motion: Motion): boolean {
  return !moves(before.commanded) && moves(motion);
}

/** Returns a place on the pad's axis, clipped, as a share of the speed: nothing near the middle, then proportional. */
function reach(place: number): number {
  const size = Math.min(1, Math.abs(place));
  return size <= DEAD_ZONE ? 0 : (Math.sign(place) * (size - DEAD_ZONE)) / (1 - DEAD_ZONE);
}
