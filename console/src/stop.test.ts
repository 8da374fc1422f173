import { describe, expect, it } from "vitest";
import { takesSpace } from "./stop";

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
