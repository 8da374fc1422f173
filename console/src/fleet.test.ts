import { describe, expect, it } from "vitest";
import { frameOf, gridOf, pageOf } from "./fleet";

describe("the fleet", () => {
  it("opens a page on the same machine by the name under which this one was opened", () => {
    const here = { protocol: "http:", hostname: "robot.local" };
    expect(pageOf(":8081", here)).toBe("http://robot.local:8081/");
    expect(pageOf("10.0.0.2:80", here)).toBe("http://10.0.0.2:80/");
  });

  it("is framed with a margin, north up", () => {
    expect(frameOf([{ x: 0, y: 0 }, { x: 4, y: 2 }])).toEqual({ left: -1, top: -4, size: 6 });
  });

  it("has lines at whole metres, and fewer in a wide frame", () => {
    expect(gridOf(-0.5, 0, 1)).toBe("M0 0v1M-0.5 0h1M-0.5 1h1");
    expect(gridOf(0, 0, 100).split("v").length - 1).toBe(11);
  });
});
