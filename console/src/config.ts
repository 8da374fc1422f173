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
  firstPage: string;
  drive: DriveConfig | null;
  values: Value[];
  places: Place[];
  /** Where the consoles of the robots of its system are: `ADDRESS:PORT`, without an address on the same machine. */
  fleet: Record<string, string>;
}

export class ConfigError extends Error {
  override name = "ConfigError";
}

/** Fetches the configuration. Throws a ConfigError that a person can read. */
export async function fetchConfig(url = "/console/config"): Promise<Config> {
  let response: Response;
  try {
    response = await fetch(url, { headers: { Accept: "application/json" }, cache: "no-store" });
  } catch {
    throw new ConfigError("The robot does not answer. Is it switched on, and is this device in its network?");
  }
  if (response.status === 401 || response.status === 403) {
    throw new ConfigError("The robot does not let this browser in. Open the link that `rbxcompose up` printed.");
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
    firstPage: text(json.first_page),
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
