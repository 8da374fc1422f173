"""What drives the joints of a robot in MuJoCo: wheels that follow a speed, servos that follow a position."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rbxcompose.base.arrays import np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.worlds.physics.rigid import GRAVITY
from rbxcompose.domains.worlds.physics.robot import PhysicsRobot, PhysicsWheels, PlacedParts, rolls_freely
from rbxcompose.domains.worlds.physics.solids import BodyRepair, BodyRepairs

WHEEL_LAG = 0.02  # time constant of wheels that carry the robot and do not slip [s]
# Inertia of the gear of a wheel, as part of what it moves. Contacts are solved without the derivatives of actuators, so
# that a light wheel with a high gain would push the robot faster than it turns itself.
WHEEL_GEAR = 0.2
SAG = math.radians(3.0), 3e-3  # of a joint at its greatest effort [rad, m]
SPIN_UP = 200.0, 20.0  # how fast a servo accelerates without load [rad/s^2, m/s^2]: the inertia of its gear
FOLLOWING = 0.01, 0.1  # inertia of a joint that follows another: parts of the gear of that one, and of its own load
DRAG = 0.2  # torque by which the gear of a servo resists at its greatest speed, as part of its effort

Model = Any  # of an extra, whose stubs are incomplete


def add_actuators(
    spec: Model, robot: PhysicsRobot, placed: PlacedParts, wheels: PhysicsWheels | None, ground: float
) -> Mapping[str, float | None]:
    """Add one for each driven wheel and each held joint, without gains yet; return the efforts that hold the latter.

    Raises:
        ValueError: if the robot names a joint that does not move.
    """
    driving = wheels.names if wheels else ()
    for name in driving:
        _add_actuator(spec, name)
    known = {part.joint.name for part in placed.parts if part.joint}
    for name in robot.servos:
        if name not in known:
            raise ValueError(f"'{name}' is no joint that moves")
    servos = {}
    for index, part in enumerate(placed.parts):
        joint = part.joint
        if joint is None or joint.mimic is not None or joint.name in driving:
            continue
        if joint.name not in robot.servos and rolls_freely(placed, index, ground):
            continue
        servos[joint.name] = robot.servos.get(joint.name)
        _add_actuator(spec, joint.name)
    return servos


def _add_actuator(spec: Model, joint: str) -> None:
    import mujoco

    kinds: Any = mujoco
    made = spec.add_actuator(name=f"joint {joint}", target=f"joint {joint}", trntype=kinds.mjtTrn.mjTRN_JOINT)
    made.gaintype, made.biastype = kinds.mjtGain.mjGAIN_FIXED, kinds.mjtBias.mjBIAS_AFFINE
    made.forcelimited, made.forcerange = True, (-1.0, 1.0)


def add_followers(spec: Model, placed: PlacedParts) -> None:
    """Bind joints that mimic another one to it."""
    import mujoco

    kinds: Any = mujoco
    for part in placed.parts:
        joint = part.joint
        if joint is None or joint.mimic is None:
            continue
        tie = spec.add_equality(type=kinds.mjtEq.mjEQ_JOINT, objtype=kinds.mjtObj.mjOBJ_JOINT)
        tie.name1, tie.name2 = f"joint {joint.name}", f"joint {joint.mimic.joint}"
        tie.data[:5] = joint.mimic.offset, joint.mimic.multiplier, 0.0, 0.0, 0.0
        tie.solref = (2 * spec.option.timestep, 1.0)


@dataclass(slots=True, eq=False)
class Gains:
    """Gives the actuators of a compiled model gains that fit what they move, at the positions of `data`."""

    model: Model
    data: Model
    robot: PhysicsRobot
    placed: PlacedParts
    repairs: BodyRepairs

    def set(self, wheels: PhysicsWheels | None, servos: Mapping[str, float | None]) -> None:
        """Set them, and the inertia of gears."""
        import mujoco

        engine: Any = mujoco
        model = self.model
        inertia = np.zeros((model.nv, model.nv))
        engine.mj_fullM(model, self.data, inertia)
        moments = np.diag(inertia)
        if wheels is not None:
            self._drive(wheels, moments)
        for name, effort in servos.items():
            self._hold(name, effort, float(moments[self._dof(name)]))
        for joint in (part.joint for part in self.placed.parts):
            if joint is not None and joint.mimic is not None:
                dof, leader = self._dof(joint.name), self._dof(joint.mimic.joint)
                gear, own = FOLLOWING
                model.dof_armature[dof] = max(gear * float(model.dof_armature[leader]), own * float(moments[dof]))
        engine.mj_setConst(model, self.data)

    def _drive(self, wheels: PhysicsWheels, moments: Any) -> None:
        """Let each wheel follow a speed: torque = gain (wanted - speed), up to its effort."""
        weight = float(self.model.body_subtreemass[self.model.body("part 0").id])
        for name in wheels.names:
            dof, number = self._dof(name), self.model.actuator(f"joint {name}").id
            load = weight * wheels.radius**2 / len(wheels.names)
            gain = (load + float(moments[dof])) / WHEEL_LAG
            effort = self._effort(name, GRAVITY * weight * wheels.radius / len(wheels.names))
            self.model.dof_armature[dof] = WHEEL_GEAR * load
            self.model.actuator_gainprm[number, 0], self.model.actuator_biasprm[number, 2] = gain, -gain
            self.model.actuator_forcerange[number] = -effort, effort

    def _hold(self, name: str, effort: float | None, moment: float) -> None:
        """Let a joint follow a position: torque = stiffness (wanted - position) - damping speed, up to its effort."""
        dof, number = self._dof(name), self.model.actuator(f"joint {name}").id
        joint = self.robot.body.joints[name]
        # Without an effort, three times what lifts all that it carries at the distance that its inertia shows.
        carried = float(self.model.body_subtreemass[self.model.dof_bodyid[dof]])
        enough = 3 * GRAVITY * (carried if joint.slides else math.sqrt(carried * moment))
        effort = effort if effort is not None else self._effort(name, enough)
        gear = effort / SPIN_UP[joint.slides]
        stiffness = effort / SAG[joint.slides]
        damping = 2 * math.sqrt(stiffness * (moment + gear))
        fastest = joint.limits.velocity if joint.limits and joint.limits.velocity else SPIN_UP[joint.slides] / 10
        self.model.dof_armature[dof], self.model.dof_damping[dof] = gear, DRAG * effort / fastest
        self.model.actuator_gainprm[number, 0] = stiffness
        self.model.actuator_biasprm[number, 1:3] = -stiffness, -damping
        self.model.actuator_forcerange[number] = -effort, effort

    def _dof(self, joint: str) -> int:
        return int(self.model.joint(f"joint {joint}").dofadr[0])

    def _effort(self, name: str, enough: float) -> float:
        """Return the effort of a joint's URDF, or one that is enough."""
        joint = self.robot.body.joints.get(name)
        if joint is None:  # of a wheel that was added
            return enough
        if joint.limits is not None and joint.limits.effort:
            return joint.limits.effort
        self.repairs.append(
            BodyRepair(name, f"its URDF says no effort: it has {enough:.3g} {'N' if joint.slides else 'Nm'}")
        )
        return enough
