/** STOP and RELEASE: the two buttons that stand on every page and need no lease. */
import { whyNot } from "./config";
import { disable, h, icon } from "./dom";
import type { Robot } from "./page";
import { CallError, isMessage, type Rosbridge } from "./rosbridge";

/** Returns the buttons. A STOP without a connection is sent as soon as there is one again. */
export function stopButtons({ config, link, stopped, notify }: Robot): HTMLElement {
  let owed = false;
  const stop = h("button", { type: "button", class: "stop", "aria-keyshortcuts": "Space" }, icon("stop"), "STOP");
  const release = h("button", { type: "button", class: "release" }, icon("play"), "Release");
  disable(whyNot(config, "operate"), release);

  const sendStop = async () => {
    const answer = ask(link, "/console/stop"); // before all that follows from it
    stopped.set(true);
    owed = link.state.value.is !== "open";
    try {
      await answer;
    } catch (error) {
      owed ||= link.state.value.is !== "open";
      if (owed) notify("Not connected: the robot stops by itself. STOP is sent when the connection is back.");
      else notify(`STOP failed: ${(error as Error).message}. Use the switch on the robot.`);
    }
  };
  stop.onclick = () => void sendStop();
  release.onclick = async () => {
    release.disabled = true;
    try {
      await ask(link, "/console/release");
      owed = false;
      const focused = document.activeElement; // not taken away from where somebody types meanwhile
      stopped.set(false);
      if (focused === null || focused === document.body || focused === release) stop.focus();
    } catch (error) {
      notify(`The robot stays stopped: ${(error as Error).message}.`);
    } finally {
      release.disabled = false;
    }
  };
  stopped.watch((value) => (release.hidden = !value));
  link.state.watch((state) => {
    if (state.is === "open" && owed) void sendStop();
  });
  let isReached = false; // by keys, whatever has the focus
  const isStop = (event: KeyboardEvent) => {
    const focused = event.composedPath()[0] as HTMLElement;
    return event.code === "Space" && (focused === stop || !takesSpace(focused, isReached && !event.shiftKey));
  };
  const onKey = (event: KeyboardEvent) => {
    if (event.key === "Tab") isReached = true;
    if (!isStop(event)) return;
    event.preventDefault(); // also of repeats and of the end, with which browsers press a button
    if (event.type === "keydown" && !event.repeat) void sendStop();
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
