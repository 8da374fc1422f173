/** What a page is, and what it gets. */
import type { Config } from "./config";
import type { Rosbridge } from "./rosbridge";
import type { Signal } from "./signal";

export interface Robot {
  config: Config;
  link: Rosbridge;
  /** Whether the robot is stopped, by anyone, and not released, or about to be. */
  stopped: Signal<boolean>;
  /** What a person should read now, shown for a while and read out by screen readers. */
  notify(text: string): void;
}

/** A page is a file in `pages/` that exports one of these as `page`. */
export interface Page {
  name: string;
  title: string;
  order: number;
  /** Whether a robot has anything to show on it; without this, every robot has. */
  isFor?(robot: Robot): boolean;
  /** Fills the element and returns what closes the page again. */
  open(host: HTMLElement, robot: Robot): () => void;
}

const found = import.meta.glob<Page>("./pages/*.ts", { eager: true, import: "page" });

export const pages: readonly Page[] = Object.values(found).sort((a, b) => a.order - b.order);
