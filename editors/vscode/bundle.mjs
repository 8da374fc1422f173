/** Writes dist/: the extension in one file, and the licences of what is in it. */

import { existsSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { build } from "esbuild";

const made = await build({
  entryPoints: ["src/extension.ts"],
  outfile: "dist/extension.js",
  bundle: true,
  platform: "node",
  target: "node20",
  format: "cjs",
  external: ["vscode"],
  minify: true,
  metafile: true,
  legalComments: "none", // all licences are in the other file
});

/** Return the folder of the package to which a file belongs. */
function packageOf(file) {
  let folder = dirname(file);
  while (!existsSync(join(folder, "package.json")) || !("version" in manifestOf(folder))) folder = dirname(folder);
  return folder;
}

function manifestOf(folder) {
  return JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
}

function licence(folder) {
  const { name, version, license } = manifestOf(folder);
  const file = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
  if (file === undefined) throw new Error(`${name} has no licence file`);
  return `${name} ${version} (${license})\n\n${readFileSync(join(folder, file), "utf8").trim()}\n`;
}

const foreign = Object.keys(made.metafile.inputs).filter((file) => file.includes("node_modules"));
const folders = [...new Set(foreign.map(packageOf))].sort();
writeFileSync("dist/licences.txt", folders.map(licence).join(`\n${"-".repeat(80)}\n\n`));
