/** A mux: who commands now, and the way to the page that tells why. */
import type { Card } from "../cards";
import { h, icon, setText } from "../dom";
import { formatName } from "../format";

const ANNOUNCED = "announced"; // the port that says who commands
const NOBODY = "__none";

export const card: Card = {
  isFor: ({ capabilities }) => "Forwards" in capabilities,
  shows: ({ name }) => name === ANNOUNCED || name === "output",
  open(body, component, robot) {
    const who = h("dd", { class: "value" }, "Nobody");
    body.append(h("dl", { class: "values value-group" }, h("div", {}, h("dt", {}, "Commands now"), who)));
    if ("mux.LookAtMux" in component.requests) body.append(h("a", { class: "button", href: "./#mux" }, icon("wheel"), "Select or lock"));
    const announced = component.ports.find(({ name, kind }) => name === ANNOUNCED && kind === "out");
    if (!announced) return () => undefined;
    return robot.link.subscribe(
      announced.topic,
      ({ data }) => setText(who, data && data !== NOBODY ? formatName(String(data)) : "Nobody"),
      { type: announced.type },
    );
  },
};
