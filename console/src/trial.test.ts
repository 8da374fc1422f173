import { expect, it } from "vitest";
import { ending, tested } from "./trial";

const run = { outcome: "success", why: "", time: 12.345, left_out: 0, story: [], statuses: [], changes: [], track: [], places: [] };

it("tells how a dry run ended", () => {
  expect(ending(run)).toBe("It ended in success after 12.3 s of robot time");
  expect(ending({ ...run, outcome: "", why: "it waits" })).toBe("Not ended: it waits");
});

it("counts tests and ways", () => {
  const coverage = { ways: 5, taken: 3, missing: [] };
  const test = { name: "a", passed: true, outcome: "success", problems: [] };
  expect(tested({ tests: [test], coverage })).toBe("1 of 1 test passed; they took 3 of 5 ways.");
});
