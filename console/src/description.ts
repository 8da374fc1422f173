/** What the robot is made of, as `robot.DescribeRobot` answers: each component with what its type declares. */
import type { Json, Rosbridge } from "./rosbridge";

export interface Port {
  name: string;
  /** `in`, `out`, `serves_topic`, `serves`, `calls`, `serves_action`, `calls_action` or `looks`. */
  kind: string;
  /** The absolute name at its other end. */
  topic: string;
  type: string;
  /** Of the bare number in a message or a request. */
  unit: string;
  /** Its name in missions, empty if they do not have it. */
  skill: string;
  /** Whether a publisher of it moves the robot. */
  is_command: boolean;
  claims: string;
  is_pausable: boolean;
  /** Units of numbers of a goal, as deep as its messages are nested. */
  measures: Record<string, Json>;
  /** Words that texts of a goal may be. */
  choices: Record<string, string[]>;
  outcomes: Record<string, string>;
}

export interface Component {
  name: string;
  type: string;
  about: string;
  process: string;
  ports: Port[];
  /** Fields by the name of the capability: names of ports, and values in SI. */
  capabilities: Record<string, Record<string, Json>[]>;
  /** What it can be asked, with whether it is a command. */
  requests: Record<string, boolean>;
}

/** Calls the listener with all components, now and when `apply` has changed them. */
export function watchComponents(link: Rosbridge, listener: (components: Component[], refused: string) => void) {
  return link.watch(
    "robot/DescribeRobot",
    (answer, refused) => listener(Array.isArray(answer) ? (answer as unknown as Component[]) : [], refused),
    5_000,
  );
}
