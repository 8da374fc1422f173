/** Elements in one expression. Attributes are strings; properties and listeners are set on what this returns. */

type Child = Node | string;

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Record<string, string> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

const SVG = "http://www.w3.org/2000/svg";

/** Paths of icons, drawn with strokes in a square of 24. */
const ICONS = {
  link: "M4 12.5a11 11 0 0 1 16 0M7.5 16a6 6 0 0 1 9 0M12 20h.01",
  unlink: "M4 12.5a11 11 0 0 1 6-3.4M20 12.5a11 11 0 0 0-3-2.300M7.500 16a6 6 0 0 1 4.500-2M12 20h.01M4 4l16 16",
  wait: "M12 7v5l3 2M21 12a9 9 0 1 1-18 0 9 9 0 0 1 18 0",
  stop: "M8 3h8l5 5v8l-5 5H8l-5-5V8z",
  warning: "M12 4 2.800 20h18.400zM12 10v4M12 17h.01",
  person: "M12 12a4 4 0 1 0 0-8 4 4 0 0 0 0 8M5 20c.6-3.600 3.400-5 7-5s6.400 1.400 7 5",
  wheel:
    "M12 3v18M3 12h18M12 3 9.500 5.500M12 3l2.500 2.500M12 21l-2.500-2.500M12 21l2.500-2.500M3 12l2.500-2.500M3 12l2.500 2.500M21 12l-2.500-2.500M21 12l-2.500 2.500",
  undo: "M4 9h10a5 5 0 0 1 0 10H8M4 9l4-4M4 9l4 4",
  redo: "M20 9H10a5 5 0 0 0 0 10h6M20 9l-4-4M20 9l-4 4",
  edit: "M4 20l1-5L16 4l4 4L9 19z",
  pause: "M8 5v14M16 5v14",
  cross: "M6 6l12 12M18 6 6 18",
  skip: "M6 12h12",
  dot: "M12 11.900v.200",
  up: "M6 14.500l6-6 6 6",
  down: "M6 9.500l6 6 6-6",
  alarm: "M8 3h8l5 5v8l-5 5H8l-5-5V8zM12 8v5M12 16h.010",
  check: "M4.500 12.500l5 5 10-11",
  step: "M6 4.500v15l9-7.500zM18.500 5v14",
  play: "M7 4.500v15l12-7.500z",
} as const;

export type Icon = keyof typeof ICONS;

/** Returns a picture that stands beside the text that says the same. */
export function icon(name: Icon): SVGSVGElement {
  const path = svg("path", { d: ICONS[name] });
  return svg("svg", { viewBox: "0 0 24 24", class: "icon", "aria-hidden": "true" }, path);
}

export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Record<string, string> = {},
  ...children: Node[]
): SVGElementTagNameMap[K] {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Sets a text only if it is another, so that nothing is drawn or read out again for nothing. */
export function setText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * Makes an element have these children, but keeps its own where they are of the same kind, and of the same `data-key` if
 * they have one: a press on them, the focus and how far they are scrolled outlive it. Listeners stay those of the kept
 * ones: what a listener does must be the same for all elements of its key.
 */
export function refill(element: Element, ...wanted: Child[]): void {
  const left = [...element.childNodes];
  const children = wanted.map((child) => {
    const made = typeof child === "string" ? document.createTextNode(child) : child;
    const at = left.findIndex((own) => own.nodeName === made.nodeName && keyOf(own) === keyOf(made));
    if (at < 0) return made;
    const own = left[at]!;
    for (const gone of left.splice(0, at + 1)) if (gone !== own) gone.remove();
    if (own instanceof Element && made instanceof Element) become(own, made);
    else if (own.nodeValue !== made.nodeValue) own.nodeValue = made.nodeValue;
    return own;
  });
  for (const gone of left) gone.remove();
  children.forEach((child, at) => {
    if (element.childNodes[at] !== child) element.insertBefore(child, element.childNodes[at] ?? null);
  });
}

function become(own: Element, made: Element): void {
  if (own.isEqualNode(made)) return;
  for (const { name } of [...own.attributes]) if (!made.hasAttribute(name)) own.removeAttribute(name);
  for (const { name, value } of made.attributes) if (own.getAttribute(name) !== value) own.setAttribute(name, value);
  refill(own, ...made.childNodes);
}

function keyOf(node: Node): string | undefined {
  return node instanceof HTMLElement ? node.dataset.key : undefined;
}

/** Disables controls for a reason, which they tell; enables them if it is empty. */
export function disable(why: string, ...controls: (HTMLButtonElement | HTMLInputElement | HTMLSelectElement)[]): void {
  for (const control of controls) [control.disabled, control.title] = [why !== "", why];
}

/** Returns what a page shows in place of its content: that it is loading, empty, or what went wrong. */
export function emptyCard(picture: Icon, text: string, ...more: Child[]): HTMLElement {
  return h("section", { class: "card empty", role: "status" }, icon(picture), h("p", {}, text), ...more);
}

/**
 * Shows a form over the page, and returns what it was left with: the value of its button, empty if it was left otherwise.
 * It is not modal: STOP can be pressed meanwhile.
 */
export function askInDialog(host: HTMLElement, dialog: HTMLDialogElement): Promise<string> {
  host.append(dialog);
  return new Promise((resolve) => {
    dialog.onclose = () => {
      dialog.remove();
      resolve(dialog.returnValue);
    };
    dialog.onkeydown = (event) => {
      if (event.key === "Escape") dialog.close("");
    };
    dialog.show();
  });
}
