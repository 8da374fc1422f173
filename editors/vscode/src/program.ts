/** Runs the program `rbxcompose`. */

import { execFile } from "node:child_process";
import { existsSync } from "node:fs";
import { join } from "node:path";
import * as vscode from "vscode";

const LONGEST = 60_000; // [ms] that a command may take
const MOST = 32 * 1024 * 1024; // bytes of output
const SETTING = "rbxcompose.path";
const SETTINGS = "Open Settings";
const AGAIN = "Try Again";
const IN_WORKSPACE = process.platform === "win32" ? [".venv", "Scripts", "rbxcompose.exe"] : [".venv", "bin", "rbxcompose"];

/** What a command said, and how it ended; without a code if it could not be started. */
export interface Ended {
  code: number | undefined;
  output: string;
  errors: string;
}

/** Return the folder of the workspace in which a file is, else the first one. */
export function folderOf(uri?: vscode.Uri): string | undefined {
  const folder = uri === undefined ? undefined : vscode.workspace.getWorkspaceFolder(uri);
  return (folder ?? vscode.workspace.workspaceFolders?.[0])?.uri.fsPath;
}

/** Return the program: of the settings, of the workspace, or the one on PATH. */
export function program(): string {
  const folder = folderOf();
  const written = vscode.workspace.getConfiguration().get<string>(SETTING, "").trim();
  if (written !== "") return written.replaceAll("${workspaceFolder}", folder ?? "");
  const own = folder === undefined ? "" : join(folder, ...IN_WORKSPACE);
  return own !== "" && existsSync(own) ? own : "rbxcompose";
}

/** Run a command to its end. */
export function run(words: readonly string[], folder: string | undefined): Promise<Ended> {
  const options = { cwd: folder, timeout: LONGEST, maxBuffer: MOST, env: { ...process.env, NO_COLOR: "1" } };
  return new Promise((resolve) => {
    const child = execFile(program(), words, options, (error, output, errors) => {
      const code = error === null ? 0 : error.code;
      const ended = typeof code === "number" ? code : undefined;
      resolve({ code: ended, output, errors: ended === undefined ? `${errors}${error?.message ?? ""}` : errors });
    });
    child.stdin?.end(); // what would wait for words ends
  });
}

/** Return whether the program can be started; say so, with what can be done, if it cannot. */
export async function isThere(again: () => Promise<void>): Promise<boolean> {
  const { code } = await run(["--version"], folderOf());
  if (code === 0) return true;
  const message =
    `'${program()}' cannot be started. Install it with: pip install 'rbxcompose[lsp]', ` +
    `and give its path in the setting ${SETTING} if it is not on PATH.`;
  void vscode.window.showErrorMessage(message, SETTINGS, AGAIN).then(async (answer) => {
    if (answer === SETTINGS) await vscode.commands.executeCommand("workbench.action.openSettings", SETTING);
    if (answer === AGAIN) await again();
  });
  return false;
}
