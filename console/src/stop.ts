/** STOP and RELEASE: what is known of them, and the two buttons that stand on every page and need no lease. */
import { whyNot, type Config } from "./config";
import { disable, h, icon, setText } from "./dom";
import type { Robot } from "./page";
import { CallError, isMessage, UnansweredError, type Message, type Rosbridge } from "./rosbridge";
import { Signal } from "./signal";

/** What is known of a stop. `sent` has no answer yet, `owed` got none, so that it is sent until there is one. */
export type StopState = { is: "free" | "sent" } | { is: "stopped"; by: string } | { is: "owed" | "refused"; why: string };

const FREE: StopState = { is: "free" };

/** The stop of a robot, as it shows it and as a person here asks for it: only the robot says that it is stopped. */
export class Stop {
  readonly state = new Signal<StopState>(FREE);
  readonly #link: Rosbridge;
  #by = ""; // who stopped the robot, as it says itself
  #newest = 0; // what a person pressed last: answers to what was before mean nothing

  constructor(link: Rosbridge) {
    this.#link = link;
    link.watch("robot/RobotStatus", (status) => isMessage(status) && this.#see(status));
    link.state.watch(({ is }) => is === "open" && this.state.value.is === "owed" && void this.press());
  }

  /** Stops the robot; as long as it does not answer, now or as soon as there is a connection. */
  async press(): Promise<void> {
    const number = ++this.#newest;
    const answer = ask(this.#link, "/console/stop"); // before all that follows from it
    if (this.state.value.is !== "owed") this.state.set({ is: "sent" });
    try {
      await answer;
      if (number === this.#newest) this.state.set({ is: "stopped", by: this.#by });
    } catch (error) {
      if (number !== this.#newest || this.state.value.is === "stopped") return;
      const isOwed = error instanceof UnansweredError;
      this.state.set({ is: isOwed ? "owed" : "refused", why: (error as Error).message });
      if (isOwed && this.#link.state.value.is === "open") void this.press();
    }
  }

  /** Allows motion again, and sends no stop that is owed. Throws a CallError if the robot stays stopped. */
  async release(): Promise<void> {
    this.#newest += 1;
    if (this.state.value.is !== "stopped") this.dismiss();
    try {
      await ask(this.#link, "/console/release");
      this.#by = "";
      this.dismiss();
    } catch (error) {
      if (this.state.value.is === "stopped") throw error;
    }
  }

  /** Shows the robot as it shows itself. */
  dismiss(): void {
    this.state.set(this.#by ? { is: "stopped", by: this.#by } : FREE);
  }

  #see({ stop }: Message): void {
    this.#by = isMessage(stop) ? String(stop.by) : "";
    if (this.#by || this.state.value.is === "stopped") this.dismiss();
  }
}

/** Returns the line that says what is known of a stop; it stays until the robot stands or a person takes note. */
export function stopBanner(config: Config, stop: Stop): HTMLElement {
  const message = h("p", { role: "alert" });
  const noted = h("button", { type: "button" }, "Dismiss");
  noted.onclick = () => stop.dismiss();
  const banner = h("div", { class: "banner stopped" }, icon("stop"), message, noted);
  stop.state.watch((state) => {
    banner.hidden = state.is === "free";
    noted.hidden = state.is !== "refused";
    setText(message, wordsOf(state, whyNot(config, "operate") ? "somebody with the role operate presses" : "you press"));
  });
  return banner;
}

/** Returns what a person should know of a stop; `press` says who may press Release. */
export function wordsOf(state: StopState, press = "you press"): string {
  switch (state.is) {
    case "free":
      return "";
    case "sent":
      return "STOP is being sent.";
    case "stopped":
      return `Stopped${state.by ? ` by ${state.by}` : ""}. Nothing moves until ${press} Release.`;
    case "owed":
      return `STOP has not arrived: ${state.why}. It is sent again until the robot answers. Use the switch on the robot.`;
    case "refused":
      return `STOP failed: ${state.why}. Use the switch on the robot.`;
  }
}

/** Returns the buttons. */
export function stopButtons({ config, stopped, notify }: Robot, emergency: Stop): HTMLElement {
  const stop = h("button", { type: "button", class: "stop", "aria-keyshortcuts": "Space" }, icon("stop"), "STOP");
  const release = h("button", { type: "button", class: "release" }, icon("play"), "Release");
  disable(whyNot(config, "operate"), release);

  stop.onclick = () => void emergency.press();
  release.onclick = async () => {
    release.disabled = true;
    try {
      await emergency.release();
      const focused = document.activeElement; // not taken away from where somebody types meanwhile
      if (focused === null || focused === document.body || focused === release) stop.focus();
    } catch (error) {
      notify(`The robot stays stopped: ${(error as Error).message}.`);
    } finally {
      release.disabled = false;
    }
  };
  stopped.watch((value) => (release.hidden = !value));
  let isReached = false; // by keys, whatever has the focus
  const isStop = (event: KeyboardEvent) => {
    const focused = event.composedPath()[0] as HTMLElement;
    return event.code === "Space" && (focused === stop || !takesSpace(focused, isReached && !event.shiftKey));
  };
  const onKey = (event: KeyboardEvent) => {
    if (event.key === "Tab") isReached = true;
    if (!isStop(event)) return;
    event.preventDefault(); // also of repeats and of the end, with which browsers press a button
    if (event.type === "keydown" && !event.repeat) void emergency.press();
  };
  window.addEventListener("keydown", onKey, true);
  window.addEventListener("keyup", onKey, true);
  window.addEventListener("pointerdown", () => (isReached = false), true);
  return h("section", { class: "stops", "aria-label": "Emergency" }, release, stop);
}

const PRESSED = new Set(["button", "checkbox", "color", "file", "image", "radio", "reset", "select", "submit", "summary"]);

/**
 * Returns whether Space means something else there: in a text, and on a control that it presses, if keys brought the
 * focus there. A control that was clicked keeps the focus: whoever then hits Space in need does not mean it. Shift drives.
 */
export function takesSpace(focused: Partial<HTMLInputElement>, isReached: boolean): boolean {
  const { localName = "", type = "", isContentEditable = false } = focused;
  const kind = localName === "input" ? type : localName;
  if (PRESSED.has(kind)) return isReached;
  return isContentEditable || localName === "textarea" || (localName === "input" && kind !== "range");
}

/** Calls a service that may answer that it did not succeed: unlike a request, STOP needs no supervisor. */
async function ask(link: Rosbridge, service: string): Promise<void> {
  const values = await link.call(service);
  if (isMessage(values) && values.success === false) throw new CallError(String(values.message || "the robot refused"));
}
