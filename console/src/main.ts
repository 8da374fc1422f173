/** Starts the console: who this is and what the robot says about itself first, then its pages. */
import { fetchConfig, LockedError, logIn, tokenOf } from "./config";
import { showDoor, showFrame, showState } from "./frame";
import { Rosbridge } from "./rosbridge";

async function start(): Promise<void> {
  showState("loading", "Looking for the robot\u2026");
  try {
    const token = tokenOf(location.hash);
    if (token) {
      history.replaceState(null, "", location.pathname); // so that nobody reads it over a shoulder, or shares it
      await logIn(token);
    }
    const config = await fetchConfig();
    showFrame(config, new Rosbridge(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/rosbridge`));
  } catch (error) {
    const { message } = error as Error;
    if (!(error instanceof LockedError)) showState("error", message, () => void start());
    else
      showDoor(message, async (given) => {
        await logIn(tokenOf(given) || given);
        void start();
      });
  }
}

void start();
