/** What the robot and its components have reported since it came up, and what they report while one looks. */
import type { Robot } from "./page";
import { isMessage } from "./rosbridge";

const LOOK = 500; // [ms]

/** What `check` found before the robot came up. */
export interface Finding {
  code: string;
  severity: string;
  message: string;
  file: string | null;
  line: number | null;
  column: number | null;
  help: string;
}

export interface LogLine {
  time: number;
  level: string;
  source: string;
  text: string;
  detail?: string;
}

export interface LogNews {
  lines: LogLine[];
  isNew: boolean; // the robot came up again: what was reported before is gone
  findings: Finding[] | null; // with the first answer
}

export class LogTail {
  readonly #robot: Robot;
  readonly #show: (news: LogNews) => void;
  readonly #fail: (reason: string) => void;
  readonly #timer: ReturnType<typeof setInterval>;
  #after = 0;
  #paused = false;
  #asking = false;

  constructor(robot: Robot, show: (news: LogNews) => void, fail: (reason: string) => void) {
    this.#robot = robot;
    this.#show = show;
    this.#fail = fail;
    this.#timer = setInterval(() => void this.#read(), LOOK);
    void this.#read();
  }

  close(): void {
    clearInterval(this.#timer);
  }

  get isPaused(): boolean {
    return this.#paused;
  }

  set isPaused(paused: boolean) {
    this.#paused = paused;
    void this.#read();
  }

  async #read(): Promise<void> {
    if (this.#paused || this.#asking || this.#robot.link.state.value.is !== "open") return;
    this.#asking = true;
    try {
      const values = await this.#robot.link.call("/console/log", { after: this.#after });
      const answer = isMessage(values) ? (values.answer ?? null) : null;
      if (!isMessage(answer) || !Array.isArray(answer.records)) throw new Error(isMessage(values) ? String(values.message) : "no answer");
      const [after, findings] = [Number(answer.after), Array.isArray(answer.findings) ? (answer.findings as unknown as Finding[]) : null];
      const isNew = after < this.#after;
      this.#after = after;
      this.#show({ lines: answer.records as unknown as LogLine[], isNew, findings });
    } catch (error) {
      this.#fail((error as Error).message);
    } finally {
      this.#asking = false;
    }
  }
}
