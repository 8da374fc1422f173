/** What starts missions by itself: what it waits for, when it comes next, and what came of it last. */
import { h, icon } from "./dom";
import { formatName } from "./format";

export interface Trigger {
  name: string;
  mission: string;
  cause: string;
  priority: number;
  running: string;
  next: string;
  waits: boolean;
  fired: string;
  came: string;
  off: string;
}

const IF_RUNNING: Record<string, string> = {
  skip: "left out if another mission is in the way",
  queue: "waits if another mission is in the way",
  interrupt: "ends missions that are in the way",
};

/** Returns what a trigger does next. */
export function nextText({ off, waits, next }: Trigger): string {
  if (off) return `Off: ${off}`;
  if (waits) return "Waits for its turn";
  return next ? `On; next: ${next}` : "On";
}

/** Returns what came of a trigger when it last fired. */
export function lastText({ fired, came }: Trigger): string {
  return fired ? `Last fired ${fired}: ${came}` : "Has not fired since the robot came up";
}

/** Shows the triggers of a robot; nothing if it has none. */
export class TriggerList {
  readonly element = h("section", { class: "card triggers", "aria-label": "Triggers" }, h("h2", {}, "What starts missions"));
  readonly #items = h("ul", {});

  constructor() {
    this.element.append(this.#items);
    this.element.hidden = true;
  }

  show(triggers: Trigger[]): void {
    this.element.hidden = triggers.length === 0;
    this.#items.replaceChildren(...triggers.map(item));
  }
}

function item(one: Trigger): HTMLElement {
  const priority = one.priority ? `; priority ${one.priority}` : "";
  const isWrong = one.came.startsWith("not started");
  return h(
    "li",
    { "data-off": one.off ? "yes" : "" },
    h("p", {}, h("strong", {}, formatName(one.name)), ` starts ${formatName(one.mission)} ${one.cause}`),
    h("p", { class: "label" }, `${nextText(one)}; ${IF_RUNNING[one.running] ?? one.running}${priority}.`),
    h("p", { class: "label" }, ...(isWrong ? [icon("warning")] : []), h("span", {}, `${lastText(one)}.`)),
  );
}
