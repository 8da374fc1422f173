"""Binding: each declared port of a component becomes a live end on the bus."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol, cast

from rbxcompose.base.clock import NANOSECONDS as PER_SECOND
from rbxcompose.base.clock import Clock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain
from rbxcompose.base.requests import Refused
from rbxcompose.base.transforms import TransformAnswer, TransformError, TransformTree
from rbxcompose.bus.actions import ActionServer
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.services import ServedRequest
from rbxcompose.bus.wire import queue_depth
from rbxcompose.compiler.plan.model import Instance
from rbxcompose.missions.sources import PAUSE
from rbxcompose.msgs.poses import transform_of
from rbxcompose.msgs.stamps import NANOSECONDS, to_nanoseconds
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.runtime.process_group.worker import Call, Worker
from rbxcompose.sdk import ports
from rbxcompose.sdk.bound import Later, Sender
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.updater import CompositeTask, DiagnosticTask, FrequencyTask, StampTask


def paced(sender: Sender[Any], port: ports.Out[Any], clock: Clock, watch: Callable[[str, DiagnosticTask], None]) -> Any:
    """Return `sender`, or one that counts if its port declares a rate."""
    if port.rate is None:
        return sender
    stamps = StampTask() if port.interface is not None and "header" in port.interface.FIELDS else None
    made = _Paced(sender, FrequencyTask(port.rate), stamps, clock)
    watch(port.topic.lstrip("/"), made.task)
    return made


class _Paced:
    """A publisher that counts its messages."""

    def __init__(self, sender: Sender[Any], rate: FrequencyTask, stamps: StampTask | None, clock: Clock) -> None:
        self._sender, self._rate, self._stamps, self._clock = sender, rate, stamps, clock
        self.task = rate.status if stamps is None else CompositeTask(rate.status, stamps.status).status

    @property
    def is_wanted(self) -> bool:
        """Return whether anything would receive a message; a component that asks in vain is as punctual."""
        if not (wanted := self._sender.is_wanted):
            self._rate.tick()
        return wanted

    def __call__(self, message: Any, /) -> None:
        self._rate.tick()
        if self._stamps is not None:
            self._stamps.tick(to_nanoseconds(message.header.stamp) / NANOSECONDS, self._clock.stamp() / NANOSECONDS)
        self._sender(message)


MOST_LOGGED = 20  # things about transforms that are logged


@dataclass(frozen=True, slots=True)
class Lookup:
    """The pose of frame `source` in frame `target`, newest or at a time."""

    frames: Frames
    target: str
    source: str

    def now(self) -> Pose2 | None:
        """Return the pose [m, m, rad], or None while the frames are not connected."""
        found = self.frames.lookup(self.target, self.source)
        return found.to_pose2() if found else None

    def transform(self, *, at: int | None = None) -> Transform3:
        """Return the newest pose, or that at a stamp [ns], interpolated.

        Raises:
            LookupError: if there is none; the text names the frames or the times that there are.
        """
        return self.frames.transform(self.target, self.source, at)


class Frames:
    """Feeds a transform tree from `/tf` and `/tf_static`.

    Poses are published often and looked up rarely. In real time, the process is not woken for each of them: they are
    taken when somebody looks one up. On any other clock it is, so that the order of events at an instant is the same in
    each run.
    """

    def __init__(
        self, owner: str, bus: Bus, clock: Clock, *, is_patient: bool, log: Callable[[Level, str], None]
    ) -> None:
        self.tree = TransformTree()
        self._clock, self._log = clock, log
        self._logged: set[str] = set()
        self._lock = threading.Lock()  # who looks back from another thread must not see a history that changes
        self._moving = bus.subscribe(owner, "/tf", TFMessage, ports.Qos.STATE, self._move, is_patient=is_patient)
        bus.subscribe(owner, "/tf_static", TFMessage, ports.Qos.LATCHED, self._fix)

    def lookup(self, target: str, source: str) -> Transform3 | None:
        """Return the newest pose of frame `source` in frame `target`, or None while they are not connected."""
        self._moving.catch_up()
        return self.tree.lookup(target, source)

    def transform(self, target: str, source: str, at: int | None = None) -> Transform3:
        """Return the newest pose of frame `source` in frame `target`, or that at a stamp [ns].

        Raises:
            TransformError: if there is none.
        """
        self._moving.catch_up()
        with self._lock:
            found = self.tree.lookup(target, source) if at is None else self.tree.lookup_at(target, source, at)
            if found is None:
                raise self.tree.problem(target, source) or TransformError(f"'{source}' has no pose in '{target}'")
        return found

    def hurry(self) -> None:
        """Take each pose when it arrives: another thread looks them up and must not take them itself."""
        self._moving.hurry()

    def _fix(self, message: TFMessage) -> None:
        self._take(message, 0.0, static=True)

    def _move(self, message: TFMessage) -> None:
        self._take(message, self._moving.age, static=False)

    def _take(self, message: TFMessage, age: float, *, static: bool) -> None:
        received, unstamped = self._clock.now() - age, self._clock.stamp() - round(age * PER_SECOND)
        with self._lock:
            for transform in message.transforms:
                time = to_nanoseconds(transform.header.stamp) or unstamped
                parent, child, pose = (
                    transform.header.frame_id,
                    transform.child_frame_id,
                    transform_of(transform.transform),
                )
                answer = self.tree.set(parent, child, pose, stamp=received, static=static, measured=time)
                if answer.message:
                    self._log_once(answer)

    def _log_once(self, answer: TransformAnswer) -> None:
        """Log once what is unusual about a transform; after very many such, nothing more."""
        text = plain(answer.message)
        if text in self._logged or len(self._logged) == MOST_LOGGED:
            return
        self._logged.add(text)
        if answer.accepted:
            self._log(Level.OK, text)
        else:
            self._log(Level.WARN, f"a transform is refused: {text}")


class Handling(Protocol):
    """What runs the handlers of a component."""

    clock: Clock

    @property
    def worker(self) -> Worker | None:
        """Return the component's own thread, if it has one."""
        ...

    def refusal(self, port: ports.Port[Any]) -> str:
        """Return why a message, request or goal cannot be taken now; empty if it can."""
        ...

    def do(self, label: str, call: Callable[[], None], *, depth: int | None = None) -> None:
        """Run `call` in the thread that the component belongs to."""
        ...

    def log(self, level: Level, text: str) -> None:
        """Write one event of the robot's story."""
        ...

    def watch(self, name: str, task: DiagnosticTask) -> None:
        """Report how `task` stands to diagnostics."""
        ...


def bind(component: Component[Any], instance: Instance, bus: Bus, frames: Frames | None, handling: Handling) -> None:
    """Fill `component.bound`; incoming data go to its handlers unless there is a reason to refuse them.

    Of an end that a program of others has, there is only the absolute name.
    """
    for name, port in type(component).ports(component.config).items():
        if port.is_elsewhere:
            component.bound[name] = instance.topic(name)
            continue
        component.bound[name] = _end(component, instance, name, port, bus, frames, handling)


def subscribe(
    component: Component[Any], owner: str, topic: str, port: ports.In[Any], bus: Bus, handling: Handling
) -> Any:
    """Subscribe to a topic; its messages go to the handler of the port."""
    handler = _on_message(component, port.name, port, handling)
    waits = isinstance(port, ports.ServesTopic)  # like goals: a sender that waits for a listener relies on it
    is_light, interface = handling.worker is None, cast(Any, port.interface)
    return bus.subscribe(
        owner,
        topic,
        interface,
        port.qos,
        handler,
        max_rate=port.max_rate,
        limits=port.limits,
        waits=waits,
        is_light=is_light,
        may_be_silent=port.may_be_silent,
    )


def _end(
    component: Component[Any],
    instance: Instance,
    name: str,
    port: ports.Port[Any],
    bus: Bus,
    frames: Frames | None,
    handling: Handling,
) -> object:
    owner, interface = instance.name, cast(Any, port.interface)
    match port:
        case ports.Looks():
            return _lookup(port, frames, handling)
        case ports.SendsOrders():
            return bus.orders(owner, instance.topic(name), interface, port.qos, port.servers)
        case ports.Out():
            publisher = bus.publisher(owner, instance.topic(name), interface, port.qos)
            return paced(publisher, port, handling.clock, handling.watch)
        case ports.In():
            return subscribe(component, owner, instance.topic(name), port, bus, handling)
        case ports.Serves():
            serve = _on_request(component, name, port, handling)
            bus.serve_later(owner, instance.topic(name), interface, serve, waits=True, limits=port.limits)
            return None
        case ports.Calls():
            return bus.client(owner, instance.topic(name), interface)
        case ports.ServesAction():
            topic = instance.topic(name)
            accept = _on_goal(component, name, port, handling)
            server = bus.serve_action(owner, topic, interface, accept, waits=True, limits=port.limits)
            if port.pausable:
                bus.serve(owner, f"{topic}/{PAUSE}", SetBool, partial(_pause, server, port, handling))
            return server
        case ports.CallsAction():
            return bus.action_client(owner, instance.topic(name), interface)
        case _:
            raise TypeError(f"'{instance.type}' has a port of an unknown kind: {port!r}")


def _lookup(port: ports.Looks, frames: Frames | None, handling: Handling) -> Lookup:
    if frames is None:
        raise RuntimeError("a process with components that look keeps frames")
    if handling.worker is not None:
        frames.hurry()
    return Lookup(frames, port.target, port.source)


def _pause(
    server: ActionServer[Any, Any, Any], port: ports.Port[Any], handling: Handling, request: SetBool.Request
) -> SetBool.Response:
    """Pause or resume the current goal; while the robot is stopped, nothing resumes."""
    goal = server.current
    if goal is None:
        return SetBool.Response(success=False, message="no goal is being carried out")
    if not request.data and (reason := handling.refusal(port)):
        return SetBool.Response(success=False, message=reason)
    goal.is_paused = request.data
    return SetBool.Response(success=True)


def _on_message(component: Component[Any], name: str, port: ports.In[Any], handling: Handling) -> Callable[[Any], None]:
    own = getattr(component, f"on_{name}", None)
    handler: Callable[[Any], None] = own if own is not None else partial(component.received, name)
    label, depth = f"on_{name}", queue_depth(port.qos)

    def take(message: Any) -> None:
        reason = handling.refusal(port)
        if not reason:  # else it only stays the newest value, for whoever reads it
            handling.do(label, partial(handler, message), depth=depth)
        elif isinstance(port, ports.ServesTopic):
            handling.log(Level.WARN, f"an order to {name} is not carried out: {reason}")

    return take


def _on_request(
    component: Component[Any], name: str, port: ports.Port[Any], handling: Handling
) -> Callable[[ServedRequest[Any, Any]], None]:
    answer = getattr(component, f"on_{name}")

    def serve(request: ServedRequest[Any, Any]) -> None:
        if reason := handling.refusal(port):
            raise Refused(reason)
        worker = handling.worker
        send = worker.send if worker is not None else _at_once
        handling.do(f"on_{name}", partial(_answer, request, answer, send))

    return serve


def _answer(request: ServedRequest[Any, Any], answer: Callable[[Any], Any], send: Callable[[Call], None]) -> None:
    try:
        response = answer(request.message)
    except Refused as refusal:
        send(partial(request.fail, str(refusal)))
    except (Exception, SystemExit) as error:
        send(partial(request.fail, f"{type(error).__name__}: {error}"))
        raise
    else:
        reply = response.then if isinstance(response, Later) else lambda then: then(response)
        reply(lambda answer: send(partial(request.reply, answer)))


def _at_once(call: Call) -> None:
    call()


def _on_goal(component: Component[Any], name: str, port: ports.Port[Any], handling: Handling) -> Callable[[Any], str]:
    accept: Callable[[Any], str] = getattr(component, f"accept_{name}", lambda goal: "")
    return lambda goal: handling.refusal(port) or accept(goal)
