/** What stands around every page: the robot's name, the connection, tabs, STOP, and what went wrong. */
import { fetchConfig, LockedError, logIn, tokenOf, type Config } from "./config";
import { h, icon, setText } from "./dom";
import { formatAge } from "./format";
import { pages as allPages, type Robot } from "./page";
import type { LinkState, Rosbridge } from "./rosbridge";
import { Signal } from "./signal";
import { Stop, stopBanner, stopButtons } from "./stop";

const NOTICE = 6_000; // [ms] for which a notice is shown
const BUSY = ".editor-bar, dialog[open], .lease[data-kind='mine']"; // where a page that begins anew takes work away

/** Shows a screen without a robot: loading, or an error with a button to try again. */
export function showState(kind: "loading" | "error", text: string, retry?: () => void): void {
  const children: Node[] = [
    icon(kind === "loading" ? "wait" : "warning"),
    h("p", { role: kind === "error" ? "alert" : "status" }, text),
  ];
  if (retry) {
    const button = h("button", { type: "button" }, "Try again");
    button.onclick = retry;
    children.push(button);
  }
  document.body.replaceChildren(h("main", { class: `state ${kind}` }, h("h1", {}, "Robot console"), ...children));
}

/** Shows where a visitor says who they are; `enter` takes the link or its token, and throws an error that says why not. */
export function showDoor(text: string, enter: (given: string) => Promise<void>): void {
  const input = h("input", { id: "token", type: "password", autocomplete: "off", required: "" });
  const says = h("p", { role: "alert" }, text);
  const button = h("button", {}, "Open");
  const form = h("form", { class: "door" }, h("label", { for: "token" }, "The link, or its token"), input, button);
  const help = h("p", { class: "label" }, "On the robot, `rbxcompose console` prints the link, with a code for the camera of a phone.");
  form.onsubmit = (event) => {
    event.preventDefault();
    button.disabled = true;
    enter(input.value.trim())
      .catch((error: Error) => setText(says, error.message))
      .finally(() => (button.disabled = false));
  };
  document.body.replaceChildren(h("main", { class: "state" }, h("h1", {}, "Robot console"), icon("person"), says, form, help));
  input.focus();
}

/** Shows the frame with the page that the address names, else the first one of the robot. */
export function showFrame(config: Config, link: Rosbridge): void {
  const notice = h("div", { class: "notice", role: "status" });
  let timer: ReturnType<typeof setTimeout> | undefined;
  const robot: Robot = {
    config,
    link,
    stopped: new Signal(false),
    notify: (text) => {
      clearTimeout(timer);
      setText(notice, text);
      timer = setTimeout(() => setText(notice, ""), NOTICE);
    },
  };
  const title = h("h1", {}, config.robot);
  const tabs = h("nav", { "aria-label": "Pages" });
  const bar = h("header", {}, h("div", { class: "who" }, title, h("p", {}, config.about)), connection(link, config.role));
  const stop = new Stop(link);
  stop.state.watch(({ is }) => robot.stopped.set(is !== "free" && is !== "refused"));
  const host = h("main", { id: "page" });
  document.body.replaceChildren(bar, stopButtons(robot, stop), tabs, lostBanner(link), stopBanner(config, stop), host, notice);
  link.state.watch((state) => document.body.classList.toggle("offline", state.is !== "open"));
  followConfig(robot, stop, route(host, tabs, robot));
}

/** Lets the page follow what the robot says about itself: it may have been restarted or changed, and its links renewed. */
function followConfig(robot: Robot, stop: Stop, open: () => void): void {
  const { config, link, notify } = robot;
  let isOutdated = false;
  let behindDoor: Node[] | null = null;
  const isUnsaved = () => !window.dispatchEvent(new Event("beforeunload", { cancelable: true }));
  const isAnswered = () => ["free", "stopped"].includes(stop.state.value.is);
  const renew = () => {
    if (!isOutdated || document.querySelector(BUSY)) return;
    if (isUnsaved()) open();
    else if (isAnswered()) location.reload(); // else somebody waits for its answer
  };
  const leave = (other: string) => {
    link.close(); // what is done here was meant for this robot
    isOutdated = true;
    if (!isUnsaved() && isAnswered()) return location.reload();
    const words = `Robot ${other} answers here now, not ${config.robot}: nothing that you do here reaches a robot. Reload the page for ${other}.`;
    document.querySelector("header")!.after(h("div", { class: "banner lost" }, icon("unlink"), h("p", { role: "alert" }, words)));
  };
  const look = async () => {
    try {
      const now = await fetchConfig();
      if (behindDoor) document.body.replaceChildren(...behindDoor);
      behindDoor = null;
      if (now.robot !== config.robot) return leave(now.robot);
      if (JSON.stringify(now) === JSON.stringify(config)) return;
      isOutdated = true;
      Object.assign(config, now);
      renew();
    } catch (error) {
      const { message } = error as Error;
      if (!(error instanceof LockedError)) return notify(message);
      if (behindDoor) return;
      behindDoor = [...document.body.childNodes]; // with what is typed there
      showDoor("The robot does not know you any more: its links may have been renewed.", async (given) => {
        await logIn(tokenOf(given) || given);
        link.reconnect();
      });
    }
  };
  let wasLost = false;
  link.state.watch(({ is }) => {
    if (is === "open" && wasLost) void look();
    wasLost ||= is === "lost";
  });
  link.watch("config", () => void look());
  stop.state.watch(renew);
  window.addEventListener("hashchange", () => (isOutdated && !isUnsaved() ? location.reload() : open()));
}

/** Fills the tabs, and returns what opens the page that the address names. */
function route(host: HTMLElement, tabs: HTMLElement, robot: Robot): () => void {
  const wanted = robot.config.pages;
  const pages = allPages.filter((page) => (page.isFor?.(robot) ?? true) && (wanted.length === 0 || wanted.includes(page.name)));
  if (wanted.length > 0) pages.sort((a, b) => wanted.indexOf(a.name) - wanted.indexOf(b.name));
  const links = pages.map((page) => h("a", { href: `./#${page.name}` }, page.title));
  tabs.append(...links);
  let close = () => undefined as void;
  const open = () => {
    const names = [location.hash.slice(1), robot.config.firstPage];
    const turn = names.map((name) => pages.findIndex((page) => page.name === name)).find((at) => at >= 0) ?? 0;
    const page = pages[turn];
    close();
    host.replaceChildren();
    if (!page) return;
    links.forEach((link, at) =>
      at === turn ? link.setAttribute("aria-current", "page") : link.removeAttribute("aria-current"),
    );
    links[turn]!.scrollIntoView({ block: "nearest", inline: "nearest" });
    document.title = `${page.title} \u00b7 ${robot.config.robot}`;
    close = page.open(host, robot);
  };
  open();
  return open;
}

function connection(link: Rosbridge, role: string): HTMLElement {
  const looksOnly = role === "view";
  const box = h("p", { class: "connection", role: "status" });
  const words: Record<LinkState["is"], string> = {
    connecting: "Connecting",
    open: "Connected",
    lost: "Not connected",
    closed: "Not connected",
  };
  link.state.watch((state) => {
    box.dataset.state = state.is;
    const picture = { connecting: "wait", open: "link", lost: "unlink", closed: "unlink" } as const;
    const word = state.is === "open" && looksOnly ? "Connected, to look only" : words[state.is];
    box.replaceChildren(icon(picture[state.is]), h("span", {}, word));
  });
  return box;
}

function lostBanner(link: Rosbridge): HTMLElement {
  const text = h("span", { "aria-hidden": "true" });
  const button = h("button", { type: "button" }, "Try now");
  const message = h("span", { role: "alert" });
  const banner = h("div", { class: "banner lost" }, icon("unlink"), h("p", {}, message, text), button);
  button.onclick = () => link.connect();
  let lost = false;
  const show = () => {
    const state = link.state.value;
    if (state.is === "open") lost = false;
    if (state.is === "lost") lost = true;
    banner.hidden = !lost;
    setText(message, lost ? "Connection lost. The robot stops whoever drives by hand; missions and goals go on. " : "");
    setText(
      text,
      state.is === "lost"
        ? `Next attempt in ${formatAge(Math.max(1_000, state.retry - Date.now()))}.`
        : "Connecting\u2026",
    );
    button.disabled = state.is !== "lost";
  };
  link.state.watch(show);
  setInterval(show, 500);
  return banner;
}
