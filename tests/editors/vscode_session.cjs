// Runs the extension in the stand-in: node vscode_session.cjs SCENARIO EXTENSION WORKSPACE PROGRAM. Prints what was seen
// as JSON, and ends by itself: whatever the extension leaves running would keep it.
"use strict";

const { readFileSync, writeFileSync } = require("node:fs");
const { join } = require("node:path");
const { load, standIn } = require("./vscode_stand_in.cjs");

const [, , scenario, extensionPath, folder, program] = process.argv;
const ROBOT = "robots/turtlebot/robot.yaml";
const MISSION = "missions/patrol.yaml";
const wrong = () => readFileSync(join(folder, ROBOT), "utf8").replace("runtime: 45", "runtme: 45");
const plain = (found) => found.map(({ code, message, severity, range }) => ({ code, message, severity, range }));

const editor = standIn(folder, { "rbxcompose.path": program });
const { activate, deactivate } = load(extensionPath, editor.api);
const context = { subscriptions: [] };
const found = (path) => editor.until(({ diagnostics }) => diagnostics.get(path)?.length && plain(diagnostics.get(path)));
const said = (number = 1) => editor.until(({ messages }) => messages.length >= number && messages);
const run = (name) => editor.api.commands.executeCommand(`rbxcompose.${name}`);

const scenarios = {
  async session() {
    const start = performance.now();
    await editor.open(ROBOT, wrong());
    activate(context);
    const first = await found(ROBOT);
    const seconds = (performance.now() - start) / 1000;
    editor.seen.diagnostics.clear();
    await run("restart");
    return { first, seconds, again: await found(ROBOT), commands: [...editor.commands.keys()] };
  },
  async check() {
    activate(context);
    await editor.open(MISSION);
    await run("check");
    return editor.seen.output["rbxcompose check"];
  },
  async picture() {
    activate(context);
    const mission = await editor.open(MISSION);
    await run("showMission");
    const [panel] = editor.seen.panels;
    const before = panel.webview.html;
    writeFileSync(join(folder, MISSION), mission.getText().replaceAll("go_to: dock", "go_to: corner_1"));
    await editor.save(mission);
    const after = panel.webview.html;
    writeFileSync(join(folder, MISSION), "kind: Mission\nname: <b>\n");
    await editor.save(mission);
    const failed = panel.webview.html;
    await editor.open(ROBOT);
    await run("showMission");
    return { title: panel.title, options: panel.options, before, after, failed, messages: editor.seen.messages };
  },
  async missing() {
    await editor.open(ROBOT, wrong());
    editor.seen.answer = () => "Open Settings";
    activate(context);
    const [{ text, buttons }] = await said();
    await editor.configure("rbxcompose.path", process.argv[6]);
    return { text, buttons, executed: editor.seen.executed, then: await found(ROBOT) };
  },
  async again() {
    await editor.open(ROBOT, wrong());
    editor.seen.answer = () => {
      writeFileSync(program, readFileSync(process.argv[6]), { mode: 0o755 });
      return "Try Again";
    };
    activate(context);
    return await found(ROBOT);
  },
  async without_extra() {
    await editor.open(ROBOT, wrong());
    activate(context);
    await said();
    await deactivate(); // nothing more is said
    return { messages: editor.seen.messages, output: editor.seen.output.rbxcompose };
  },
  async begins() {
    activate(context);
    await editor.open(...JSON.parse(process.argv[6]));
    return (await said())[0].text;
  },
  async found() {
    await editor.open(ROBOT, wrong());
    activate(context);
    return await found(ROBOT);
  },
  async no_robot() {
    activate(context);
    writeFileSync(join(folder, "unused.yaml"), "rbx: 1\nkind: Mission\nname: unused\ndo: [{wait: 1 s}]\n");
    await editor.open("unused.yaml");
    await run("showMission");
    return editor.seen.panels[0].webview.html;
  },
  async foreign() {
    activate(context);
    await editor.open("compose.yaml", "services:\n  web: {}\n");
    await editor.open("config/other.yaml", "# yaml-language-server: $schema=other.schema.json\nkind: Robot\n");
    return { messages: editor.seen.messages, output: editor.seen.output.rbxcompose };
  },
};

scenarios[scenario]()
  .then(async (result) => {
    await deactivate();
    for (const one of context.subscriptions) one.dispose();
    console.log(JSON.stringify(result));
  })
  .catch((error) => {
    console.error(error);
    process.exit(1);
  });
