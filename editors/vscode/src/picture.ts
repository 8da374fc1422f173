/** The picture of a mission beside its text, drawn again when a manifest is saved. */

import { randomBytes } from "node:crypto";
import { basename } from "node:path";
import * as vscode from "vscode";
import { candidates, kindOf, type TextFile } from "./manifests";
import { type Ended, folderOf, run } from "./program";

const MOST_ROBOTS = 200; // looked at in a workspace
const MOST_TRIED = 10; // of those that may have the mission

/** The pictures that are shown, by the paths of their missions. */
export class Pictures implements vscode.Disposable {
  private readonly panels = new Map<string, vscode.WebviewPanel>();

  /** Show the mission in the active editor. */
  async show(): Promise<void> {
    const document = vscode.window.activeTextEditor?.document;
    if (document === undefined || kindOf(document.getText()) !== "Mission") {
      void vscode.window.showInformationMessage("Open a mission first: a file with 'kind: Mission'.");
      return;
    }
    const path = document.uri.fsPath;
    this.panels.get(path)?.reveal(undefined, true);
    if (!this.panels.has(path)) this.panels.set(path, this.made(path));
    await this.draw(path);
  }

  /** Draw all again: a mission's picture depends on its robot, too. */
  async redraw(): Promise<void> {
    await Promise.all([...this.panels.keys()].map((path) => this.draw(path)));
  }

  dispose(): void {
    for (const panel of this.panels.values()) panel.dispose();
  }

  private made(path: string): vscode.WebviewPanel {
    const column = { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true };
    const options = { enableScripts: false, enableForms: false, localResourceRoots: [] };
    const panel = vscode.window.createWebviewPanel("rbxcompose.mission", basename(path), column, options);
    panel.onDidDispose(() => this.panels.delete(path));
    return panel;
  }

  private async draw(path: string): Promise<void> {
    const html = await drawn(path);
    const panel = this.panels.get(path); // it may have been closed meanwhile
    if (panel !== undefined) panel.webview.html = html;
  }
}

/** Return a mission as a page, or a page that says why there is none. */
async function drawn(path: string): Promise<string> {
  const uri = vscode.Uri.file(path);
  let ended: Ended | undefined;
  for (const { robot, mission } of candidates(await read(uri), await robots()).slice(0, MOST_TRIED)) {
    ended = await run(["mission", "show", mission, robot, "--format", "html"], folderOf(uri));
    if (ended.code === 0) return guarded(ended.output);
  }
  const reason = ended === undefined ? "No robot in the workspace has this mission." : ended.errors;
  return guarded(`<html><head></head><body><pre>${escaped(reason)}</pre></body></html>`);
}

async function robots(): Promise<TextFile[]> {
  const found = await vscode.workspace.findFiles("{**/robots/**/*.yaml,**/robot.yaml}", "**/{node_modules,.venv,build}/**", MOST_ROBOTS);
  const sorted = found.sort((one, other) => (one.fsPath < other.fsPath ? -1 : 1));
  return Promise.all(sorted.map(read));
}

async function read(uri: vscode.Uri): Promise<TextFile> {
  return { path: uri.fsPath, text: new TextDecoder().decode(await vscode.workspace.fs.readFile(uri)) };
}

/** Return a page that may load nothing and run nothing; its own styles alone count. */
export function guarded(html: string): string {
  const nonce = randomBytes(16).toString("base64");
  const policy = `default-src 'none'; style-src 'nonce-${nonce}'; form-action 'none'; base-uri 'none'`;
  const styled = html.replace("<style>", `<style nonce="${nonce}">`);
  return styled.replace("<head>", `<head><meta http-equiv="Content-Security-Policy" content="${policy}">`);
}

function escaped(text: string): string {
  return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
}
