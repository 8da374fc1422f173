import { expect, it } from "vitest";
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
  const trip = new Trip({
    act: (_action, _type, _goal, onFeedback = () => undefined) => {
      const goal = { canceled: false, say: onFeedback } as FakeGoal;
      goals.push(goal);
      const done = new Promise<Outcome>((resolve, reject) => Object.assign(goal, { end: resolve, fail: reject }));
      return { done, cancel: () => (goal.canceled = true) };
    },
  });
  const go = (name: string) => trip.begin("/go_to", "nav2_msgs/NavigateToPose", {}, { name, pose: POSE, frame: "map" });
  const settled = () => new Promise<void>((resolve) => queueMicrotask(() => queueMicrotask(resolve)));
  return { trip, goals, go, settled };
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
