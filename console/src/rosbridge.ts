/** A client of the rosbridge protocol, version 2: JSON over a WebSocket that comes back when it was lost. */
import { Signal } from "./signal";

export type Json = null | boolean | number | string | Json[] | { [key: string]: Json };
export type Message = { [key: string]: Json };

/** What a server sends and this client understands. */
export type Frame =
  | { op: "publish"; topic: string; msg: Message }
  | { op: "service_response"; id: string; service: string; result: boolean; values: Json }
  | { op: "action_feedback"; id: string; values: Message }
  | { op: "action_result"; id: string; result: boolean; status: number; values: Json }
  | { op: "status"; id: string; level: string; msg: string };

/** `retry` is when the next attempt begins [ms, of the clock of `Date.now`]. */
export type LinkState = { is: "connecting" } | { is: "open" } | { is: "lost"; retry: number } | { is: "closed" };

/** The part of a WebSocket that the client uses. */
export interface Socket {
  onopen: ((event: Event) => void) | null;
  onclose: ((event: CloseEvent) => void) | null;
  onmessage: ((event: MessageEvent) => void) | null;
  send(text: string): void;
  close(): void;
}

export interface SubscribeOptions {
  type?: string;
  /** At most one message in this time [ms]. */
  throttle?: number;
}

const FIRST_WAIT = 250; // [ms]
const LONGEST_WAIT = 5_000;
const CALL_TIMEOUT = 5_000;
const OPEN_TIMEOUT = 5_000;
const QUIET = 3_000; // [ms] without a frame, after which the server is asked for one
const SILENT = 2_000; // after that, the connection counts as lost

/** A call of a service that brought no result: refused by the server, or not answered. */
export class CallError extends Error {
  override name = "CallError";
}

/** A call that was not answered: there was no connection, or no answer in time. */
export class UnansweredError extends CallError {
  override name = "UnansweredError";
}

/** A call whose outcome nobody knows: the link was lost meanwhile. */
export class LostError extends UnansweredError {
  override name = "LostError";
}

/** How goals end, by the numbers of `action_msgs/GoalStatus`. */
export const SUCCEEDED = 4;
export const CANCELED = 5;
export const ABORTED = 6;

/** How a goal has ended: with one of the numbers above, and its result, or why. */
export interface Outcome {
  status: number;
  values: Json;
}

/** A goal that was sent. `done` fails with a CallError if it was refused, a LostError if the link was lost. */
export interface Goal {
  done: Promise<Outcome>;
  cancel(): void;
}

/** Returns how long to wait before an attempt [ms]: doubled each time, with up to a quarter taken off at random. */
export function waitBefore(attempt: number, random: () => number = Math.random): number {
  return Math.min(LONGEST_WAIT, FIRST_WAIT * 2 ** attempt) * (1 - random() / 4);
}

/** Returns the frame that a text holds, or undefined if it is none that this client understands. */
export function parseFrame(text: unknown): Frame | undefined {
  if (typeof text !== "string") return undefined;
  let frame: unknown;
  try {
    frame = JSON.parse(text);
  } catch {
    return undefined;
  }
  if (!isMessage(frame)) return undefined;
  const { op, id, topic, msg, service, level } = frame;
  if (op === "publish" && typeof topic === "string" && isMessage(msg)) return { op, topic, msg };
  if (op === "service_response" && typeof id === "string") {
    return {
      op,
      id,
      service: typeof service === "string" ? service : "",
      result: frame.result !== false,
      values: frame.values ?? null,
    };
  }
  if (op === "action_feedback" && typeof id === "string") {
    return { op, id, values: isMessage(frame.values) ? frame.values : {} };
  }
  if (op === "action_result" && typeof id === "string") {
    const status = typeof frame.status === "number" ? frame.status : 0;
    return { op, id, result: frame.result !== false, status, values: frame.values ?? null };
  }
  if (op === "status" && typeof msg === "string") {
    return { op, id: typeof id === "string" ? id : "", level: typeof level === "string" ? level : "", msg };
  }
  return undefined;
}

export function isMessage(value: unknown): value is Message {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

const WINDOWS = "/console/windows/"; // before the queries whose answers are followed

interface Subscription {
  id: string;
  options: SubscribeOptions;
  listeners: Set<(msg: Message) => void>;
  /** The last message of a window, which is sent only when it is another. */
  last: Message | null;
}

interface Call {
  resolve(values: Json): void;
  reject(error: CallError): void;
  timer: ReturnType<typeof setTimeout>;
}

interface SentGoal {
  resolve(outcome: Outcome): void;
  reject(error: CallError): void;
  onFeedback(values: Message): void;
}

/**
 * The link to a robot. Subscriptions and advertisements outlive a lost connection: they are sent again when it is back.
 * Publishing and calling do not wait for it: a command that comes late is worse than none.
 */
export class Rosbridge {
  readonly state = new Signal<LinkState>({ is: "connecting" });
  /** Called with each status frame: errors of the server about what this client sent, by the id of that. */
  onStatus: (frame: Frame & { op: "status" }) => void = () => undefined;
  /** What lets this client in, where the browser sends no cookie: to another host. */
  token = "";

  readonly #url: string;
  readonly #open: (url: string) => Socket;
  #socket: Socket | undefined;
  #attempt = 0;
  #heard = 0; // when the last frame came [ms]
  #timer: ReturnType<typeof setTimeout> | undefined;
  #lastId = 0;
  readonly #subscriptions = new Map<string, Subscription>();
  readonly #advertised = new Map<string, string>();
  readonly #calls = new Map<string, Call>();
  readonly #goals = new Map<string, SentGoal>();

  constructor(url: string, open: (url: string) => Socket = (address) => new WebSocket(address)) {
    this.#url = url;
    this.#open = open;
    this.connect();
  }

  /** Connects at once, without waiting for the next attempt. */
  connect(): void {
    if (this.#socket || this.state.value.is === "closed") return;
    clearTimeout(this.#timer);
    this.state.set({ is: "connecting" });
    const socket = this.#open(this.#url);
    this.#socket = socket;
    this.#timer = setTimeout(() => this.#lose(socket), OPEN_TIMEOUT);
    socket.onopen = () => this.#opened(socket);
    socket.onclose = () => this.#lose(socket);
    socket.onmessage = (event) => {
      this.#heard = performance.now();
      this.#receive(event.data);
    };
  }

  /** Connects anew, as a visitor who has another role by now. */
  reconnect(): void {
    if (this.#socket) this.#lose(this.#socket);
    this.connect();
  }

  /** Ends the link for good. */
  close(): void {
    this.state.set({ is: "closed" });
    if (this.#socket) this.#lose(this.#socket);
    clearTimeout(this.#timer);
  }

  /** Calls the listener with each message of a topic, until the function that this returns is called. */
  subscribe(topic: string, listener: (msg: Message) => void, options: SubscribeOptions = {}): () => void {
    let subscription = this.#subscriptions.get(topic);
    if (!subscription) {
      subscription = { id: this.#nextId("subscribe"), options, listeners: new Set(), last: null };
      this.#subscriptions.set(topic, subscription);
      this.#sendSubscribe(topic, subscription);
    }
    const { id, listeners, last } = subscription;
    listeners.add(listener);
    if (last) queueMicrotask(() => listeners.has(listener) && listener(last));
    return () => {
      if (!listeners.delete(listener) || listeners.size > 0) return;
      this.#subscriptions.delete(topic);
      this.#send({ op: "unsubscribe", id, topic });
    };
  }

  /**
   * Calls the listener with the answer to a query of the robot, such as `mission/ListMissions` or
   * `mux/LookAtMux/component/cmd_vel`, now and whenever it is another; if the robot refuses, with null and why.
   * `period` is the time between two looks [ms].
   */
  watch(query: string, listener: (answer: Json, refused: string) => void, period?: number): () => void {
    return this.subscribe(
      `${WINDOWS}${query}`,
      ({ answer, refused }) => listener(answer ?? null, typeof refused === "string" ? refused : ""),
      period === undefined ? {} : { throttle: period },
    );
  }

  /** Sends a request to the robot, such as `{ type: "mission.PauseMission", mission: "patrol" }`; returns its answer. */
  async ask(request: Message & { type: string }, timeout?: number): Promise<Json> {
    const values = await this.call("/console/ask", request, timeout);
    if (!isMessage(values) || values.success !== true) throw new CallError(reasonOf(values));
    return values.answer ?? null;
  }

  /** Announces that this client publishes on a topic. */
  advertise(topic: string, type: string): void {
    if (this.#advertised.get(topic) === type) return;
    this.#advertised.set(topic, type);
    this.#send({ op: "advertise", id: this.#nextId("advertise"), topic, type });
  }

  /** Publishes a message, with further keys of the frame; returns whether there was a connection to send it on. */
  publish(topic: string, msg: Message, extra: Message = {}): boolean {
    return this.#send({ op: "publish", topic, msg, ...extra });
  }

  /** Calls a service and returns its values. Throws a CallError if there are none. */
  call(service: string, args: Message = {}, timeout: number = CALL_TIMEOUT): Promise<Json> {
    const id = this.#nextId("call");
    return new Promise((resolve, reject) => {
      if (!this.#send({ op: "call_service", id, service, args })) {
        reject(new UnansweredError("not connected"));
        return;
      }
      const timer = setTimeout(() => {
        this.#calls.delete(id);
        reject(new UnansweredError(`no answer from ${service} in ${timeout / 1000} s`));
      }, timeout);
      this.#calls.set(id, { resolve, reject, timer });
    });
  }

  /** Sends a goal to an action. It ends when the robot says so: there is no timeout. */
  act(action: string, type: string, goal: Message, onFeedback: (values: Message) => void = () => undefined): Goal {
    const id = this.#nextId("goal");
    const done = new Promise<Outcome>((resolve, reject) => {
      if (this.#send({ op: "send_action_goal", id, action, action_type: type, args: goal, feedback: true })) {
        this.#goals.set(id, { resolve, reject, onFeedback });
      } else {
        reject(new CallError("not connected"));
      }
    });
    return { done, cancel: () => void (this.#goals.has(id) && this.#send({ op: "cancel_action_goal", id, action })) };
  }

  #nextId(what: string): string {
    this.#lastId += 1;
    return `${what}:${this.#lastId}`;
  }

  #send(frame: Message): boolean {
    if (this.state.value.is !== "open" || !this.#socket) return false;
    this.#socket.send(JSON.stringify(frame));
    return true;
  }

  #sendSubscribe(topic: string, { id, options }: Subscription): void {
    const frame: Message = { op: "subscribe", id, topic };
    if (options.type !== undefined) frame.type = options.type;
    if (options.throttle !== undefined) Object.assign(frame, { throttle_rate: options.throttle, queue_length: 1 });
    this.#send(frame);
  }

  #opened(socket: Socket): void {
    if (socket !== this.#socket) return;
    clearTimeout(this.#timer);
    this.#attempt = 0;
    this.#heard = performance.now();
    this.#guard(socket);
    this.state.set({ is: "open" });
    if (this.token) this.#send({ op: "auth", id: this.#nextId("auth"), mac: this.token });
    for (const [topic, type] of this.#advertised) {
      this.#send({ op: "advertise", id: this.#nextId("advertise"), topic, type });
    }
    for (const [topic, subscription] of this.#subscriptions) this.#sendSubscribe(topic, subscription);
  }

  /** Watches over an open connection: a network that is gone closes none. `asked` is when the server was asked [ms]. */
  #guard(socket: Socket, wait = QUIET, asked = -Infinity): void {
    this.#timer = setTimeout(() => {
      const now = performance.now();
      if (this.#heard < asked) return this.#lose(socket);
      if (now - this.#heard < QUIET) return this.#guard(socket, QUIET - (now - this.#heard));
      this.#send({ op: "call_service", id: this.#nextId("alive"), service: "/rosapi/get_time", args: {} });
      this.#guard(socket, SILENT, now);
    }, wait);
  }

  #lose(socket: Socket): void {
    if (socket !== this.#socket) return;
    clearTimeout(this.#timer);
    this.#socket = undefined;
    socket.onopen = socket.onclose = socket.onmessage = null;
    socket.close();
    for (const call of this.#calls.values()) {
      clearTimeout(call.timer);
      call.reject(new LostError("the connection was lost"));
    }
    this.#calls.clear();
    for (const goal of this.#goals.values()) goal.reject(new LostError("the connection was lost"));
    this.#goals.clear();
    if (this.state.value.is === "closed") return;
    const wait = waitBefore(this.#attempt);
    this.#attempt += 1;
    this.#timer = setTimeout(() => this.connect(), wait);
    this.state.set({ is: "lost", retry: Date.now() + wait });
  }

  #receive(text: unknown): void {
    const frame = parseFrame(text);
    if (!frame) return;
    if (frame.op === "status") {
      const refused = frame.level === "error" ? (this.#takeCall(frame.id) ?? this.#take(frame.id)) : undefined;
      if (refused) refused.reject(new CallError(frame.msg));
      else this.onStatus(frame);
    } else if (frame.op === "action_feedback") {
      this.#goals.get(frame.id)?.onFeedback(frame.values);
    } else if (frame.op === "action_result") {
      const { status, values } = frame;
      const goal = this.#take(frame.id);
      if (frame.result || status === CANCELED || status === ABORTED) goal?.resolve({ status, values });
      else goal?.reject(new CallError(reasonOf(values)));
    } else if (frame.op === "publish") {
      const subscription = this.#subscriptions.get(frame.topic);
      if (subscription && frame.topic.startsWith(WINDOWS)) subscription.last = frame.msg;
      for (const listener of [...(subscription?.listeners ?? [])]) listener(frame.msg);
    } else {
      const call = this.#takeCall(frame.id);
      if (frame.result) call?.resolve(frame.values);
      else call?.reject(new CallError(reasonOf(frame.values)));
    }
  }

  /** Returns a call that was answered, and forgets it. */
  #takeCall(id: string): Call | undefined {
    const call = this.#calls.get(id);
    this.#calls.delete(id);
    clearTimeout(call?.timer);
    return call;
  }

  /** Returns a goal that has ended, and forgets it. */
  #take(id: string): SentGoal | undefined {
    const goal = this.#goals.get(id);
    this.#goals.delete(id);
    return goal;
  }
}

/** Returns why a call failed, of the values of its response: a text, or its message. */
function reasonOf(values: Json): string {
  if (typeof values === "string" && values) return values;
  if (isMessage(values) && typeof values.message === "string" && values.message) return values.message;
  return "the robot refused";
}
