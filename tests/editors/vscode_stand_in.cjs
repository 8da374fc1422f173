// A small stand-in for the API of VS Code: documents, settings, diagnostics, messages, panels. What the language client
// asks for and no test looks at is an empty class, or a function that returns nothing.
"use strict";

const { readFileSync, readdirSync, statSync } = require("node:fs");
const Module = require("node:module");
const { join, relative } = require("node:path");
const { fileURLToPath, pathToFileURL } = require("node:url");

/** Something that is told to those who listen; promises of listeners can be waited for. */
class EventEmitter {
  #listeners = new Set();
  event = (listener, self) => {
    const bound = self === undefined ? listener : listener.bind(self);
    this.#listeners.add(bound);
    return new Disposable(() => this.#listeners.delete(bound));
  };
  fire = (what) => Promise.all([...this.#listeners].map((listener) => listener(what)));
  dispose() {
    this.#listeners.clear();
  }
}

class Disposable {
  constructor(end) {
    this.dispose = end ?? (() => {});
  }
}

class Uri {
  constructor(path) {
    this.scheme = "file";
    this.fsPath = path;
    this.path = path;
  }
  static file = (path) => new Uri(path);
  static parse = (text) => new Uri(fileURLToPath(text));
  toString = () => pathToFileURL(this.fsPath).href;
}

class Position {
  constructor(line, character) {
    Object.assign(this, { line, character });
  }
}

class Range {
  constructor(first, second, third, fourth) {
    this.start = first instanceof Position ? first : new Position(first, second);
    this.end = first instanceof Position ? second : new Position(third, fourth);
  }
}

class Diagnostic {
  constructor(range, message, severity) {
    Object.assign(this, { range, message, severity });
  }
}

class CancellationTokenSource {
  token = { isCancellationRequested: false, onCancellationRequested: new EventEmitter().event };
  cancel() {}
  dispose() {}
}

/** Return an object whose unknown members are made when they are asked for. */
function open(known) {
  return new Proxy(known, {
    get(target, name) {
      if (!(name in target) && typeof name === "string" && name !== "then") {
        const isClass = /^[A-Z]/.test(name);
        const isEvent = /^on(Did|Will)/.test(name);
        target[name] = isClass ? open(class {}) : isEvent ? new EventEmitter().event : () => new Disposable();
      }
      return target[name];
    },
  });
}

/** Return the regular expression of a pattern of files. */
function expression(glob) {
  const parts = { "**/": "(.*/)?", "*": "[^/]*", ".": "\\.", "{": "(", ",": "|", "}": ")" };
  return new RegExp(`^${glob.replace(/\*\*\/|[*.{,}]/g, (part) => parts[part])}$`);
}

function channel(lines) {
  const add = (line) => lines.push(line);
  const shown = { append: add, appendLine: add, info: add, error: add, warn: add, debug: add, trace: add };
  return open({ ...shown, logLevel: 0, show() {}, dispose() {} });
}

/** Return the API in a workspace, and `seen`, what a person would see. */
function standIn(folder, settings) {
  const told = new EventEmitter();
  const opened = new EventEmitter();
  const saved = new EventEmitter();
  const configured = new EventEmitter();
  const commands = new Map();
  const seen = { output: {}, messages: [], panels: [], diagnostics: new Map(), executed: [], answer: () => undefined };

  const document = (path, text) => ({
    uri: Uri.file(path),
    fileName: path,
    languageId: "yaml",
    version: 1,
    isClosed: false,
    isDirty: false,
    getText: () => text,
    save: async () => true,
  });
  const message = async (text, ...buttons) => {
    seen.messages.push({ text, buttons });
    void told.fire();
    return seen.answer();
  };
  const setting = (section) => ({
    get: (name, otherwise) => settings[section === undefined ? name : `${section}.${name}`] ?? otherwise,
  });

  const workspace = open({
    workspaceFolders: [{ uri: Uri.file(folder), name: "project", index: 0 }],
    textDocuments: [],
    notebookDocuments: [],
    onDidOpenTextDocument: opened.event,
    onDidSaveTextDocument: saved.event,
    onDidChangeConfiguration: configured.event,
    getWorkspaceFolder: () => workspace.workspaceFolders[0],
    getConfiguration: setting,
    findFiles: async (include) =>
      readdirSync(folder, { recursive: true })
        .filter((path) => expression(include).test(path) && statSync(join(folder, path)).isFile())
        .map((path) => Uri.file(join(folder, path))),
    fs: { readFile: async (uri) => readFileSync(uri.fsPath) },
  });
  const window = open({
    activeTextEditor: undefined,
    visibleTextEditors: [],
    tabGroups: open({ all: [] }),
    createOutputChannel: (name) => channel((seen.output[name] ??= [])),
    showErrorMessage: message,
    showInformationMessage: message,
    showWarningMessage: message,
    createWebviewPanel: (kind, title, column, options) => {
      const closed = new EventEmitter();
      const panel = { title, options, webview: { html: "" }, onDidDispose: closed.event, reveal() {}, dispose: closed.fire };
      seen.panels.push(panel);
      return panel;
    },
  });
  const api = open({
    version: "1.101.0",
    Uri,
    Position,
    Range,
    Diagnostic,
    Disposable,
    EventEmitter,
    CancellationTokenSource,
    DiagnosticSeverity: { Error: 0, Warning: 1, Information: 2, Hint: 3 },
    ViewColumn: { Beside: -2 },
    env: open({ language: "en", appName: "stand-in", appRoot: folder }),
    extensions: open({ all: [] }),
    notebooks: open({}),
    workspace,
    window,
    languages: open({
      match: (selector, { uri, languageId }) =>
        Number([selector].flat().some((one) => one.language === languageId && one.scheme === uri.scheme)),
      createDiagnosticCollection: () => ({
        set: (uri, found) => {
          seen.diagnostics.set(relative(folder, uri.fsPath), found ?? []);
          void told.fire();
        },
        delete: (uri) => seen.diagnostics.delete(relative(folder, uri.fsPath)),
        clear: () => seen.diagnostics.clear(),
        dispose: () => seen.diagnostics.clear(),
      }),
    }),
    commands: open({
      registerCommand: (name, run) => {
        commands.set(name, run);
        return new Disposable(() => commands.delete(name));
      },
      executeCommand: async (name, ...words) => {
        seen.executed.push([name, ...words]);
        return commands.get(name)?.(...words);
      },
    }),
  });

  return {
    api,
    seen,
    commands,
    /** Open a file as in an editor, with a text of its own or the saved one. */
    open: (path, text = readFileSync(join(folder, path), "utf8")) => {
      const made = document(join(folder, path), text);
      workspace.textDocuments.push(made);
      window.activeTextEditor = { document: made };
      return opened.fire(made).then(() => made);
    },
    save: (made) => saved.fire(made),
    configure: (name, value) => {
      settings[name] = value;
      return configured.fire({ affectsConfiguration: (wanted) => name.startsWith(wanted) });
    },
    /** Wait until something is seen. */
    until: (isSeen) =>
      new Promise((resolve) => {
        const look = () => {
          const found = isSeen(seen);
          if (found) resolve(found);
          return found;
        };
        if (!look()) told.event(look);
      }),
  };
}

/** Return the module of the extension, to which `vscode` is the stand-in. */
function load(path, api) {
  const usual = Module._load;
  Module._load = (name, ...others) => (name === "vscode" ? api : usual(name, ...others));
  return require(path);
}

module.exports = { standIn, load };
