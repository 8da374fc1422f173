/** A battery: how full it is, as a gauge. */
import type { Card } from "../cards";
import { pluck } from "../config";
import type { Component, Port } from "../description";
import { BatteryGauge } from "../elements/battery_gauge";

function isLevel(port: Port): boolean {
  return port.kind === "out" && port.unit === "%" && /^std_msgs\//.test(port.type);
}

export const card: Card = {
  isFor: (component: Component) => component.ports.some(isLevel),
  shows: isLevel,
  open(body, component, robot) {
    const closers = component.ports.filter(isLevel).map((port) => {
      const { name, topic, type, unit } = port;
      const gauge = new BatteryGauge().describe({ name, topic, type, unit, field: "data" });
      body.append(gauge);
      const close = robot.link.subscribe(topic, (message) => gauge.show(pluck(message, "data"), Date.now()), { type, throttle: 1_000 });
      const timer = setInterval(() => gauge.refresh(Date.now()), 5_000);
      return () => {
        close();
        clearInterval(timer);
      };
    });
    return () => closers.forEach((close) => close());
  },
};
