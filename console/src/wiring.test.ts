import { expect, it } from "vitest";
import type { Component, Port } from "./description";
import { wiresOf } from "./wiring";

const port = (kind: string, topic: string, is_command = false): Port => ({
  name: topic,
  kind,
  topic,
  type: "t/T",
  unit: "",
  skill: "",
  is_command,
  claims: "",
  is_pausable: false,
  measures: {},
  choices: {},
  outcomes: {},
});
const component = (name: string, ...ports: Port[]): Component => ({ name, type: "t", about: "", process: "p", ports, capabilities: {}, requests: {} });

it("joins each pair of components once, by all that is between them", () => {
  const base = component("base", port("in", "/cmd_vel", true), port("out", "/odom"), port("serves", "/reset"));
  const pilot = component("pilot", port("out", "/cmd_vel"), port("in", "/odom"), port("calls", "/reset"), port("looks", ""));
  expect(wiresOf([base, pilot])).toEqual([
    { from: "base", to: "pilot", names: ["/odom"], isCommand: false },
    { from: "pilot", to: "base", names: ["/cmd_vel", "/reset"], isCommand: true },
  ]);
  expect(wiresOf([base, pilot], (topic) => topic !== "/odom")).toHaveLength(1);
});
