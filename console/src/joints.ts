/** Joints that can be enabled and relaxed one by one: the ports of a servo bus, by joint. */
import type { Component, Port } from "./description";

export interface JointPorts {
  name: string;
  enable: Port;
  relax: Port | null;
}

const ENABLE = /^(.+)_enable$/;
const OWN = /_(enable|relax|reboot|set_speed|command)$/;

/** Returns the joints of a component, those whose port `JOINT_enable` switches them on and off. */
export function jointsOf({ ports }: Component): JointPorts[] {
  return ports.flatMap((enable) => {
    const name = ENABLE.exec(enable.name)?.[1];
    if (!name || enable.kind !== "serves") return [];
    return [{ name, enable, relax: ports.find((port) => port.name === `${name}_relax`) ?? null }];
  });
}

/** Returns the joints that slide, of a robot's URDF; all others turn. */
export function slidingJoints(urdf: string): Set<string> {
  const root = new DOMParser().parseFromString(urdf, "text/xml");
  return new Set([...root.querySelectorAll('joint[type="prismatic"]')].map((joint) => joint.getAttribute("name") ?? ""));
}

/** Returns whether a port belongs to one joint. */
export function isOfJoint({ name, kind }: Port): boolean {
  return kind === "serves" && OWN.test(name);
}
