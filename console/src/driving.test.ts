import { describe, expect, it } from "vitest";
import { drive, parked, PERIOD, STILL, type Action, type Driving, type DriveEvent, type Motion } from "./driving";

const SPEEDS: Motion = { forward: 0.4, turn: 1 };

/** A state machine with its clock, which keeps what was to be done. */
class Run {
  state: Driving = parked(SPEEDS);
  now = 0;
  actions: Action[] = [];

  constructor(...events: DriveEvent[]) {
    this.send(...events);
  }

  send(...events: DriveEvent[]): this {
    for (const event of events) {
      const { state, actions } = drive(this.state, event, this.now);
      this.state = state;
      this.actions.push(...actions);
    }
    return this;
  }

  /** Lets time pass with the ticks that the page has. */
  pass(time: number): this {
    for (const end = this.now + time; this.now < end;) {
      this.now += PERIOD;
      this.send({ is: "tick" });
    }
    return this;
  }

  /** What was to be done since the last time. */
  take(): Action[] {
    return this.actions.splice(0);
  }
}

const press = (direction: "forward" | "back" | "left" | "right", shift = true): DriveEvent => ({
  is: "key",
  direction,
  down: true,
  shift,
});
const release = (direction: "forward" | "left", shift = true): DriveEvent => ({
  is: "key",
  direction,
  down: false,
  shift,
});
const publish = (forward: number, turn: number): Action => ({ do: "publish", motion: { forward, turn } });
const ZERO: Action = { do: "publish", motion: STILL };

function driving(): Run {
  const run = new Run({ is: "connected" }, press("forward"), { is: "granted" });
  run.take();
  return run;
}

describe("the dead-man switch", () => {
  it("lets no key drive without Shift", () => {
    expect(new Run({ is: "connected" }, press("forward", false)).pass(1000).take()).toEqual([]);
  });

  it("takes the lease first, then drives at once", () => {
    const run = new Run({ is: "connected" }, press("forward"));
    expect(run.take()).toEqual([{ do: "take" }]);
    expect(run.pass(300).take()).toEqual([]);
    expect(run.send({ is: "granted" }).take()).toEqual([publish(0.4, 0)]);
  });

  it("publishes ten times a second", () => {
    const actions = driving().pass(1000).take();
    expect(actions).toEqual(Array(10).fill(publish(0.4, 0)));
  });

  it.each<[string, DriveEvent]>([
    ["Shift", { is: "shift", down: false }],
    ["the key", release("forward")],
    ["the key after Shift went up unseen", release("forward", false)],
    ["Shift, seen at another key", press("left", false)],
  ])("stops at once when a person lets go of %s", (_, event) => {
    expect(driving().send(event).take()).toEqual([ZERO]);
  });

  it("drives on with Shift held again", () => {
    const run = driving().send({ is: "shift", down: false }, { is: "shift", down: true });
    expect(run.take()).toEqual([ZERO, publish(0.4, 0)]);
  });

  it("adds keys up", () => {
    const run = new Run({ is: "connected" }, press("forward"), press("left"), { is: "granted" });
    expect(run.take().at(-1)).toEqual(publish(0.4, 1));
    expect(run.send(press("back")).pass(PERIOD).take()).toEqual([publish(0, 1)]);
  });
});

describe("the pad", () => {
  const held = () => new Run({ is: "connected" }, { is: "pad", at: { x: 0, y: 1 } }, { is: "granted" });

  it("drives in proportion, right is clockwise", () => {
    const run = held();
    expect(run.take()).toEqual([{ do: "take" }, publish(0.4, 0)]);
    run.send({ is: "pad", at: { x: 1, y: -0.53 } }).pass(PERIOD);
    expect(run.take()).toEqual([publish(expect.closeTo(-0.2) as number, -1)]);
  });

  it("stands still around its middle and holds the lease", () => {
    const run = held().send({ is: "pad", at: { x: 0.05, y: -0.05 } });
    run.take();
    expect(
      run
        .pass(5 * PERIOD)
        .take()
        .map((action) => action.do),
    ).toEqual(Array(5).fill("publish"));
    expect(run.state.commanded).toEqual(STILL);
  });

  it("stops at once when the finger is lifted", () => {
    const run = held();
    run.take();
    expect(run.send({ is: "pad", at: null }).take()).toEqual([ZERO]);
  });

  it("does not publish more often when it is moved fast", () => {
    const run = held();
    run.take();
    for (let turn = 0; turn < 50; turn++) run.send({ is: "pad", at: { x: 0, y: 1 - turn / 100 } });
    expect(run.take()).toEqual([]);
  });

  it("goes no faster than the slider says, however far it is dragged", () => {
    const run = held().send({ is: "pad", at: { x: -7, y: 9 } }, { is: "speeds", speeds: { forward: 0.1, turn: 0.2 } });
    run.take();
    expect(run.pass(PERIOD).take()).toEqual([publish(0.1, 0.2)]);
  });
});

describe("the lease", () => {
  it("is kept for two seconds with zeros, then given back", () => {
    const run = driving().send(release("forward"));
    run.take();
    const actions = run.pass(3000).take();
    expect(actions.filter(({ do: what }) => what === "publish")).toEqual(Array(20).fill(ZERO));
    expect(actions.at(-1)).toEqual({ do: "give" });
  });

  it("is given back with a zero when the window loses the focus", () => {
    const run = driving();
    expect(run.send({ is: "interrupted" }).take()).toEqual([ZERO, { do: "give" }]);
    expect(run.pass(1000).take()).toEqual([]);
  });

  it("is given back when the focus is lost before it was granted", () => {
    const run = new Run({ is: "connected" }, press("forward"), { is: "interrupted" }, { is: "granted" });
    expect(run.take()).toEqual([{ do: "take" }, { do: "give" }]);
    expect(run.pass(1000).take()).toEqual([]);
  });

  it("that somebody else has is not asked for again until all is let go", () => {
    const run = driving().send({ is: "refused" });
    expect(run.pass(1000).take()).toEqual([]);
    expect(run.send(release("forward"), press("forward")).take()).toEqual([{ do: "take" }]);
  });
});

describe("what ends driving", () => {
  it("is STOP, until RELEASE and a new press", () => {
    const run = driving();
    expect(run.send({ is: "stopped" }).take()).toEqual([ZERO, { do: "give" }]);
    expect(run.pass(1000).send({ is: "released" }).pass(1000).take()).toEqual([]);
    expect(run.send(release("forward"), press("forward")).take()).toEqual([{ do: "take" }]);
  });

  it("is a lost connection, after which held keys do not drive", () => {
    const run = driving();
    expect(run.send({ is: "disconnected" }).pass(1000).take()).toEqual([]);
    expect(run.state.commanded).toEqual(STILL);
    run.send(press("forward"), { is: "connected" });
    expect(run.pass(1000).take()).toEqual([]);
    expect(run.send(release("forward"), press("forward")).take()).toEqual([{ do: "take" }]);
  });

  it("whatever happens in whatever order: nothing but zero without dead-man, lease and connection", () => {
    const events: DriveEvent[] = [
      ...(
        ["interrupted", "connected", "disconnected", "granted", "refused", "stopped", "released", "tick"] as const
      ).map((is) => ({ is })),
      press("forward"),
      press("left", false),
      release("forward"),
      { is: "shift", down: true },
      { is: "shift", down: false },
      { is: "pad", at: { x: 0.5, y: 0.5 } },
      { is: "pad", at: null },
    ];
    let seed = 1;
    const random = (below: number) => (seed = (seed * 48271) % 0x7fffffff) % below;
    for (let turn = 0; turn < 300; turn++) {
      const run = new Run();
      for (let step = 0; step < 60; step++) {
        run.now += random(200);
        const event = events[random(events.length)] as DriveEvent;
        const before = run.state;
        run.send(event);
        for (const action of run.take()) {
          if (action.do !== "publish") continue;
          expect(run.state.connected && (before.lease === "held" || event.is === "granted")).toBe(true);
          if (action.motion === STILL) continue;
          expect(run.state.stopped || run.state.latched).toBe(false);
          expect(run.state.pad !== null || (run.state.shift && run.state.keys.size > 0)).toBe(true);
        }
      }
    }
  });
});
