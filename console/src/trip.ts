/** A drive to a pose: what was asked for, how far it is, and how it ended. It outlives the page that began it. */
import type { Pose } from "./map";
import { recall, remember } from "./remembered";
import {
  ABORTED,
  CANCELED,
  isMessage,
  LostError,
  SUCCEEDED,
  type Goal,
  type Json,
  type Message,
  type Outcome,
  type Rosbridge,
} from "./rosbridge";
import { Signal } from "./signal";

export interface TripState {
  is: "none" | "driving" | "arrived" | "canceled" | "failed" | "unknown";
  text: string;
  /** Where it goes, and in which frame; null if it goes nowhere. */
  pose: Pose | null;
  frame: string;
  /** How far it still is [m]; null if the robot does not say. */
  left: number | null;
}

/** Where somebody wants to go. */
interface Destination {
  name: string;
  pose: Pose;
  frame: string;
}

const KEPT = "map.trip";
const NONE: TripState = { is: "none", text: "No goal yet", pose: null, frame: "", left: null };

export class Trip {
  readonly state = new Signal<TripState>(NONE);
  readonly #link: Pick<Rosbridge, "act" | "call">;
  #sent: Goal | null = null;
  #to: Destination | null = null; // of the newest goal
  #id = ""; // of that goal, once the robot has said it
  #known: ReadonlySet<string> = new Set(); // ids of goals that the robot has told
  #followed: { action: string; id: string } | null = null; // a goal whose end is not sent to this page

  constructor(link: Pick<Rosbridge, "act" | "call">) {
    this.#link = link;
  }

  /** Drives to a pose, by an action of a type; `message` is the goal. A newer trip takes the place of an older one. */
  begin(action: string, type: string, message: Message, to: Destination): void {
    const { name } = to;
    const sent = this.#link.act(action, type, message, ({ distance_remaining: left }) => {
      if (this.#sent === sent && typeof left === "number") this.state.set({ ...this.state.value, left });
    });
    this.#sent = sent;
    this.#followed = null;
    [this.#to, this.#id] = [to, ""];
    this.#drive();
    sent.done.then(
      (outcome) => this.#end(sent, endOf(outcome, name)),
      (error: Error) => {
        if (this.#sent !== sent) return;
        const [id, isAccepted] = [this.#id, this.#id !== "" || this.state.value.left !== null];
        this.#end(sent, failureOf(error, name, isAccepted));
        if (id && error instanceof LostError) this.#followed = { action, id };
      },
    );
  }

  cancel(): void {
    this.#sent?.cancel();
    if (!this.#followed) return;
    const { action, id } = this.#followed;
    this.#link
      .call(`${action}/_action/cancel_goal`, { goal_info: { goal_id: { uuid: id } } })
      .catch((error: Error) => this.state.set({ ...this.state.value, text: `Not canceled: ${error.message}` }));
  }

  /**
   * Takes the `action_msgs/GoalStatusArray` of the action. A goal that this browser sent is followed until it ends, also
   * after the page was loaded again or the connection was lost meanwhile.
   */
  learn(action: string, { status_list }: Message): void {
    const statuses = (Array.isArray(status_list) ? status_list : []).flatMap(readStatus);
    const running = statuses.find(({ status }) => status < SUCCEEDED);
    if (this.#sent && !this.#id && running && !this.#known.has(running.id)) {
      this.#id = running.id;
      remember(KEPT, JSON.stringify({ id: running.id, ...this.#to }));
    }
    this.#known = new Set(statuses.map(({ id }) => id));
    if (this.#followed) {
      const { id } = this.#followed;
      const status = statuses.find((each) => each.id === id)?.status;
      if (status !== undefined && status < SUCCEEDED) {
        if (this.state.value.is !== "driving") this.#drive();
        return;
      }
      this.#followed = null;
      const { name } = this.#to!;
      const [is, text] = status === undefined ? goneOf(name) : endOf({ status, values: null }, name);
      this.state.set({ ...NONE, is, text });
    } else if (running && !this.#sent && (this.state.value.is === "none" || this.state.value.is === "unknown")) {
      const kept = keptOf(running.id);
      if (!kept) return;
      this.#to = kept;
      this.#followed = { action, id: running.id };
      this.#drive();
    } else if (!running && this.state.value.is === "unknown") {
      this.state.set({ ...this.state.value, text: goneOf(this.#to!.name)[1] });
    }
  }

  #drive(): void {
    const { name, pose, frame } = this.#to!;
    this.state.set({ is: "driving", text: `Driving to ${name}`, pose, frame, left: null });
  }

  #end(sent: Goal, [is, text]: readonly [TripState["is"], string]): void {
    if (this.#sent !== sent) return;
    this.#sent = null;
    this.state.set({ ...NONE, is, text });
  }
}

function readStatus(message: Json): { id: string; status: number }[] {
  const info = isMessage(message) ? message.goal_info : null;
  if (!isMessage(message) || !isMessage(info) || !isMessage(info.goal_id)) return [];
  return [{ id: String(info.goal_id.uuid), status: Number(message.status) }];
}

/** Returns where a goal goes, if this browser sent it. */
function keptOf(id: string): Destination | null {
  const kept = recall(KEPT);
  const read = kept === null ? null : (JSON.parse(kept) as Destination & { id: string });
  return read?.id === id ? read : null;
}

function endOf({ status, values }: Outcome, name: string): readonly [TripState["is"], string] {
  if (status === SUCCEEDED) return ["arrived", `Arrived at ${name}`];
  if (status === CANCELED) return ["canceled", `Canceled on the way to ${name}`];
  const why = whyOf(values);
  const what = status === ABORTED ? "Gave up" : `Ended with status ${status}`;
  const words = `${what} on the way to ${name}`;
  return ["failed", why ? `${words}: ${why}` : words];
}

function failureOf(error: Error, name: string, isAccepted: boolean): readonly [TripState["is"], string] {
  const what = isAccepted ? "No longer drives" : "Refused to drive";
  if (!(error instanceof LostError)) return ["failed", `${what} to ${name}: ${error.message}`];
  return ["unknown", `The connection was lost: whether the robot still drives to ${name}, or has arrived, is unknown`];
}

function goneOf(name: string): readonly [TripState["is"], string] {
  return ["unknown", `The robot no longer drives to ${name}; whether it has arrived is unknown`];
}

function whyOf(values: Json): string {
  if (typeof values === "string") return values;
  if (!isMessage(values)) return "";
  const why = values.error_msg || values.message;
  return typeof why === "string" ? why : "";
}
