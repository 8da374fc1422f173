/** Diagnostics: what is wrong and why, the tree with its details, and what changed when. */
import { whyNot } from "../config";
import { isFolded, learnChanges, levelOf, problems, spansOf, treeOf, type Change, type Tree, type TreeLine } from "../diagnostics";
import { disable, emptyCard, h, icon, refill, svg } from "../dom";
import { formatAge } from "../format";
import type { Page, Robot } from "../page";
import type { Json } from "../rosbridge";
import "./diagnostics.css";

const LOOK = 500; // [ms] between two looks
const PAST = 300; // [s] that the timeline shows
const MOST = 100; // changes in the list

export const page: Page = {
  name: "diagnostics",
  title: "Diagnostics",
  order: 60,
  open(host, robot) {
    const box = h("div", { class: "diagnostics" }, emptyCard("wait", "Asking for the diagnostics\u2026"));
    host.append(box);
    let view: DiagnosticsView | null = null;
    const close = robot.link.watch(
      "diagnostics/ShowDiagnostics",
      (answer, refused) => {
        const tree = treeOf(answer);
        if (!tree) {
          view = null;
          box.replaceChildren(emptyCard("warning", refused || "This robot has no diagnostics."));
          return;
        }
        if (!view) box.replaceChildren((view = new DiagnosticsView(robot)).element);
        view.show(tree);
      },
      LOOK,
    );
    return close;
  },
};

class DiagnosticsView {
  readonly element = h("div", { class: "diagnostics-view" });
  readonly #robot: Robot;
  readonly #whyNot: string; // it may not be acknowledged by who looks at it
  readonly #head = h("section", { class: "card diagnostics-head", "aria-label": "Summary" });
  readonly #problems = h("ul", { class: "problems" });
  readonly #tree = h("ul", { class: "levels", role: "tree", "aria-label": "Groups and items" });
  readonly #details = h("section", { class: "card", "aria-label": "Details", tabindex: "-1" });
  readonly #history = h("section", { class: "card", "aria-label": "History" });
  readonly #folded = new Set<string>();
  readonly #known = new Set<string>();
  #changes: Change[] = [];
  #asked = false;
  #tree_: Tree | null = null;
  #chosen = "";

  constructor(robot: Robot) {
    this.#robot = robot;
    this.#whyNot = whyNot(robot.config, "operate");
    const summary = h("section", { class: "card", "aria-label": "Errors and warnings" }, this.#head, this.#problems);
    const tree = h("section", { class: "card", "aria-label": "Tree" }, this.#tree);
    this.element.append(h("div", {}, summary, tree), h("div", {}, this.#details, this.#history));
  }

  show(tree: Tree): void {
    this.#tree_ = tree;
    for (const line of tree.lines) {
      if (line.is_group && !this.#known.has(line.path) && line.level === 0) this.#folded.add(line.path);
      if (line.is_group && line.level > 0 && !this.#known.has(`${line.path} ${line.level}`)) this.#folded.delete(line.path);
      this.#known.add(line.path).add(`${line.path} ${line.level}`);
    }
    this.#showHead(tree);
    this.#showTree(tree);
    this.#showDetails(tree);
    void this.#learn();
  }

  #showHead(tree: Tree): void {
    const look = levelOf(tree.level);
    const found = problems(tree.lines);
    const words = found.length === 0 ? "Everything is fine" : `${look.word}: ${tree.cause || found[0]!.message}`;
    const acknowledge = h("button", { type: "button" }, icon("check"), "Acknowledge");
    disable(this.#whyNot, acknowledge);
    acknowledge.title ||= "Let levels that were latched follow the present again";
    acknowledge.onclick = () => void this.#acknowledge("");
    refill(
      this.#head,
      h("div", { role: "status" }, h("h2", { "data-kind": look.kind }, icon(look.icon), words)),
      ...(tree.level > 0 ? [acknowledge] : []),
    );
    refill(this.#problems, ...found.map((line) => h("li", { "data-key": line.path }, this.#choice(line, `${line.name}: ${line.message}`))));
  }

  #choice(line: TreeLine, words: string): HTMLElement {
    const look = levelOf(line.level);
    const button = h("button", { type: "button", class: "line", "data-kind": look.kind }, icon(look.icon), h("span", {}, words));
    button.append(h("span", { class: "level-word" }, look.word));
    button.onclick = () => {
      this.#chosen = line.path;
      this.show(this.#tree_!);
      this.#details.focus({ preventScroll: false });
    };
    return button;
  }

  #showTree(tree: Tree): void {
    const shown = tree.lines.filter(({ path }) => !isFolded(path, this.#folded));
    const rows = shown.map((line) => {
      const button = this.#choice(line, line.is_group ? line.name : `${line.name} \u2013 ${line.message}`);
      const row = h("li", { role: "treeitem", "aria-level": String(line.depth + 1), "data-key": `${line.path} ${line.is_group}` });
      row.style.setProperty("--depth", String(line.depth));
      row.setAttribute("aria-selected", String(line.path === this.#chosen));
      if (line.is_group) {
        const folded = this.#folded.has(line.path);
        row.setAttribute("aria-expanded", String(!folded));
        const fold = h("button", { type: "button", class: "fold", "aria-label": `${folded ? "Show" : "Hide"} ${line.name}` }, icon("down"));
        fold.onclick = () => {
          if (!this.#folded.delete(line.path)) this.#folded.add(line.path);
          this.#showTree(this.#tree_!);
        };
        row.append(fold);
      }
      row.append(button);
      return row;
    });
    refill(this.#tree, ...rows);
  }

  #showDetails(tree: Tree): void {
    const line = tree.lines.find(({ path }) => path === this.#chosen) ?? problems(tree.lines)[0];
    if (!line) {
      refill(this.#details, h("h2", {}, "Details"), h("p", { class: "label" }, "Choose an item of the tree."));
      this.#showHistory(tree, "");
      return;
    }
    const look = levelOf(line.level);
    const rows = line.values.map(([key, value]) => h("tr", {}, h("th", { scope: "row" }, key.replaceAll("_", " ")), h("td", {}, value)));
    const button = h("button", { type: "button", "data-key": line.path }, icon("check"), "Acknowledge this group");
    button.onclick = () => void this.#acknowledge(line.path);
    disable(this.#whyNot, button);
    refill(
      this.#details,
      h("h2", {}, line.name),
      h("p", { class: "chip", "data-kind": look.kind }, icon(look.icon), `${look.word}: ${line.message || "no message"}`),
      ...(line.hardware_id ? [h("p", { class: "label" }, `Hardware: ${line.hardware_id}`)] : []),
      h("table", {}, ...rows),
      ...(line.is_group && line.level > 0 ? [button] : []),
    );
    this.#showHistory(tree, line.path);
  }

  #showHistory(tree: Tree, path: string): void {
    const from = Math.max(0, tree.time - PAST);
    const wanted = path || "/";
    const drawing = svg("svg", { viewBox: "0 0 300 16", preserveAspectRatio: "none", class: "timeline", role: "img" });
    const level = tree.lines.find((line) => line.path === path)?.level ?? tree.level;
    const spans = spansOf(this.#changes, wanted, from, tree.time, level);
    const scale = 300 / Math.max(1, tree.time - from);
    for (const span of spans) {
      const look = levelOf(span.level);
      const bar = svg("rect", { x: String((span.from - from) * scale), y: "0", height: "16", "data-kind": look.kind });
      bar.setAttribute("width", String(Math.max(0.5, (span.to - span.from) * scale)));
      const title = svg("title");
      title.textContent = `${look.word} for ${formatAge((span.to - span.from) * 1000)} ${span.cause}`;
      bar.append(title);
      drawing.append(bar);
    }
    drawing.setAttribute("aria-label", `Level over the last ${formatAge((tree.time - from) * 1000)}`);
    const rows = this.#changes
      .filter((change) => !path || change.path === path || change.path.startsWith(`${path}/`))
      .slice(-MOST)
      .reverse()
      .map((change) => {
        const look = levelOf(change.new);
        const age = formatAge((tree.time - change.time) * 1000);
        return h("li", { "data-kind": look.kind, "data-key": String(change.number) }, h("time", {}, `${age} ago `), icon(look.icon), ` ${change.path} ${look.word} ${change.cause}`);
      });
    refill(
      this.#history,
      h("h2", {}, "History"),
      drawing,
      h("p", { class: "label" }, `The last ${formatAge((tree.time - from) * 1000)}; now is on the right`),
      rows.length > 0 ? h("ol", { class: "lines" }, ...rows) : h("p", { class: "label" }, "No level has changed."),
    );
  }

  /** Asks for the changes that are not known yet. */
  async #learn(): Promise<void> {
    if (this.#asked) return;
    this.#asked = true;
    try {
      this.#changes = await learnChanges(this.#changes, async (after) => {
        const answer: Json = await this.#robot.link.ask({ type: "diagnostics.ListChanges", after });
        return Array.isArray(answer) ? (answer as unknown as Change[]) : [];
      });
    } catch {
      // The connection is shown by the frame; the next look asks again.
    } finally {
      this.#asked = false;
    }
  }

  async #acknowledge(path: string): Promise<void> {
    try {
      this.#robot.notify(String(await this.#robot.link.ask({ type: "diagnostics.Acknowledge", path })));
    } catch (error) {
      this.#robot.notify((error as Error).message);
    }
  }
}

