"""Drives the joints that the servos of a bus turn."""

from __future__ import annotations

import gc
import math
import os
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, Self

from rbxcompose.base.arrays import np
from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Refused, answers, to_data
from rbxcompose.domains.devices.serial_ports import PortError
from rbxcompose.domains.servos import controller_manager
from rbxcompose.domains.servos.bus import ServoBus, bus_type
from rbxcompose.domains.servos.bus_config import ServoBusConfig, drives_of, item_of, joint_ports, mimics_of
from rbxcompose.domains.servos.controller import ControllerSite, controller_type
from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.domains.servos.joint_drive import JointDrive, PositionDrive, ServoJoint
from rbxcompose.domains.servos.joint_states import Enable, Hold, JointMode, MoveTo
from rbxcompose.domains.servos.servo_cycle import ServoCycle, ServoItem, prepare, set_up, with_torque
from rbxcompose.domains.servos.twins.servo_fake import FakeServo, IdealMotor, ServoMotor
from rbxcompose.domains.servos.twins.servo_faults import FAULTS, FaultScript, InjectFault, ListFaults
from rbxcompose.domains.servos.twins.servo_twin import PhysicsJoints, PhysicsMotor, TwinBus, twin_of, twin_servos
from rbxcompose.msgs.rbxcompose_msgs import SetSpeed
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.sdk import Component, In, Later, Out, Port, Serves, ServesAction, component
from rbxcompose.sdk.capabilities import Capability, ConnectedBy, NeedsExtra, OpensPort, Setting, TurnsJoints, within
from rbxcompose.sdk.component import Context

REMEMBERED = 1000  # cycles, of which the lateness is known


class Periods:
    """Counts the periods of a cycle on a grid; those that no cycle began in were missed."""

    def __init__(self, period: float) -> None:
        self.period = period
        self.met = self.missed = 0
        self._last: int | None = None  # number of the last period
        self._late: deque[float] = deque(maxlen=REMEMBERED)

    def begin(self, now: float) -> None:
        """Note that a cycle begins."""
        number = math.floor(now / self.period + 1e-6)
        if self._last is not None:
            self.missed += max(0, number - self._last - 1)
        self._last = number
        self.met += 1
        self._late.append(now - number * self.period)

    def pause(self) -> None:
        """Do not count what comes until the next cycle."""
        self._last = None

    @property
    def share_met(self) -> float:
        """Return the share of periods in which a cycle began."""
        return self.met / (self.met + self.missed) if self.met else 1.0

    def late(self, share: float) -> float:
        """Return how late this share of the last cycles began, at most [s]."""
        ordered = sorted(self._late)
        return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0.0


_FIRST = 1  # the lowest real-time priority: above all ordinary programs, below what others have put there


def be_prompt() -> str:
    """Let this thread run before ordinary programs, and spare it searches for garbage; return why not, or nothing.

    Linux permits it to root and to users with the limit `rtprio`. Threads and processes begun later are ordinary ones.
    """
    gc.freeze()
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(_FIRST))
    except OSError as error:
        return error.strerror or str(error)
    return ""


PAUSE = 0.1  # [s] in which a servo may still answer from before
PATIENCE = 2.0  # [s] after which it must have answered
UNDER_WAY = "its servos start again"

WhenRebooted = Callable[[str], None]
"""Takes why it failed, or nothing."""


@dataclass(frozen=True, slots=True)
class _Reboot:
    drive: JointDrive
    begun: float
    done: WhenRebooted


class Reboots:
    """The joints whose servos are being started again; they have no torque, and commands are refused meanwhile.

    `prepare` is called for a joint whose servos answer again.
    """

    def __init__(self, bus: ServoBus, prepare: Callable[[JointDrive], None]) -> None:
        self._bus, self._prepare = bus, prepare
        self._open: list[_Reboot] = []

    def begin(self, drive: JointDrive, now: float, done: WhenRebooted) -> None:
        """Switch the torque of a joint off and start its servos again; `done` is called now or later.

        Raises:
            PortError: if the bus has gone.
        """
        if reason := objection(drive) or (UNDER_WAY if any(reboot.drive is drive for reboot in self._open) else ""):
            done(reason)
            return
        drive.relax()
        self._bus.write({id_: {"torque_enable": 0} for id_ in drive.joint.ids})
        if silent := [id_ for id_ in drive.joint.ids if not self._bus.reboot(id_)]:
            done(f"{_servo_names(silent)} did not confirm the reboot")
            return
        drive.hindrance = UNDER_WAY
        self._open.append(_Reboot(drive, now, done))

    def step(self, now: float) -> None:
        """Go on: prepare the joints whose servos answer again, and give up those that stay silent.

        Raises:
            PortError: if the bus has gone.
        """
        for reboot in list(self._open):
            if reboot.drive.measured_at >= reboot.begun + PAUSE:
                self._prepare(reboot.drive)
                self._end(reboot, self._enabled(reboot.drive))
            elif now - reboot.begun > PATIENCE:
                self._end(
                    reboot, f"{_servo_names(reboot.drive.joint.ids)} did not answer for {PATIENCE:g} s after the reboot"
                )

    def fail(self, reason: str) -> None:
        """End all of them."""
        for reboot in list(self._open):
            self._end(reboot, reason)

    def _end(self, reboot: _Reboot, reason: str) -> None:
        self._open.remove(reboot)
        reboot.drive.hindrance = ""
        reboot.done(reason)

    def _enabled(self, drive: JointDrive) -> str:
        """Let a joint move again unless somebody has disabled it; return why it may not, or nothing."""
        for id_, reading in self._bus.read(drive.joint.ids, ["present_position", "hardware_error"]).items():
            drive.take(id_, reading)
        if drive.error:
            return f"after the reboot, it still reports {drive.error}"
        if drive.condition.is_enabled:
            drive.ask(Enable(True))
        return ""


def objection(drive: JointDrive) -> str:
    """Return why the servos of a joint cannot be started again, and what to do, or nothing."""
    old = [servo for servo in drive.joint.servos if servo.model.protocol == 1]
    if not old:
        return ""
    return (
        f"servo {old[0].id} ({old[0].model.name}) speaks protocol 1.0, which has no reboot: "
        "enable the joint when its error is gone, or switch its supply off and on"
    )


def _servo_names(ids: Iterable[int]) -> str:
    found = [str(id_) for id_ in ids]
    return f"servo {found[0]}" if len(found) == 1 else f"servos {', '.join(found)}"


def joint_state(drives: Iterable[JointDrive], stamp: int) -> JointState | None:
    """Return where the joints are, without those that are not measured now, None if none is; `stamp` is in ns."""
    return _joint_state([(drive, drive.measured) for drive in drives], stamp)


def joint_command(drives: Iterable[JointDrive], stamp: int) -> JointState | None:
    """Return where the joints are commanded to be, those without torque where they are; like `joint_state`."""
    return _joint_state([(each, each.commanded if each.has_torque else each.measured) for each in drives], stamp)


def _joint_state(samples: Iterable[tuple[JointDrive, JointSample]], stamp: int) -> JointState | None:
    known = [each for each in samples if math.isfinite(each[1].position) and not each[0].condition.is_lost]
    if not known:
        return None
    return JointState(
        header=Header(stamp=to_time(stamp)),
        name=tuple(drive.joint.name for drive, _ in known),
        position=np.array([sample.position for _, sample in known]),
        velocity=np.array([sample.velocity for _, sample in known]),
        effort=np.array([drive.effort for drive, _ in known]),
    )


def note_of(drive: JointDrive) -> str:
    """Return the most important of what there is to say about a joint; empty if there is nothing."""
    said = (drive.missing, drive.condition.note, drive.stranger, drive.discord, drive.refused, drive.astray)
    return next(filter(None, said), drive.clamped)


def joint_report(
    drives: Mapping[str, JointDrive], controllers: Mapping[str, str], periods: Periods, *, is_lost: bool
) -> tuple[Level, str, dict[str, object]]:
    """Return level, words and values of diagnostics: how the joints are, with the notes of controllers."""
    own = {name: note_of(drive) for name, drive in drives.items()}
    notes = {name: words for name, words in {**own, **controllers}.items() if words}
    bad = [
        name for name, drive in drives.items() if drive.missing or drive.mode in (JointMode.FAULT, JointMode.RESTING)
    ]
    level = Level.ERROR if bad or is_lost else Level.WARN if notes else Level.OK
    words = "; ".join([GONE] * is_lost + [f"{name}: {words}" for name, words in notes.items()])
    kept = {"periods_met": f"{100 * periods.share_met:.2f} %", "late": f"{1e3 * periods.late(0.99):.1f} ms"}
    return level, words or f"{len(drives)} joints", {**{name: drive.mode for name, drive in drives.items()}, **kept}


GONE = "the bus of servos has gone"
REOPEN = 0.5  # [s] between attempts to find a port that has gone
REPORT = 1.0  # [s] between reports to diagnostics
PUBLISHED = 50.0  # [Hz] of joint states, at most
SET_POINTS, MOVED = "physics/set_points", "physics/joint_states"  # to and from the physics engine


@component("servo_bus")
class ServoBusDriver(Component[ServoBusConfig]):
    """Reads and writes the servos of a bus, keeps their joints within limits, and runs controllers that lead them.

    Each joint has a topic `JOINT/command` [rad], and the services `JOINT/relax`, `JOINT/enable`, `JOINT/reboot` and
    `JOINT/set_speed`; `BUS/relax_all` and `BUS/enable_all` are for all. A joint starts relaxed; the first command
    switches its torque on, where it is. A servo that has shut down must be rebooted before it takes torque again, in
    missions by the skill `reboot_JOINT`. While somebody listens, `joint_commands` has where joints are commanded to be.

    Example:
        servos: {type: servo_bus, twin: servo, joints: {pan: {servos: [{id: 1, model: AX-12}]}}}
    """

    made_by = "Each entry of `buses` runs one."
    process = "servos"
    joint_states = Out(JointState, "joint_states")
    joint_commands = Out(JointState, "joint_commands")

    @classmethod
    def ports(cls, config: ServoBusConfig) -> dict[str, Port[Any]]:
        """Return the ports: for each joint, for all, and those of the controllers."""
        rate = config.rate / cycles_between(config) if config.joints else None
        found = super().ports(config) | joint_ports(config)
        found |= {name: Out(JointState, name, rate=rate) for name in ("joint_states", "joint_commands")}
        if config.by_physics:
            found |= {"set_points": Out(JointState, SET_POINTS, rate=config.rate), "moved": In(JointState, MOVED)}
        for name, setup in config.controllers.items():
            ports = controller_type(setup.type).ports(name, setup.config)
            found |= {f"{name}_{port}": one for port, one in ports.items()}
        return {name: port.named(name) for name, port in found.items()}

    @classmethod
    def rest_time(cls, config: ServoBusConfig) -> float:
        """Return the time that parking may take."""
        return config.park_time if config.on_shutdown == "park" else super().rest_time(config)

    @classmethod
    def capabilities(cls, config: ServoBusConfig) -> tuple[Capability, ...]:
        """Declare what its controllers can do, that servos which speak bytes need the SDK, and real ones their port."""
        led = (
            within(capability, f"{name}_", f"controllers.{name}.")
            for name, each in config.controllers.items()
            for capability in controller_type(each.type).capabilities(name, each.config)
        )
        kind, has_bytes = bus_type(config.kind), config.twin in ("", "pty")
        packages = (NeedsExtra(Setting(kind.package), Setting(kind.extra)),) if kind.package and has_bytes else ()
        port = Setting(config.port, "port")
        ports = (OpensPort(port),) if not config.twin else (ConnectedBy(port),) if config.port else ()
        turned = (TurnsJoints(Setting(config.efforts)),) if config.by_physics else ()
        return (*led, *packages, *turned, *ports)

    def __init__(self, name: str, config: ServoBusConfig, context: Context) -> None:
        """Give the ports of joints and controllers their methods."""
        super().__init__(name, config, context)
        orders = ("relax", self.relax), ("enable", self.enable), ("reboot", self.reboot), ("set_speed", self.set_speed)
        for joint in config.joints:
            for word, method in orders:
                setattr(self, f"on_{joint}_{word}", partial(method, joint))
        self.owners: dict[str, tuple[str, str]] = {}  # the controller of a port, and the port's name there
        for controller, setup in config.controllers.items():
            for short, port in controller_type(setup.type).ports(controller, setup.config).items():
                self.owners[f"{controller}_{short}"] = controller, short
                if isinstance(port, ServesAction):
                    setattr(self, f"accept_{controller}_{short}", partial(self.accept, controller, short))
                elif isinstance(port, Serves):
                    setattr(self, f"on_{controller}_{short}", partial(self.asked, controller, short))

    def configure(self) -> None:
        """Open the bus, real or simulated; nothing moves."""
        config = self.config
        self.period = 1.0 / config.rate
        self.pause = (cycles_between(config) - 0.5) * self.period  # [s] between two joint states, cycles being late
        self.periods = Periods(self.period)
        drives, mimics = drives_of(config), mimics_of(config.joints)
        bus = self.open_bus([drive.joint for drive in drives.values()])
        self.cycle = ServoCycle(bus, drives, mimics, config.watchdog, config.thermal.scope == "bus")
        self.keeps_torque = config.on_shutdown != "relax"
        self.at_end.callback(self.end_torque)
        self.reboots = Reboots(bus, self.prepare)
        start = Pose2(*config.put_at)
        seats = {
            name: ControllerSite(self, name, {joint: drives[joint] for joint in item.config.claimed}, start)
            for name, item in config.controllers.items()
        }
        self.controllers = controller_manager.ControllerManager(
            {
                name: controller_type(controller.type)(name, controller.config, seats[name])
                for name, controller in config.controllers.items()
            }
        )
        self.kept: dict[str, Any] = {}  # what controllers want to know after a restart, as data
        self.is_stopped, self.lost_at = self.context.is_stopped, -math.inf
        self.reported_at, self.published_at = -math.inf, -math.inf
        self.is_parking = False

    def open_bus(self, joints: Sequence[ServoJoint]) -> ServoBus:
        """Open the bus of these joints, until the end. Simulated servos have bytes in real time only.

        Raises:
            PortError: if the port cannot be opened.
        """
        config, path = self.config, self.config.port
        self.faults: FaultScript | None = None
        self.physics: PhysicsJoints | None = None  # the link to the engine that moves the servos, if one does
        if config.twin:
            has_bytes = config.twin == "pty" and isinstance(self.context.clock, MonotonicClock)
            motor = PhysicsMotor if config.by_physics else IdealMotor if config.twin == "ideal" else ServoMotor
            servos = twin_servos(joints, motor=motor, noise=config.noise, seed=config.seed)
            self.physics = PhysicsJoints(joints, servos) if config.by_physics else None
            servos |= {f"servo {id_}": [FakeServo(model, id_)] for id_, model in config.lone.items()}
            twin = self.at_end.enter_context(twin_of(servos, lambda: self.now, has_bytes=has_bytes))
            self.faults = FaultScript(config.faults.values(), servos, twin)
            if isinstance(twin, TwinBus):
                if config.twin == "pty":
                    self.warn("bytes need real time, so servos are simulated without them")
                return twin
            path = str(twin.path)
        known = {servo.id: servo.model for joint in joints for servo in joint.servos} | config.lone
        opens, is_fast = bus_type(config.kind).open, config.fast
        bus = opens(path, known, baud=config.baud, clock=lambda: self.now, is_fast=is_fast)
        self.at_end.callback(bus.close)
        return bus

    def prepare(self, *drives: JointDrive) -> None:
        """Set the modes of the servos of some joints, or of all, and of those that controllers use."""
        bus, config, drives = self.cycle.bus, self.config, drives or tuple(self.cycle.drives.values())
        changes = prepare(bus, [drive.joint for drive in drives], config.watchdog, config.return_delay)
        for text in (*changes, *self.cycle.limit(drives), *set_up(self.cycle.items, bus)):
            self.info(text)

    def activate(self) -> None:
        """Begin the cycles; torque that an earlier driver has left on is kept if that is what the end is to be."""
        try:
            self.prepare()
            if self.config.on_shutdown != "relax":
                for name in self.cycle.drives:
                    self.start_by(name, "wait")
                self.keep_torque()
        except PortError as error:
            self.lose(error)
        if self.faults is not None:
            self.faults.start(self.now)
        is_real = not self.config.twin and isinstance(self.context.clock, MonotonicClock)
        if is_real and (reason := be_prompt()):
            self.info(f"cycles may be late on a busy machine: no real-time priority ({reason})")
        self.wake()

    def keep_torque(self) -> None:
        """Let joints hold that have torque, as soon as their servos have reported whether they have."""
        waiting = [drive.joint for drive in self.cycle.drives.values() if drive.policy.on_start == "wait"]
        for name, is_held in with_torque(self.cycle.bus, waiting).items() if waiting else ():
            self.start_by(name, "hold" if is_held else self.config.on_start)

    def start_by(self, name: str, how: Literal["relax", "hold", "wait"]) -> None:
        """Set what a joint does at its first measurement."""
        drive = self.cycle.drives[name]
        drive.policy = replace(drive.policy, on_start=how)

    def start(self) -> None:
        """Let controllers begin."""
        for controller in self.controllers.controllers.values():
            controller.start()

    def wake(self) -> None:
        """Run one cycle, and prepare the next, on a grid."""
        self.context.wake_at((math.floor(self.now / self.period + 1e-6) + 1) * self.period)
        if self.faults is not None:
            self.faults.play(self.now)
        if self.physics is not None and not self.physics.is_felt:
            return  # nobody knows yet where the joints are
        try:
            self.run_cycle()
        except PortError as error:
            self.lose(error)
        if self.physics is not None:
            self.bound["set_points"](self.physics.set_points(self.stamp))
        if self.now - self.reported_at >= REPORT:
            self.reported_at = self.now
            self.report()

    def on_moved(self, message: JointState) -> None:
        """Take over where the physics engine has moved the joints."""
        if self.physics is not None:
            self.physics.feel(message)

    def run_cycle(self) -> None:
        """Run the cycle with all active controllers, and publish."""
        if self.lost_at > -math.inf:
            if self.now - self.lost_at < REOPEN:
                return
            self.cycle.bus.reopen()
            for name in self.cycle.drives:  # their servos have no torque now, and may be elsewhere
                self.start_by(name, "relax")
                self.let_go(name)
            self.prepare()
            self.info("the bus of servos is back")
            self.lost_at = -math.inf
        self.keep_torque()
        self.periods.begin(self.now)
        if self.is_parking:
            self.park_the_rest()
        self.cycle.run(self.now, self.period, () if self.is_parking else self.controllers.leading)
        if back := [drive for drive in self.cycle.drives.values() if drive.is_back]:
            self.prepare(*back)  # it may be another servo, or as it was sold
        self.reboots.step(self.now)
        while self.cycle.notes:
            self.warn(self.cycle.notes.pop(0))
        if self.now - self.published_at >= self.pause:
            self.published_at = self.now
            self.publish()

    # Controllers

    def keep(self, controller: str, memory: object) -> None:
        """Give a controller this frozen dataclass again, as data, when it starts again."""
        self.kept = {**self.kept, controller: to_data(memory)}
        self.context.repeat([controller_manager.RecallControllers(self.kept)])

    def take_over(self, old: Self) -> None:
        """Let controllers go on from what those of a bus with other settings have known."""
        self.recall(controller_manager.RecallControllers(old.kept))

    @answers(controller_manager.RecallControllers)
    def recall(self, request: controller_manager.RecallControllers) -> str:
        """Let controllers go on from what they have known before a restart."""
        self.kept = {name: memory for name, memory in request.memories.items() if name in self.controllers.controllers}
        for name, memory in self.kept.items():
            self.controllers.controllers[name].recall(memory)
        return "controllers know what they did before the restart"

    def accept(self, controller: str, port: str, goal: Any) -> str:
        """Refuse what moves while the robot is stopped, or its bus has gone; else the controller decides."""
        return self.objection(controller) or self.controllers.controllers[controller].accept(port, goal)

    def asked(self, controller: str, port: str, request: Any) -> Any:
        """Pass a request on to a controller."""
        return self.controllers.controllers[controller].asked(port, request)

    @answers(controller_manager.ListControllers)
    def listed(self, request: controller_manager.ListControllers) -> tuple[controller_manager.ControllerState, ...]:
        """Return all controllers."""
        return tuple(
            controller_manager.ControllerState(
                name, controller.type_name, self.controllers.is_active(name), controller.config.claimed, controller.note
            )
            for name, controller in self.controllers.controllers.items()
        )

    @answers(controller_manager.SwitchControllers)
    def switch(self, request: controller_manager.SwitchControllers) -> str:
        """Switch controllers, all at once or not at all."""
        for text in (changes := list(self.controllers.switch(request.on, request.off, self.now))):
            self.info(text)
        return "; ".join(changes) or "nothing changes"

    @answers(controller_manager.ScaleMotion)
    def scale(self, request: controller_manager.ScaleMotion) -> str:
        """Let a controller follow its goals slower, or as fast as they ask for."""
        return self.controllers.set_pace(request.controller, request.share)

    # Joints

    def refusal(self) -> str:
        """Return why nothing may move now, or nothing."""
        return "the robot is stopped" if self.is_stopped else GONE if self.lost_at > -math.inf else ""

    def objection(self, controller: str) -> str:
        """Return why a controller may command nothing now, or nothing."""
        is_active = self.controllers.is_active(controller)
        return self.refusal() if is_active else f"controller '{controller}' is not active"

    def item(self, actuator: str, name: str, *, is_read: bool, setup: Mapping[str, int]) -> ServoItem:
        """Return an item of a servo, which the cycle reads or writes."""
        found = item_of(self.config, actuator, name, is_read, setup)
        self.cycle.items.append(found)
        return found

    def received(self, port: str, message: Any) -> None:
        """Pass a message on to its controller, or move one joint unless a controller leads it."""
        if port in self.owners:
            controller, short = self.owners[port]
            if not self.objection(controller):
                self.controllers.controllers[controller].received(short, message)
            return
        name = port.removesuffix("_command")
        leader, drive = self.controllers.leader(name), self.cycle.drives[name]
        drive.refused = f"controller '{leader}' leads it" if leader else self.refusal()
        if not drive.refused:
            drive.ask(MoveTo(message.data))

    def relax(self, name: str, request: Trigger.Request) -> Trigger.Response:
        """Switch the torque of a joint off, until its next command."""
        self.let_go(name)
        return Trigger.Response(success=True)

    def let_go(self, name: str) -> None:
        """Relax a joint; a controller that leads it ends what it does, or it would have torque again at once."""
        self.controllers.let_go(name, self.now, f"joint '{name}' was relaxed")
        self.cycle.drives[name].relax()

    def reboot(self, name: str, request: Trigger.Request) -> Later[Trigger.Response]:
        """Start the servos of a joint again, which a servo that has shut down needs; then it is relaxed."""
        response = Later[Trigger.Response]()
        self.controllers.let_go(name, self.now, f"the servos of joint '{name}' are started again")
        try:
            if self.lost_at > -math.inf:
                raise Refused(GONE)
            self.reboots.begin(
                self.cycle.drives[name],
                self.now,
                lambda reason: response.reply(Trigger.Response(success=not reason, message=reason)),
            )
        except PortError as error:
            self.lose(error)
            raise Refused(str(error)) from None
        return response

    def on_relax_all(self, request: Trigger.Request) -> Trigger.Response:
        """Relax all joints."""
        for name in self.cycle.drives:
            self.let_go(name)
        return Trigger.Response(success=True)

    def enable(self, name: str, request: SetBool.Request) -> SetBool.Response:
        """Enable a joint, unless it would take no command all the same; disabled, it has no torque and takes none."""
        drive = self.cycle.drives[name]
        refused = (self.refusal() or drive.objection(self.now, Enable(True), Hold())) if request.data else ""
        if not refused:
            drive.ask(Enable(request.data))
        return SetBool.Response(success=not refused, message=refused)

    def on_enable_all(self, request: SetBool.Request) -> SetBool.Response:
        """Enable all joints that can be, or disable all; name those that stay as they are."""
        answers = {name: self.enable(name, request) for name in self.cycle.drives}
        refused = [f"{name}: {answer.message}" for name, answer in answers.items() if not answer.success]
        return SetBool.Response(success=not refused, message="; ".join(refused))

    def set_speed(self, name: str, request: SetSpeed.Request) -> SetSpeed.Response:
        """Set how fast a joint moves by single commands, within its limits."""
        drive = self.cycle.drives[name]
        if not (math.isfinite(request.speed) and request.speed > 0.0):
            return SetSpeed.Response(
                success=False, message=f"the speed must be positive and finite, not {request.speed}"
            )
        if isinstance(drive, PositionDrive):
            drive.speed = request.speed
        fastest = drive.joint.limits.speed
        clamped = f"its limit is {fastest:g}" if request.speed > fastest else ""
        return SetSpeed.Response(success=True, message=clamped)

    @answers(InjectFault)
    def inject(self, request: InjectFault) -> str:
        """Let something go wrong with simulated servos."""
        if self.faults is None:
            raise Refused("real servos have their own faults")
        return self.faults.inject(request, self.now)

    @answers(ListFaults)
    def list_faults(self, request: ListFaults) -> Mapping[str, str]:
        """Return what may go wrong."""
        if self.faults is None:
            raise Refused("real servos have their own faults")
        return {name: fault.about for name, fault in FAULTS.items()}

    # What is published

    def publish(self) -> None:
        """Publish where the joints are, where they are commanded to be, and what controllers know."""
        if (message := joint_state(self.cycle.drives.values(), self.stamp)) is not None:
            self.joint_states(message)
        if self.joint_commands.is_wanted and (message := joint_command(self.cycle.drives.values(), self.stamp)):
            self.joint_commands(message)
        for controller in self.controllers.leading:
            controller.publish()

    def report(self) -> None:
        """Report to diagnostics."""
        notes = {name: controller.note for name, controller in self.controllers.controllers.items()}
        level, message, values = joint_report(self.cycle.drives, notes, self.periods, is_lost=self.lost_at > -math.inf)
        self.status(level, message, **values)

    # Stopping

    def lose(self, error: PortError) -> None:
        """Remember that the port has gone; trajectories end."""
        if self.lost_at == -math.inf:
            self.warn(str(error))
        self.lost_at = self.now
        self.periods.pause()
        self.halt(GONE)
        self.reboots.fail(GONE)

    def halt(self, reason: str) -> None:
        """End what all controllers do, and bring the joints to rest."""
        for controller in self.controllers.active:
            controller.halt(self.now, reason)
        for drive in self.cycle.drives.values():
            if drive.mode is JointMode.ACTIVE and drive.has_torque:
                drive.ask(Hold())

    @property
    def is_at_rest(self) -> bool:
        """Return whether no command moves, and all joints are where they are to be parked."""
        return all(drive.is_at_rest and not self.is_on_the_way(name) for name, drive in self.cycle.drives.items())

    def is_on_the_way(self, name: str) -> bool:
        """Return whether a joint has still to be parked."""
        drive, wanted = self.cycle.drives[name], self.config.park.get(name)
        if not self.is_parking or wanted is None or not drive.has_torque or self.lost_at > -math.inf:
            return False
        wanted = drive.joint.limits.clamped(wanted)
        return abs(drive.commanded.position - wanted) > drive.per_tick or drive.is_far_from(wanted)

    def stop(self) -> None:
        """Bring all joints to rest, and refuse what moves them."""
        self.is_stopped = True
        self.halt("the robot was stopped")

    def release(self) -> None:
        """Accept commands again."""
        self.is_stopped = False

    def brake(self) -> None:
        """Bring all joints to rest for good; those with torque are parked, but hold if the robot is stopped."""
        self.is_parking = self.config.on_shutdown == "park" and not self.is_stopped
        self.stop()
        for name, position in self.config.park.items() if self.is_parking else ():
            if self.cycle.drives[name].has_torque:
                self.cycle.drives[name].ask(MoveTo(position))

    def park_the_rest(self) -> None:
        """Move joints on that came to rest on their way, as where replies were lost for a moment."""
        for name, drive in self.cycle.drives.items():
            if self.is_on_the_way(name) and drive.is_at_rest:
                drive.ask(MoveTo(self.config.park[name]))

    def cleanup(self) -> None:
        """Let go of joints that are parked; if one is not yet, all hold."""
        is_parked = self.is_parking and self.is_at_rest
        has_to_hold = self.config.on_shutdown == "park" and not is_parked
        self.keeps_torque = self.config.on_shutdown == "hold" or has_to_hold
        if has_to_hold and any(drive.has_torque for drive in self.cycle.drives.values()):
            self.warn("joints are not parked: they hold")

    def end_torque(self) -> None:
        """Relax the joints; those that are to hold, or are not parked since this driver failed, only stop turning."""
        try:
            if deaf := self.cycle.end(is_kept=self.keeps_torque):
                left = "may still turn" if self.keeps_torque else "may still have torque"
                self.context.log(Level.ERROR, f"{_servo_names(deaf)} did not answer at the end, and {left}")
        except PortError as error:
            self.context.log(Level.ERROR, f"the torque of joints is left as it was: {error}")


def cycles_between(config: ServoBusConfig) -> int:
    """Return after how many cycles joint states are published."""
    return math.ceil(config.rate / PUBLISHED - 1e-9)
