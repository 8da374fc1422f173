/** What drives: how fast it is, how fast it may be, and the way to the page that drives it. */
import type { Card } from "../cards";
import { pluck } from "../config";
import { h, icon, setText } from "../dom";
import { formatValue } from "../format";

export const card: Card = {
  isFor: ({ capabilities }) => "Drives" in capabilities,
  shows: ({ type }) => type === "nav_msgs/msg/Odometry",
  open(body, component, robot) {
    const [drives] = component.capabilities.Drives!;
    const odometry = component.ports.find(({ name }) => name === drives?.odometry);
    const row = (name: string, field: string, unit: string, limit: unknown) => {
      const most = typeof limit === "number" ? ` of ${formatValue(limit, unit)}` : "";
      const cell = h("dd", { class: "value" }, formatValue(null, unit) + most);
      return { cell, field, unit, most, element: h("div", {}, h("dt", {}, name), cell) };
    };
    const rows = [
      row("Forward", "twist.twist.linear.x", "m/s", drives?.max_speed),
      row("Turn", "twist.twist.angular.z", "rad/s", drives?.max_turn_rate),
    ];
    body.append(h("dl", { class: "values value-group" }, ...rows.map(({ element }) => element)));
    if (robot.config.drive) body.append(h("a", { class: "button", href: "./#drive" }, icon("wheel"), "Drive it"));
    if (!odometry) return () => undefined;
    return robot.link.subscribe(
      odometry.topic,
      (message) => rows.forEach(({ cell, field, unit, most }) => setText(cell, formatValue(pluck(message, field), unit) + most)),
      { type: odometry.type, throttle: 250 },
    );
  },
};
