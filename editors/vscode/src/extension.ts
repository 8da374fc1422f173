/** The extension: starts the language server when a manifest is open, and has three commands. */

import * as vscode from "vscode";
import { LanguageClient } from "vscode-languageclient/node";
import { isManifest } from "./manifests";
import { Pictures } from "./picture";
import { folderOf, isThere, program, run } from "./program";

const YAML = "yaml";

/** A client that shows no messages of its own before it runs: one failure would be three. */
class Client extends LanguageClient {
  hasStarted = false;

  override error(...[message, data, shown]: Parameters<LanguageClient["error"]>): void {
    super.error(message, data, this.hasStarted ? shown : false);
  }
}

/** The server, which is started once at a time. */
class Server implements vscode.Disposable {
  private client: Client | undefined;
  private changing: Promise<void> = Promise.resolve();
  private readonly output = vscode.window.createOutputChannel("rbxcompose", { log: true });

  /** Start the server if it does not run. */
  start(): Promise<void> {
    return this.after(async () => {
      if (this.client === undefined) await this.begin();
    });
  }

  /** Stop the server, and start it with the settings of now. */
  restart(): Promise<void> {
    return this.after(async () => {
      await this.end();
      await this.begin();
    });
  }

  stop(): Promise<void> {
    return this.after(() => this.end());
  }

  dispose(): void {
    void this.stop().then(() => this.output.dispose());
  }

  private after(change: () => Promise<void>): Promise<void> {
    this.changing = this.changing.then(change);
    return this.changing;
  }

  private async begin(): Promise<void> {
    if (!(await isThere(() => this.restart()))) return;
    const cwd = folderOf();
    const options = cwd === undefined ? {} : { cwd };
    const client = new Client(
      "rbxcompose", // the settings rbxcompose.trace.server are those of this name
      "rbxcompose",
      { command: program(), args: ["lsp"], options },
      {
        documentSelector: [{ scheme: "file", language: YAML }],
        outputChannel: this.output,
        initializationFailedHandler: () => false, // do not try again
      },
    );
    try {
      await client.start();
      client.hasStarted = true;
      this.client = client;
    } catch {
      void this.complain();
    }
  }

  private async end(): Promise<void> {
    const client = this.client;
    this.client = undefined;
    if (client?.isRunning()) await client.stop();
    await client?.dispose();
  }

  /** Say why the server cannot be started, in its own words. */
  private async complain(): Promise<void> {
    const { errors } = await run(["lsp"], folderOf());
    const message = `The language server did not start. ${errors.trim()}`;
    if ((await vscode.window.showErrorMessage(message, "Show Output")) !== undefined) this.output.show();
  }
}

class Extension {
  private readonly output = vscode.window.createOutputChannel("rbxcompose check");
  private readonly pictures = new Pictures();
  readonly server = new Server();
  private hasBegun = false;

  /** Register everything, and begin if a manifest is open. */
  activate(context: vscode.ExtensionContext): void {
    context.subscriptions.push(
      this.output,
      this.pictures,
      this.server,
      vscode.commands.registerCommand("rbxcompose.check", () => this.check()),
      vscode.commands.registerCommand("rbxcompose.showMission", () => this.pictures.show()),
      vscode.commands.registerCommand("rbxcompose.restart", () => this.server.restart()),
      vscode.workspace.onDidOpenTextDocument((document) => this.see(document)),
      vscode.workspace.onDidSaveTextDocument(async (document) => {
        this.see(document);
        if (document.languageId === YAML) await this.pictures.redraw();
      }),
      vscode.workspace.onDidChangeConfiguration(async (change) => {
        if (this.hasBegun && change.affectsConfiguration("rbxcompose.path")) await this.server.restart();
      }),
    );
    for (const document of vscode.workspace.textDocuments) this.see(document);
  }

  /** Start the server with the first manifest. */
  private see(document: vscode.TextDocument): void {
    if (this.hasBegun || document.uri.scheme !== "file" || document.languageId !== YAML) return;
    if (!isManifest({ path: document.uri.fsPath, text: document.getText() }, folderOf(document.uri))) return;
    this.hasBegun = true;
    void this.server.start();
  }

  /** Say what `check` says of the file in the editor. */
  private async check(): Promise<void> {
    const document = vscode.window.activeTextEditor?.document;
    if (document === undefined || document.uri.scheme !== "file") {
      void vscode.window.showInformationMessage("Open a manifest first.");
      return;
    }
    await document.save();
    const path = document.uri.fsPath;
    const { output, errors } = await run(["check", path], folderOf(document.uri));
    this.output.appendLine(`$ rbxcompose check ${path}`);
    this.output.appendLine(`${output}${errors}`);
    this.output.show(true);
  }
}

let extension: Extension | undefined;

/** Called by the editor when the first YAML file is opened, or a command is used. */
export function activate(context: vscode.ExtensionContext): void {
  extension = new Extension();
  extension.activate(context);
}

/** Called by the editor before it ends. */
export async function deactivate(): Promise<void> {
  await extension?.server.stop();
  extension = undefined;
}
