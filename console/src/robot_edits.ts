/** Changes of the robot that nobody has saved: a list that the robot's editor applies to what is on disk. */
import { RefusedError, type Elsewhere } from "./edited";
import { isMessage, LostError, type Json, type Message, type Rosbridge } from "./rosbridge";
import { Signal } from "./signal";

/** One change of an entry of a section, such as `["places", "dock"]`. */
export type RobotChange = Message & {
  op: "add" | "set" | "rename" | "remove";
  path: [section: string, name: string];
  values?: Message;
  name?: string;
};

/** What is wrong with the robot; `is_new` if only the changes brought it. */
export interface RobotFound extends Elsewhere {
  is_new: boolean;
}

/** Where an entry stands, and why it cannot be changed there, if it cannot. */
export interface Entry {
  name: string;
  file: string;
  why_not: string;
}

/** The robot with some changes. */
export interface EditedRobot<E extends Entry> {
  entries: E[];
  hashes: Message;
  file: string;
  /** Why nothing can be added. */
  why_not: string;
  findings: RobotFound[];
  errors: number;
  count: number;
}

/** What would be saved. */
export interface SaveTrial {
  diff: string[];
  findings: RobotFound[];
  errors: number;
  count: number;
}

const PATIENCE = 95_000; // [ms]: the whole robot is compiled with each change
const NONE: readonly RobotChange[] = [];

export async function askRobotEditor<T>(link: Rosbridge, what: string, given: Message): Promise<T> {
  const values = await link.call(`/console/robot/${what}`, given, PATIENCE);
  if (!isMessage(values) || values.success !== true) {
    throw new RefusedError(isMessage(values) ? String(values.message) : "the robot gave no answer");
  }
  return (values.answer ?? null) as Json as unknown as T;
}

/** Returns a list of changes with one more; small steps of one entry become one change. */
export function withChange(changes: readonly RobotChange[], change: RobotChange, isStep = false): readonly RobotChange[] {
  const last = changes.at(-1);
  if (isStep && last?.op === "set" && change.op === "set" && String(last.path) === String(change.path)) {
    return [...changes.slice(0, -1), { ...last, values: { ...last.values, ...change.values } }];
  }
  return [...changes, change];
}

/** Edits one section of the robot. It lives as long as the page is open, so that nothing is lost by looking elsewhere. */
export class RobotEdits<E extends Entry> {
  /** The robot with the changes; null until it was read. */
  readonly robot = new Signal<EditedRobot<E> | null>(null);
  /** What a person is told last. */
  readonly says = new Signal("");
  /** Whether the files are others than those that were read. */
  readonly isStale = new Signal(false);
  readonly subject: string;
  readonly #link: Rosbridge;
  #wanted: readonly RobotChange[] = NONE;
  #accepted: readonly RobotChange[] | null = null;
  #shown: readonly RobotChange[] | null = null;
  #undone: readonly RobotChange[] = NONE;
  #wasStep = false;
  #asking: Promise<void> | null = null;
  #before: string | null = null; // hashes of the files when a save was lost on its way

  constructor(link: Rosbridge, subject: string) {
    [this.#link, this.subject] = [link, subject];
    link.state.watch(({ is }) => void (is === "open" && this.#before !== null && this.#learnSaved()));
  }

  get changes(): readonly RobotChange[] {
    return this.#wanted;
  }

  get canUndo(): boolean {
    return this.#wanted.length > 0;
  }

  get canRedo(): boolean {
    return this.#undone.length > 0;
  }

  /** Reads the robot, or asks what was not answered, unless all that was done. */
  open(): Promise<void> {
    return this.#shown === this.#wanted ? Promise.resolve() : this.#ask();
  }

  /** Makes a change; a small step goes with the one before it. Resolves to whether the robot has accepted it. */
  async change(change: RobotChange, isStep = false): Promise<boolean> {
    const wanted = withChange(this.#wanted, change, isStep && this.#wasStep);
    [this.#wanted, this.#undone, this.#wasStep] = [wanted, NONE, isStep];
    await this.#ask();
    return this.#accepted === wanted || this.#accepted?.includes(wanted.at(-1)!) === true;
  }

  undo(): Promise<void> {
    return this.#turn(this.#wanted.slice(0, -1), [...this.#undone, ...this.#wanted.slice(-1)]);
  }

  redo(): Promise<void> {
    return this.#turn([...this.#wanted, ...this.#undone.slice(-1)], this.#undone.slice(0, -1));
  }

  /** Reads the files as they are now, and makes the changes to them. */
  async reload(): Promise<void> {
    this.isStale.set(false);
    const kept = this.robot.value;
    this.robot.set(kept && { ...kept, hashes: {} });
    this.#accepted = this.#shown = null;
    await this.#ask();
    if (this.#accepted === null && !this.isStale.value) {
      const why = this.says.value;
      await this.#turn(NONE, [...this.#wanted].reverse());
      this.says.set(`Your changes do not fit the file any more: ${why}`);
    } else this.says.set("These are the files as they are on disk, with your changes.");
  }

  /** Returns what would be saved, or null if it cannot be. */
  async compare(): Promise<SaveTrial | null> {
    await this.#asking;
    try {
      return await askRobotEditor<SaveTrial>(this.#link, "save", { ...this.#given(this.#wanted), dry_run: true });
    } catch (error) {
      this.#failed(error as Error, "Not saved: ");
      return null;
    }
  }

  async save(): Promise<void> {
    const given = this.#given(this.#wanted);
    this.says.set("Saving\u2026");
    try {
      const { files } = await askRobotEditor<{ files: string[] }>(this.#link, "save", given);
      await this.#restart();
      this.says.set(`Saved in ${files.join(", ")}.`);
    } catch (error) {
      if (error instanceof LostError) {
        this.#before = JSON.stringify(given.hashes);
        this.says.set("The connection was lost: whether it was saved is known when it is back.");
      } else this.#failed(error as Error, "Not saved: ");
    }
  }

  #given(changes: readonly RobotChange[]): Message {
    return { subject: this.subject, changes: [...changes], hashes: this.robot.value?.hashes ?? {} };
  }

  #turn(wanted: readonly RobotChange[], undone: readonly RobotChange[]): Promise<void> {
    [this.#wanted, this.#undone, this.#wasStep] = [wanted, undone, false];
    return this.#ask();
  }

  #restart(): Promise<void> {
    [this.#wanted, this.#undone, this.#wasStep] = [NONE, NONE, false];
    this.#accepted = this.#shown = null;
    const kept = this.robot.value;
    if (kept) this.robot.set({ ...kept, hashes: {} });
    return this.#ask();
  }

  /** Asks what becomes of the robot; what is changed meanwhile is asked afterwards. */
  #ask(): Promise<void> {
    this.#asking ??= this.#askAll().finally(() => (this.#asking = null));
    return this.#asking;
  }

  async #askAll(): Promise<void> {
    let refusal = "";
    while (this.#shown !== this.#wanted) {
      const asked = this.#wanted;
      try {
        const looked = await askRobotEditor<EditedRobot<E>>(this.#link, "look", this.#given(asked));
        this.#accepted = asked;
        if (asked !== this.#wanted) continue; // the next one is on its way: showing this one would move things back
        this.#shown = asked;
        this.says.set(refusal);
        this.robot.set(looked);
      } catch (error) {
        refusal = (error as Error).message;
        this.#failed(error as Error, "");
        // What was refused is taken back; without an answer it stays, and is asked when the robot is there again.
        const isNo = error instanceof RefusedError && !this.isStale.value && this.#accepted !== null;
        if (isNo) this.#wanted = this.#accepted!;
        if (isNo && this.#shown !== this.#wanted) continue;
        this.robot.set(this.robot.value && { ...this.robot.value });
        return;
      }
    }
  }

  #failed(error: Error, before: string): void {
    this.isStale.set(error instanceof RefusedError && /changed on disk/.test(error.message));
    this.says.set(`${before}${error.message}`);
  }

  /** Learns after a lost connection whether the changes were saved. */
  async #learnSaved(): Promise<void> {
    const [before, mine] = [this.#before, JSON.stringify(this.robot.value?.entries)];
    this.#before = null;
    try {
      const now = await askRobotEditor<EditedRobot<E>>(this.#link, "look", { subject: this.subject, changes: [], hashes: {} });
      if (JSON.stringify(now.hashes) === before) {
        this.says.set("The connection is back: it was not saved. Save it again.");
      } else if (JSON.stringify(now.entries) === mine) {
        await this.#restart();
        this.says.set("The connection is back: it was saved.");
      } else {
        this.isStale.set(true);
        this.says.set("The connection is back: the files have changed on disk meanwhile.");
      }
    } catch (error) {
      this.says.set((error as Error).message);
    }
  }
}

const known = new WeakMap<Rosbridge, Map<string, RobotEdits<Entry>>>();
const all = new Set<RobotEdits<Entry>>();

/** Returns the edits of a section, which stay while the page shows something else. */
export function editsOf<E extends Entry>(link: Rosbridge, subject: string): RobotEdits<E> {
  const ofLink = known.get(link) ?? new Map<string, RobotEdits<Entry>>();
  known.set(link, ofLink);
  const edits = ofLink.get(subject) ?? new RobotEdits<Entry>(link, subject);
  ofLink.set(subject, edits);
  all.add(edits);
  return edits as unknown as RobotEdits<E>;
}

if (typeof window !== "undefined") {
  window.addEventListener("beforeunload", (event) => {
    if ([...all].some(({ canUndo }) => canUndo)) event.preventDefault();
  });
}
