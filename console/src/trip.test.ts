import { beforeEach, describe, expect, it, vi } from "vitest";
import { CallError, LostError, type Message, type Outcome } from "./rosbridge";
import { Trip } from "./trip";

const POSE = { x: 1, y: 2, heading: 0 };

interface FakeGoal {
  end(outcome: Outcome): void;
  fail(error: Error): void;
  say(values: Message): void;
  canceled: boolean;
}

function make() {
  const goals: FakeGoal[] = [];
  const calls: [string, Message | undefined][] = [];
  const link = {
    call: (service: string, args?: Message) => {
      calls.push([service, args]);
      return Promise.resolve(null);
    },
    act: (_action: string, _type: string, _goal: Message, onFeedback: (values: Message) => void = () => undefined) => {
      const goal = { canceled: false, say: onFeedback } as FakeGoal;
      goals.push(goal);
      const done = new Promise<Outcome>((resolve, reject) => Object.assign(goal, { end: resolve, fail: reject }));
      return { done, cancel: () => (goal.canceled = true) };
    },
  };
  const trip = new Trip(link);
  const go = (name: string) => trip.begin("/go_to", "nav2_msgs/NavigateToPose", {}, { name, pose: POSE, frame: "map" });
  const settled = () => new Promise<void>((resolve) => queueMicrotask(() => queueMicrotask(resolve)));
  return { trip, goals, calls, link, go, settled };
}

it("tells how far it is, and that it has arrived", async () => {
  const { trip, goals, go, settled } = make();
  go("Dock");
  goals[0]!.say({ distance_remaining: 1.5 });
  expect(trip.state.value).toEqual({ is: "driving", text: "Driving to Dock", pose: POSE, frame: "map", left: 1.5 });
  goals[0]!.end({ status: 4, values: {} });
  await settled();
  expect(trip.state.value).toMatchObject({ is: "arrived", text: "Arrived at Dock", pose: null });
});

it.each([
  [5, {}, "canceled", "Canceled on the way to Dock"],
  [6, { error_msg: "stuck" }, "failed", "Gave up on the way to Dock: stuck"],
  [6, "replaced", "failed", "Gave up on the way to Dock: replaced"],
  [0, null, "failed", "Ended with status 0 on the way to Dock"],
] as const)("tells how else it has ended: %i", async (status, values, is, text) => {
  const { trip, goals, go, settled } = make();
  go("Dock");
  goals[0]!.end({ status, values });
  await settled();
  expect(trip.state.value).toMatchObject({ is, text });
});

it("does not guess what became of it when the connection was lost", async () => {
  const { trip, goals, go, settled } = make();
  go("Dock");
  goals[0]!.fail(new LostError("the connection was lost"));
  await settled();
  expect(trip.state.value).toMatchObject({ is: "unknown", text: expect.stringContaining("is unknown") });
});

it("tells why it was refused", async () => {
  const { trip, goals, go, settled } = make();
  go("Dock");
  goals[0]!.fail(new CallError("too far"));
  await settled();
  expect(trip.state.value).toMatchObject({ is: "failed", text: "Refused to drive to Dock: too far" });
});

it("is the newest one: what an older one says afterwards does not count", async () => {
  const { trip, goals, go, settled } = make();
  go("Dock");
  go("Window");
  goals[0]!.say({ distance_remaining: 9 });
  goals[0]!.end({ status: 6, values: "replaced" });
  await settled();
  expect(trip.state.value).toMatchObject({ is: "driving", text: "Driving to Window", left: null });
  trip.cancel();
  expect(goals.map(({ canceled }) => canceled)).toEqual([false, true]);
});

describe("a goal that this browser sent", () => {
  const statuses = (...pairs: [id: string, status: number][]) => ({
    status_list: pairs.map(([uuid, status]) => ({ goal_info: { goal_id: { uuid } }, status })),
  });
  const kept = new Map<string, string>();
  vi.stubGlobal("localStorage", { getItem: (key: string) => kept.get(key) ?? null, setItem: (key: string, text: string) => kept.set(key, text) });
  beforeEach(() => kept.clear());

  it("is canceled also after the page was loaded again", () => {
    const { trip, calls, link, go } = make();
    trip.learn("/go_to", statuses(["old", 2]));
    go("Dock");
    trip.learn("/go_to", statuses(["old", 6], ["new", 2]));
    const again = new Trip(link);
    again.learn("/go_to", statuses(["old", 6], ["new", 2]));
    expect(again.state.value).toEqual({ is: "driving", text: "Driving to Dock", pose: POSE, frame: "map", left: null });
    again.cancel();
    expect(calls).toEqual([["/go_to/_action/cancel_goal", { goal_info: { goal_id: { uuid: "new" } } }]]);
    again.learn("/go_to", statuses(["new", 3]));
    expect(again.state.value.is).toBe("driving");
    again.learn("/go_to", statuses(["new", 5]));
    expect(again.state.value).toMatchObject({ is: "canceled", text: "Canceled on the way to Dock", pose: null });
  });

  it("is not said to be canceled where the robot refuses", async () => {
    kept.set("map.trip", JSON.stringify({ id: "new", name: "Dock", pose: POSE, frame: "map" }));
    const { trip, link, settled } = make();
    trip.learn("/go_to", statuses(["new", 2]));
    link.call = () => Promise.reject(new CallError("this needs the role 'operate'"));
    trip.cancel();
    await settled();
    expect(trip.state.value).toMatchObject({ is: "driving", text: "Not canceled: this needs the role 'operate'" });
  });

  it("is known again when the connection is back", async () => {
    const { trip, goals, go, settled } = make();
    trip.learn("/go_to", statuses());
    go("Dock");
    trip.learn("/go_to", statuses(["new", 2]));
    goals[0]!.fail(new LostError("the connection was lost"));
    await settled();
    trip.learn("/go_to", statuses(["new", 2]));
    expect(trip.state.value.is).toBe("driving");
    trip.learn("/go_to", statuses());
    expect(trip.state.value.text).toContain("no longer drives to Dock");
  });

  it("is said to have ended, and how if that is known, when the connection is back", async () => {
    const { trip, goals, go, settled } = make();
    const lose = async (...pairs: [id: string, status: number][]) => {
      go("Dock");
      trip.learn("/go_to", statuses(...pairs));
      goals.at(-1)!.fail(new LostError("the connection was lost"));
      await settled();
      expect(trip.state.value.text).toContain("whether the robot still drives to Dock");
    };
    await lose(["first", 2]);
    trip.learn("/go_to", statuses(["first", 4]));
    expect(trip.state.value).toMatchObject({ is: "arrived", text: "Arrived at Dock" });
    await lose(["first", 4], ["second", 2]);
    trip.learn("/go_to", statuses(["second", 5]));
    expect(trip.state.value.text).toBe("Canceled on the way to Dock");
    await lose(["second", 5]); // lost before the robot has said its id
    trip.learn("/go_to", statuses(["second", 5], ["other", 2]));
    expect(trip.state.value.text).toContain("whether the robot still drives to Dock");
    trip.learn("/go_to", statuses(["second", 5], ["other", 4]));
    expect(trip.state.value).toMatchObject({ is: "unknown", text: expect.stringContaining("no longer drives to Dock") });
  });

  it("was not refused if it ends with its server underway", async () => {
    const { trip, goals, go, settled } = make();
    go("Dock");
    trip.learn("/go_to", statuses(["new", 2]));
    goals[0]!.fail(new CallError("the server is gone"));
    await settled();
    expect(trip.state.value).toMatchObject({ is: "failed", text: "No longer drives to Dock: the server is gone" });
  });

  it("is told apart from the goals of others, and from those that have ended", async () => {
    const { trip, goals, go, settled } = make();
    trip.learn("/go_to", statuses(["mission", 2]));
    expect(trip.state.value.is).toBe("none");
    go("Dock");
    trip.learn("/go_to", statuses(["mission", 6], ["new", 2]));
    goals[0]!.end({ status: 4, values: {} });
    await settled();
    trip.learn("/go_to", statuses(["new", 2]));
    expect(trip.state.value.is).toBe("arrived");
    trip.learn("/go_to", statuses(["new", 4], ["other", 2]));
    expect(trip.state.value.is).toBe("arrived");
  });
});
