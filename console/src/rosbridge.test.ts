import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { CallError, LostError, parseFrame, Rosbridge, waitBefore, type Json, type Message, type Socket } from "./rosbridge";

class FakeSocket implements Socket {
  static all: FakeSocket[] = [];
  onopen: Socket["onopen"] = null;
  onclose: Socket["onclose"] = null;
  onmessage: Socket["onmessage"] = null;
  sent: Message[] = [];
  closed = false;

  constructor() {
    FakeSocket.all.push(this);
  }
  send(text: string): void {
    this.sent.push(JSON.parse(text));
  }
  close(): void {
    this.closed = true;
  }
  open(): this {
    this.onopen?.({} as Event);
    return this;
  }
  lose(): void {
    this.onclose?.({} as CloseEvent);
  }
  receive(frame: unknown): void {
    this.onmessage?.({ data: typeof frame === "string" ? frame : JSON.stringify(frame) } as MessageEvent);
  }
}

const make = () => new Rosbridge("ws://robot/rosbridge", () => new FakeSocket());
const last = () => FakeSocket.all.at(-1) as FakeSocket;

beforeEach(() => {
  vi.useFakeTimers();
  FakeSocket.all = [];
});
afterEach(() => vi.useRealTimers());

describe("frames", () => {
  it.each<unknown>([
    "",
    "nonsense",
    "1",
    "null",
    "[]",
    "{}",
    '{"op":"publish","topic":"/a","msg":3}',
    '{"op":7}',
    new ArrayBuffer(1),
  ])("that mean nothing are ignored: %s", (text) => expect(parseFrame(text)).toBeUndefined());

  it("of services may have no values", () => {
    expect(parseFrame('{"op":"service_response","id":"a","result":true}')).toMatchObject({
      values: null,
      result: true,
    });
  });
});

describe("the connection", () => {
  it("comes back, later each time", () => {
    const link = make();
    last().open();
    expect(link.state.value.is).toBe("open");
    last().lose();
    expect(link.state.value.is).toBe("lost");
    vi.advanceTimersByTime(250);
    expect(FakeSocket.all).toHaveLength(2);
    last().lose();
    vi.advanceTimersByTime(250);
    expect(FakeSocket.all).toHaveLength(2);
    vi.advanceTimersByTime(250);
    last().open();
    expect(FakeSocket.all).toHaveLength(3);
    expect(link.state.value.is).toBe("open");
  });

  it("waits from 0.25 s up to 5 s, and not all clients equally long", () => {
    expect([0, 1, 2, 10].map((attempt) => waitBefore(attempt, () => 0))).toEqual([250, 500, 1000, 5000]);
    expect(waitBefore(10, () => 1)).toBe(3750);
  });

  it("that does not open in 5 s is given up", () => {
    const link = make();
    const first = last();
    vi.advanceTimersByTime(5000);
    expect([first.closed, link.state.value.is]).toEqual([true, "lost"]);
    first.open();
    expect(link.state.value.is).toBe("lost");
  });

  it("is given up when the server says nothing, not even that it is there", () => {
    const link = make();
    const first = last().open();
    const asked = () => first.sent.filter(({ service }) => service === "/rosapi/get_time").length;
    for (let turn = 0; turn < 5; turn++) {
      vi.advanceTimersByTime(2000);
      first.receive({ op: "publish", topic: "/a", msg: {} });
    }
    expect(asked()).toBe(0);
    vi.advanceTimersByTime(3000);
    expect(asked()).toBe(1);
    first.receive({ op: "status", level: "error", msg: "not yours", id: "alive:1" });
    vi.advanceTimersByTime(3000);
    expect([asked(), link.state.value.is]).toEqual([2, "open"]);
    vi.advanceTimersByTime(2000);
    expect([first.closed, link.state.value.is]).toEqual([true, "lost"]);
  });

  it("begins anew at once for a visitor who has another role", () => {
    const link = make();
    const first = last().open();
    link.reconnect();
    expect([first.closed, FakeSocket.all.length, last().open() === first, link.state.value.is]).toEqual([true, 2, false, "open"]);
  });

  it("is tried at once when a person says so, and never twice at a time", () => {
    const link = make();
    last().lose();
    link.connect();
    link.connect();
    vi.advanceTimersByTime(1000);
    expect(FakeSocket.all).toHaveLength(2);
  });

  it("ends for good when it is closed", () => {
    const link = make();
    last().open();
    link.close();
    vi.advanceTimersByTime(60_000);
    expect([FakeSocket.all.length, last().closed, link.state.value.is]).toEqual([1, true, "closed"]);
  });
});

describe("topics", () => {
  it("are subscribed to once for all listeners, and again after a lost connection", () => {
    const link = make();
    const first = vi.fn();
    const second = vi.fn();
    link.subscribe("/a", first, { type: "std_msgs/String", throttle: 100 });
    link.subscribe("/a", second);
    last().open();
    const frame = { op: "subscribe", topic: "/a", type: "std_msgs/String", throttle_rate: 100, queue_length: 1 };
    expect(last().sent).toMatchObject([frame]);
    last().receive({ op: "publish", topic: "/a", msg: { data: "x" } });
    last().receive({ op: "publish", topic: "/b", msg: { data: "y" } });
    expect([first.mock.calls, second.mock.calls]).toEqual([[[{ data: "x" }]], [[{ data: "x" }]]]);
    last().lose();
    vi.advanceTimersByTime(250);
    expect(last().open().sent).toMatchObject([frame]);
  });

  it("that answer a query tell who comes later the last answer, unless it leaves first", async () => {
    const link = make();
    last().open();
    const heard: Json[] = [];
    link.watch("mission/ListMissions", (answer) => heard.push(["first", answer]));
    last().receive({ op: "publish", topic: "/console/windows/mission/ListMissions", msg: { answer: 1 } });
    link.watch("mission/ListMissions", (answer) => heard.push(["second", answer]));
    link.watch("mission/ListMissions", (answer) => heard.push(["third", answer]))();
    await Promise.resolve();
    expect(heard).toEqual([["first", 1], ["second", 1]]);
  });

  it("are unsubscribed from with the last listener", () => {
    const link = make();
    last().open();
    const ends = [link.subscribe("/a", vi.fn()), link.subscribe("/a", vi.fn())];
    ends.forEach((end) => end());
    ends.forEach((end) => end());
    expect(last().sent.map(({ op }) => op)).toEqual(["subscribe", "unsubscribe"]);
    expect(last().sent[1]?.id).toBe(last().sent[0]?.id);
  });

  it("are advertised again, but what could not be published is not sent later", () => {
    const link = make();
    link.advertise("/a", "std_msgs/String");
    expect(link.publish("/a", { data: "early" })).toBe(false);
    last().open();
    expect(link.publish("/a", { data: "x" }, { id: "p", sent: 5 })).toBe(true);
    expect(last().sent).toMatchObject([{ op: "advertise" }, { op: "publish", msg: { data: "x" }, id: "p", sent: 5 }]);
  });
});

describe("services", () => {
  const answer = (frame: Message) =>
    last().receive({ op: "service_response", service: "/s", id: last().sent.at(-1)?.id, ...frame });

  it("answer the call that has their id", async () => {
    const link = make();
    last().open();
    const [first, second] = [link.call("/s", { a: 1 }), link.call("/s", { a: 2 })];
    const [one, two] = last().sent;
    last().receive({ op: "service_response", id: two?.id, values: { b: 2 }, result: true });
    last().receive({ op: "service_response", id: one?.id, values: { b: 1 }, result: true });
    expect(await Promise.all([first, second])).toEqual([{ b: 1 }, { b: 2 }]);
  });

  it.each<[Message, string]>([
    [{ result: false, values: "no such service" }, "no such service"],
    [{ result: false, values: { message: "too hot" } }, "too hot"],
    [{ result: false }, "the robot refused"],
  ])("refuse with a reason: %o", async (frame, reason) => {
    const link = make();
    last().open();
    const call = link.call("/s");
    answer(frame);
    await expect(call).rejects.toThrow(new CallError(reason));
  });

  it("that the server may not carry out fail with its status", async () => {
    const link = make();
    last().open();
    const call = link.call("/s");
    last().receive({ op: "status", level: "error", id: last().sent.at(-1)?.id, msg: "this needs the role 'view'" });
    await expect(call).rejects.toThrow(new CallError("this needs the role 'view'"));
  });

  it("are not waited for for ever, nor beyond the connection", async () => {
    const link = make();
    await expect(link.call("/s")).rejects.toThrow("not connected");
    last().open();
    const late = expect(link.call("/s", {}, 2000)).rejects.toThrow("no answer from /s in 2 s");
    vi.advanceTimersByTime(2000);
    await late;
    answer({ result: true });
    const lost = expect(link.call("/s")).rejects.toThrow("the connection was lost");
    last().lose();
    await lost;
  });
});

it("status frames say which request was wrong", () => {
  const link = make();
  link.onStatus = vi.fn();
  last().open().receive({ op: "status", level: "error", msg: "not yours", id: "drive:3" });
  expect(link.onStatus).toHaveBeenCalledWith({ op: "status", level: "error", msg: "not yours", id: "drive:3" });
});

describe("goals", () => {
  const begin = () => {
    const link = make();
    last().open();
    const heard: Message[] = [];
    const goal = link.act("/go_to", "nav2_msgs/NavigateToPose", { pose: {} }, (values) => heard.push(values));
    const sent = last().sent.at(-1)!;
    return { link, heard, goal, sent, id: String(sent.id) };
  };

  it("are sent, tell their progress and end with a status and a result", async () => {
    const { heard, goal, sent, id } = begin();
    expect(sent).toMatchObject({
      op: "send_action_goal",
      action: "/go_to",
      action_type: "nav2_msgs/NavigateToPose",
      args: { pose: {} },
      feedback: true,
    });
    last().receive({ op: "action_feedback", id, action: "/go_to", values: { distance_remaining: 2 } });
    last().receive({ op: "action_feedback", id: "another", action: "/go_to", values: { distance_remaining: 9 } });
    expect(heard).toEqual([{ distance_remaining: 2 }]);
    last().receive({ op: "action_result", id, action: "/go_to", values: { error_code: 0 }, status: 4, result: true });
    await expect(goal.done).resolves.toEqual({ status: 4, values: { error_code: 0 } });
    last().receive({ op: "action_feedback", id, action: "/go_to", values: { distance_remaining: 1 } });
    expect(heard).toHaveLength(1);
  });

  it("are canceled while they run, and not afterwards", async () => {
    const { goal, id } = begin();
    goal.cancel();
    expect(last().sent.at(-1)).toEqual({ op: "cancel_action_goal", id, action: "/go_to" });
    last().receive({ op: "action_result", id, action: "/go_to", values: "", status: 5, result: false });
    await expect(goal.done).resolves.toMatchObject({ status: 5 });
    const count = last().sent.length;
    goal.cancel();
    expect(last().sent).toHaveLength(count);
  });

  it("that the robot refuses fail with its reason", async () => {
    const { goal, id } = begin();
    last().receive({ op: "action_result", id, action: "/go_to", values: "too far", status: 0, result: false });
    await expect(goal.done).rejects.toThrow(new CallError("too far"));
  });

  it("that the server cannot carry out fail with its status", async () => {
    const { link, goal, id } = begin();
    link.onStatus = vi.fn();
    last().receive({ op: "status", level: "warning", id, msg: "slow" });
    last().receive({ op: "status", level: "error", id, msg: "not served" });
    await expect(goal.done).rejects.toThrow(new CallError("not served"));
    expect(link.onStatus).toHaveBeenCalledOnce();
  });

  it("fail as unknown when the connection is lost, and are not sent without one", async () => {
    const { link, goal } = begin();
    last().lose();
    await expect(goal.done).rejects.toBeInstanceOf(LostError);
    await expect(link.act("/go_to", "nav2_msgs/NavigateToPose", {}).done).rejects.toThrow("not connected");
  });
});
