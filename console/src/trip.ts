/** A drive to a pose: what was asked for, how far it is, and how it ended. It outlives the page that began it. */
import type { Pose } from "./map";
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

const NONE: TripState = { is: "none", text: "No goal yet", pose: null, frame: "", left: null };

export class Trip {
  readonly state = new Signal<TripState>(NONE);
  readonly #link: Pick<Rosbridge, "act">;
  #sent: Goal | null = null;

  constructor(link: Pick<Rosbridge, "act">) {
    this.#link = link;
  }

  /** Drives to a pose, by an action of a type; `message` is the goal. A newer trip takes the place of an older one. */
  begin(action: string, type: string, message: Message, to: { name: string; pose: Pose; frame: string }): void {
    const { name, pose, frame } = to;
    const sent = this.#link.act(action, type, message, ({ distance_remaining: left }) => {
      if (this.#sent === sent && typeof left === "number") this.state.set({ ...this.state.value, left });
    });
    this.#sent = sent;
    this.state.set({ is: "driving", text: `Driving to ${name}`, pose, frame, left: null });
    sent.done.then(
      (outcome) => this.#end(sent, endOf(outcome, name)),
      (error: Error) => this.#end(sent, failureOf(error, name)),
    );
  }

  cancel(): void {
    this.#sent?.cancel();
  }

  #end(sent: Goal, [is, text]: readonly [TripState["is"], string]): void {
    if (this.#sent !== sent) return;
    this.#sent = null;
    this.state.set({ ...NONE, is, text });
  }
}

function endOf({ status, values }: Outcome, name: string): readonly [TripState["is"], string] {
  if (status === SUCCEEDED) return ["arrived", `Arrived at ${name}`];
  if (status === CANCELED) return ["canceled", `Canceled on the way to ${name}`];
  const why = whyOf(values);
  const what = status === ABORTED ? "Gave up" : `Ended with status ${status}`;
  const words = `${what} on the way to ${name}`;
  return ["failed", why ? `${words}: ${why}` : words];
}

function failureOf(error: Error, name: string): readonly [TripState["is"], string] {
  if (!(error instanceof LostError)) return ["failed", `Refused to drive to ${name}: ${error.message}`];
  return ["unknown", `The connection was lost: whether the robot still drives to ${name}, or has arrived, is unknown`];
}

function whyOf(values: Json): string {
  if (typeof values === "string") return values;
  if (!isMessage(values)) return "";
  const why = values.error_msg || values.message;
  return typeof why === "string" ? why : "";
}
