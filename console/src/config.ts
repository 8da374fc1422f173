/** What the robot says about itself: `GET /console/config`. */
import { isMessage, type Json, type Message } from "./rosbridge";

export interface Value {
  name: string;
  topic: string;
  type: string;
  /** Where in a message the number is, such as `data` or `cells[0].voltage`. */
  field: string;
  unit: string;
}

export interface DriveConfig {
  topic: string;
  type: string;
  /** [m/s] */
  maxSpeed: number;
  /** [rad/s] */
  maxTurnRate: number;
}

/** A place of the manifest, a pose in `map` [m, m, rad]. */
export interface Place {
  name: string;
  x: number;
  y: number;
  heading: number;
  colour: string;
}

export interface Config {
  robot: string;
  about: string;
  /** The pages that there are, in this order; all if it is empty. */
  pages: string[];
  firstPage: string;
  drive: DriveConfig | null;
  /** The topic of the pictures that drivers see, empty if there is none. */
  camera: string;
  values: Value[];
  places: Place[];
  /** Where the consoles of the robots of its system are: `ADDRESS:PORT`, without an address on the same machine. */
  fleet: Record<string, string>;
  /** What this visitor may do: `view`, `operate` or `configure`. */
  role: string;
}

const ROLES = ["view", "operate", "configure"];

/** Returns why a visitor may not do what needs a role; empty if the own role suffices. */
export function whyNot({ role }: Config, needed: "operate" | "configure", what = "This"): string {
  return ROLES.indexOf(role) < ROLES.indexOf(needed) ? `${what} needs the link of the role ${needed}.` : "";
}

export class ConfigError extends Error {
  override name = "ConfigError";
}

/** The robot does not know who this is. */
export class LockedError extends ConfigError {
  override name = "LockedError";
}

/** Returns the token of a link, of what is behind its `#`; empty if it has none. */
export function tokenOf(link: string): string {
  return /[#&]token=([\w-]+)/.exec(link)?.[1] ?? "";
}

/** Shows the robot a token; from then on, the browser has a cookie for it. Throws a ConfigError if it is wrong. */
export async function logIn(token: string, url = "/console/login"): Promise<void> {
  let response: Response;
  try {
    response = await fetch(url, { method: "POST", body: token });
  } catch {
    throw new ConfigError("The robot does not answer. Is it switched on, and is this device in its network?");
  }
  if (!response.ok) throw new LockedError("This link is wrong, or has been renewed.");
}

/** Fetches the configuration. Throws a ConfigError that a person can read. */
export async function fetchConfig(url = "/console/config"): Promise<Config> {
  let response: Response;
  try {
    response = await fetch(url, { headers: { Accept: "application/json" }, cache: "no-store" });
  } catch {
    throw new ConfigError("The robot does not answer. Is it switched on, and is this device in its network?");
  }
  if (response.status === 401) throw new LockedError("The robot does not know you yet.");
  if (response.status === 403) {
    throw new ConfigError("The robot does not answer under this name. Open the link that `rbxcompose up` printed.");
  }
  if (!response.ok) throw new ConfigError(`The robot answered with an error (${response.status}).`);
  let json: unknown;
  try {
    json = await response.json();
  } catch {
    throw new ConfigError("What answers at this address is not a robot's console.");
  }
  return parseConfig(json);
}

/** Returns the configuration of its JSON. Whatever is missing has a default; a robot without a base has no `drive`. */
export function parseConfig(json: unknown): Config {
  if (!isMessage(json)) throw new ConfigError("What answers at this address is not a robot's console.");
  const values = isMessage(json.values) ? json.values : {};
  const places = isMessage(json.places) ? json.places : {};
  return {
    robot: text(json.robot) || "robot",
    about: text(json.about),
    pages: Array.isArray(json.pages) ? json.pages.map(text) : [],
    firstPage: text(json.first_page),
    camera: text(json.camera),
    role: text(json.role) || "configure",
    drive: isMessage(json.drive) ? parseDrive(json.drive) : null,
    fleet: Object.fromEntries(
      Object.entries(isMessage(json.fleet) ? json.fleet : {}).map(([name, address]) => [name, text(address)]),
    ),
    values: Object.entries(values).flatMap(([name, value]) => parseValue(name, value)),
    places: Object.entries(places).flatMap(([name, place]) => parsePlace(name, place)),
  };
}

function parseDrive(drive: Message): DriveConfig | null {
  const topic = text(drive.topic);
  if (!topic) return null;
  return {
    topic,
    type: text(drive.type) || "geometry_msgs/Twist",
    maxSpeed: positive(drive.max_speed, 0.5),
    maxTurnRate: positive(drive.max_turn_rate, 1),
  };
}

function parseValue(name: string, value: Json): Value[] {
  if (!isMessage(value) || !text(value.topic)) return [];
  return [
    {
      name,
      topic: text(value.topic),
      type: text(value.type),
      field: text(value.field) || "data",
      unit: text(value.unit),
    },
  ];
}

function parsePlace(name: string, place: Json): Place[] {
  if (!isMessage(place)) return [];
  const { x, y, heading } = place;
  if (typeof x !== "number" || typeof y !== "number" || typeof heading !== "number") return [];
  return [{ name, x, y, heading, colour: text(place.colour) }];
}

function text(value: Json | undefined): string {
  return typeof value === "string" ? value : "";
}

function positive(value: Json | undefined, otherwise: number): number {
  return typeof value === "number" && value > 0 ? value : otherwise;
}

/** Returns the number at a place of a message, or null if there is none. */
export function pluck(message: Json, field: string): number | null {
  let at: Json | undefined = message;
  for (const key of field.split(/[.[\]]+/).filter(Boolean)) {
    if (Array.isArray(at)) at = at[Number(key)];
    else if (isMessage(at)) at = at[key];
    else return null;
  }
  return typeof at === "number" && Number.isFinite(at) ? at : null;
}
