/** STOP and RELEASE: the two buttons that stand on every page and need no lease. */
import { h, icon } from "./dom";
import { CallError, isMessage, type Rosbridge } from "./rosbridge";
import type { Signal } from "./signal";

/** Returns the buttons. A STOP without a connection is sent as soon as there is one again. */
export function stopButtons(link: Rosbridge, stopped: Signal<boolean>, notify: (text: string) => void): HTMLElement {
  let owed = false;
  const stop = h("button", { type: "button", class: "stop", "aria-keyshortcuts": "Space" }, icon("stop"), "STOP");
  const release = h("button", { type: "button", class: "release" }, icon("play"), "Release");

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
  window.addEventListener("keydown", (event) => {
    if (event.code !== "Space" || event.repeat || event.composedPath().some(takesSpace)) return;
    event.preventDefault();
    void sendStop();
  });
  return h("section", { class: "stops", "aria-label": "Emergency" }, release, stop);
}

/** Returns whether Space means something else there: a control, or a text that is edited, also below a root of its own. */
function takesSpace(target: EventTarget): boolean {
  return target instanceof HTMLElement && (target.isContentEditable || target.matches("a, button, input, select, textarea"));
}

/** Calls a service that may answer that it did not succeed: unlike a request, STOP needs no supervisor. */
async function ask(link: Rosbridge, service: string): Promise<void> {
  const values = await link.call(service);
  if (isMessage(values) && values.success === false) throw new CallError(String(values.message || "the robot refused"));
}
