/** What this extension must know of manifests itself; everything else the server knows. */

import { basename, relative, sep } from "node:path";

const FOLDERS = ["robots", "missions", "parts", "systems"];
const BEGINNING = 4000; // characters that contain the header of a manifest
const HEADER = /^rbx:/m;
const KIND = /^kind:[ ]*["']?(\w+)/m;
const NAME = /^name:[ ]*["']?([\w-]+)/m;
const SCHEMA = /^# yaml-language-server: \$schema=\S*\b(robot|mission|part|overlay|system|test|world)\.schema\.json/m;

/** A text file. */
export interface TextFile {
  path: string;
  text: string;
}

/** A robot's file, and the robot's name for a mission. */
export interface Candidate {
  robot: string;
  mission: string;
}

/** Return whether a file is a manifest, or lies in a folder of manifests of the workspace. */
export function isManifest(file: TextFile, workspace: string | undefined): boolean {
  const beginning = file.text.slice(0, BEGINNING);
  if (HEADER.test(beginning) || SCHEMA.test(beginning)) return true;
  const place = workspace === undefined ? [] : relative(workspace, file.path).split(sep);
  return FOLDERS.includes(place[0] ?? "");
}

/** Return the kind that a manifest declares, or nothing. */
export function kindOf(text: string): string {
  return KIND.exec(text.slice(0, BEGINNING))?.[1] ?? "";
}

/** Return the robots that may have a mission: those that name its file, else all, which may have it from a part. */
export function candidates(mission: TextFile, files: readonly TextFile[]): Candidate[] {
  const robots = files.filter((file) => kindOf(file.text) === "Robot");
  const naming = robots.flatMap((robot) => {
    const name = nameIn(robot.text, basename(mission.path));
    return name === undefined ? [] : [{ robot: robot.path, mission: name }];
  });
  const own = NAME.exec(mission.text.slice(0, BEGINNING))?.[1] ?? basename(mission.path).replace(/\.ya?ml$/, "");
  return naming.length > 0 ? naming : robots.map((robot) => ({ robot: robot.path, mission: own }));
}

/** Return the key of the line that names a file. */
function nameIn(text: string, file: string): string | undefined {
  for (const line of text.split("\n")) {
    const found = /([\w-]+):\s*["']?([^\s"'#,}]+)/.exec(line);
    if (found?.[2] !== undefined && basename(found[2]) === file) return found[1];
  }
  return undefined;
}
