/** Log: what the robot and its components report, live, with filters. */
import { emptyCard, h, icon, setText } from "../dom";
import { type Finding, type LogLine, type LogNews, LogTail } from "../log_tail";
import type { Page, Robot } from "../page";
import "./log.css";

const MOST = 1_000; // lines that are kept

const PICTURES = { info: "dot", warning: "warning", error: "alarm" } as const;
const WORDS: Record<string, string> = { info: "Info", warning: "Warning", error: "Error" };
const RANK: Record<string, number> = { info: 0, warning: 1, error: 2 };

export const page: Page = {
  name: "log",
  title: "Log",
  order: 90,
  open(host, robot) {
    const view = new LogView(robot);
    host.append(view.element);
    return () => view.close();
  },
};

class LogView {
  readonly element = h("div", { class: "log" });
  readonly #robot: Robot;
  readonly #filter = h("input", { type: "search", "aria-label": "Find in the log", placeholder: "Find in the log" });
  readonly #level = h(
    "select",
    { "aria-label": "Level" },
    h("option", { value: "0" }, "Everything"),
    h("option", { value: "1" }, "Warnings and errors"),
    h("option", { value: "2" }, "Errors"),
  );
  readonly #source = h("select", { "aria-label": "Component" }, h("option", { value: "" }, "All components"));
  readonly #pause = h("button", { type: "button" }, icon("pause"), "Pause");
  readonly #list = h("ol", { class: "lines log-lines" });
  readonly #findings = h("section", { class: "card findings", "aria-label": "Findings of check", hidden: "" });
  readonly #empty = emptyCard("wait", "Reading the log\u2026");
  readonly #tail: LogTail;
  #lines: LogLine[] = [];

  constructor(robot: Robot) {
    this.#robot = robot;
    const save = h("button", { type: "button" }, icon("down"), "Download");
    save.onclick = () => this.#download();
    this.#pause.onclick = () => {
      const paused = (this.#tail.isPaused = !this.#tail.isPaused);
      this.#pause.replaceChildren(icon(paused ? "play" : "pause"), paused ? "Go on" : "Pause");
    };
    for (const control of [this.#filter, this.#level, this.#source]) control.oninput = () => this.#show();
    const bar = h("div", { class: "log-bar" }, this.#filter, this.#level, this.#source, this.#pause, save);
    this.element.append(this.#findings, bar, this.#empty, h("section", { class: "card", "aria-label": "Log, the newest first", tabindex: "0" }, this.#list));
    this.#tail = new LogTail(
      robot,
      (news) => this.#tell(news),
      (reason) => setText(this.#empty.querySelector("p")!, reason),
    );
  }

  close(): void {
    this.#tail.close();
  }

  #tell({ lines, isNew, findings }: LogNews): void {
    if (findings) this.#check(findings);
    if (isNew) this.#lines = [];
    if (isNew || lines.length > 0) this.#add(lines);
    if (this.#lines.length === 0) setText(this.#empty.querySelector("p")!, "Nothing has been reported yet.");
  }

  #check(findings: Finding[]): void {
    this.#findings.hidden = findings.length === 0;
    const rows = findings.map(({ code, severity, message, file, line, column, help }) => {
      const kind = severity === "error" ? "bad" : severity === "warning" ? "fair" : "none";
      const words = h("div", {}, h("strong", {}, message), h("p", { class: "label" }, [file ? `${file}:${line}:${column}` : "", code].filter(Boolean).join(" ")));
      if (help) words.append(h("p", {}, help));
      return h("li", { "data-kind": kind }, icon(kind === "bad" ? "alarm" : "warning"), words);
    });
    const count = `${findings.length} ${findings.length === 1 ? "finding" : "findings"} of check, before the robot came up`;
    this.#findings.replaceChildren(h("details", {}, h("summary", {}, count), h("ul", {}, ...rows)));
  }

  #add(lines: LogLine[]): void {
    this.#lines = [...this.#lines, ...lines].slice(-MOST);
    const sources = new Set(this.#lines.map(({ source }) => source));
    const known = new Set([...this.#source.options].map(({ value }) => value));
    for (const source of [...sources].sort()) if (!known.has(source)) this.#source.append(h("option", { value: source }, source));
    this.#show();
  }

  get #shown(): LogLine[] {
    const [wanted, least, source] = [this.#filter.value.trim().toLowerCase(), Number(this.#level.value), this.#source.value];
    return this.#lines.filter(
      (line) =>
        (RANK[line.level] ?? 0) >= least &&
        (!source || line.source === source) &&
        (!wanted || `${line.source} ${line.text} ${line.detail ?? ""}`.toLowerCase().includes(wanted)),
    );
  }

  #show(): void {
    this.#empty.hidden = this.#lines.length > 0;
    const rows = this.#shown.reverse().map(({ time, level, source, text, detail }) => {
      const kind = { info: "none", warning: "fair", error: "bad" }[level] ?? "none";
      const mark = h("span", { class: "log-level", "data-kind": kind }, icon(PICTURES[level as keyof typeof PICTURES] ?? "dot"), WORDS[level] ?? level);
      const row = h("li", {}, h("time", {}, time.toFixed(2)), mark, h("span", { class: "label" }, source), h("span", {}, text));
      if (detail) row.append(h("details", {}, h("summary", {}, "Details"), h("pre", {}, detail)));
      return row;
    });
    this.#list.replaceChildren(...rows);
  }

  #download(): void {
    const text = this.#shown.map(({ time, level, source, text, detail }) => `${time.toFixed(2)} ${level} ${source}: ${text}${detail ? `\n${detail}` : ""}`).join("\n");
    const link = h("a", { href: URL.createObjectURL(new Blob([`${text}\n`], { type: "text/plain" })), download: `${this.#robot.config.robot}.log` });
    link.click();
    URL.revokeObjectURL(link.href);
  }
}
