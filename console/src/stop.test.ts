import { describe, expect, it } from "vitest";
import { CallError, UnansweredError, type Json, type LinkState, type Rosbridge } from "./rosbridge";
import { Signal } from "./signal";
import { Stop, takesSpace, wordsOf } from "./stop";

/** A link whose calls are answered by hand. */
class FakeLink {
  readonly state = new Signal<LinkState>({ is: "open" });
  readonly calls: { service: string; resolve(values: Json): void; reject(error: Error): void }[] = [];
  show: (by: string) => void = () => undefined;
  watch(_: string, listener: (answer: Json) => void): void {
    this.show = (by) => listener({ stop: by ? { by } : null });
  }
  call(service: string): Promise<Json> {
    if (this.state.value.is !== "open") return Promise.reject(new UnansweredError("not connected"));
    return new Promise((resolve, reject) => this.calls.push({ service, resolve, reject }));
  }
  lose(): void {
    this.state.set({ is: "lost", retry: 0 });
  }
}

describe("STOP", () => {
  const lost = new UnansweredError("the connection was lost");
  const settled = () => new Promise((resolve) => setTimeout(resolve));
  const begin = () => {
    const link = new FakeLink();
    const stop = new Stop(link as unknown as Rosbridge);
    return { link, stop, is: () => stop.state.value.is, sent: () => link.calls.map(({ service }) => service.split("/").at(-1)) };
  };

  it("has stopped the robot when the robot has answered, or shows it", async () => {
    const { link, stop, is } = begin();
    void stop.press();
    link.show("");
    expect([is(), wordsOf(stop.state.value)]).toEqual(["sent", "STOP is being sent."]);
    link.calls[0]!.resolve({ success: true });
    await settled();
    expect(is()).toBe("stopped");
    link.show("");
    expect(is()).toBe("free");
    void stop.press();
    link.show("Ben");
    expect(wordsOf(stop.state.value)).toBe("Stopped by Ben. Nothing moves until you press Release.");
    link.calls[1]!.reject(lost);
    await settled();
    expect(is()).toBe("stopped");
  });

  it("that was not answered is owed, and sent until it is", async () => {
    const { link, stop, is, sent } = begin();
    void stop.press();
    link.calls[0]!.reject(new UnansweredError("no answer from /console/stop in 5 s"));
    await settled();
    expect([is(), sent()]).toEqual(["owed", ["stop", "stop"]]);
    link.lose();
    link.calls[1]!.reject(lost);
    await settled();
    expect(wordsOf(stop.state.value)).toContain("STOP has not arrived: the connection was lost. It is sent again");
    link.state.set({ is: "open" });
    link.show("");
    expect([is(), sent()]).toEqual(["owed", ["stop", "stop", "stop"]]);
    link.calls[2]!.resolve({ success: true });
    await settled();
    expect(is()).toBe("stopped");
  });

  it("is owed when it is pressed without a connection, until a person releases", async () => {
    const { link, stop, is, sent } = begin();
    link.lose();
    await stop.press();
    expect(is()).toBe("owed");
    await stop.release();
    link.state.set({ is: "open" });
    expect([is(), sent()]).toEqual(["free", []]);
  });

  it.each([new CallError("this needs the role 'view'"), { success: false, message: "this needs the role 'view'" }])(
    "that the robot refuses stays in sight and is not sent again: %o",
    async (answer) => {
      const { link, stop, is, sent } = begin();
      void stop.press();
      if (answer instanceof CallError) link.calls[0]!.reject(answer);
      else link.calls[0]!.resolve(answer);
      await settled();
      link.lose();
      link.state.set({ is: "open" });
      link.show("");
      expect(wordsOf(stop.state.value)).toBe("STOP failed: this needs the role 'view'. Use the switch on the robot.");
      expect(sent()).toEqual(["stop"]);
      stop.dismiss();
      expect(is()).toBe("free");
    },
  );

  it("holds until the robot is released", async () => {
    const { link, stop, is } = begin();
    link.show("Ben");
    const refused = expect(stop.release()).rejects.toThrow("it still moves");
    link.calls[0]!.reject(new CallError("it still moves"));
    await refused;
    expect(is()).toBe("stopped");
    void stop.release();
    link.calls[1]!.resolve({ success: true });
    await settled();
    expect(is()).toBe("free");
  });
});

const input = (type: string) => ({ localName: "input", type });

describe("Space", () => {
  it.each([input("text"), input("search"), input("number"), { localName: "textarea" }, { localName: "div", isContentEditable: true }])(
    "is a space in a text: %j",
    (focused) => expect([takesSpace(focused, false), takesSpace(focused, true)]).toEqual([true, true]),
  );

  it.each([{}, { localName: "body" }, { localName: "a" }, { localName: "drive-pad" }, { localName: "li" }, input("range")])(
    "is STOP where it means nothing else: %j",
    (focused) => expect([takesSpace(focused, false), takesSpace(focused, true)]).toEqual([false, false]),
  );

  it.each([{ localName: "button", type: "submit" }, { localName: "select" }, { localName: "summary" }, input("checkbox"), input("radio")])(
    "presses a control that keys have reached, and is STOP after a click on it: %j",
    (focused) => expect([takesSpace(focused, false), takesSpace(focused, true)]).toEqual([false, true]),
  );
});
