/** Starts the console: what the robot says about itself first, then its pages. */
import { fetchConfig } from "./config";
import { showFrame, showState } from "./frame";
import { Rosbridge } from "./rosbridge";

async function start(): Promise<void> {
  showState("loading", "Looking for the robot\u2026");
  try {
    const config = await fetchConfig();
    showFrame(config, new Rosbridge(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/rosbridge`));
  } catch (error) {
    showState("error", (error as Error).message, () => void start());
  }
}

void start();
