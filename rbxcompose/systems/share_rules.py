"""What is wrong with what robots share, and with what they take from each other."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from rbxcompose.findings import Finding, Severity, Span, kind
from rbxcompose.sdk.ports import In, Out
from rbxcompose.systems.exchange import (
    TAKEN_BY,
    endpoint_for,
    full_name,
    givers_of,
    is_called,
    may_call,
    shared_name,
    takers_of,
)
from rbxcompose.systems.model import PlacedRobot, System
from rbxcompose.systems.traffic import TopicEnd

NOT_PUBLISHED = kind("RBX6123", is_fixable=True)
NOT_SHARED = kind("RBX6124", Severity.WARNING)
TAKEN_NAME = kind("RBX6125")
OTHER_TYPE = kind("RBX6126")
UNREACHED_SHARE = kind("RBX6127")
NO_CALLER = kind("RBX6150")
UNKNOWN_CALLER = kind("RBX6151", is_fixable=True)
NOT_A_CALLER = kind("RBX6152")
_WORDS = {"msg": "topic", "srv": "service", "action": "action"}


def share_findings(system: System) -> Iterator[Finding]:
    """Yield what is wrong with what robots share, and with what they take from each other."""
    takers = takers_of(system)
    labels = {label for robot in system.robots.values() for label in robot.labels}
    for robot in system.robots.values():
        for index, name in enumerate(robot.model.callers):
            if name not in labels:
                span, message = robot.span(system.root, "callers", index), f"the system has no robot '{name}'"
                yield UNKNOWN_CALLER.misspelt(span, message, name, sorted(labels), "robots and labels")
        for index, name in enumerate(robot.model.share):
            span = robot.span(system.root, "share", index)
            givers = givers_of(robot, full_name(robot, name))
            if givers:
                own = [one for one in takers.get(shared_name(robot.name, name), ()) if one[0] is not robot]
                yield from _wrong_takers(system, robot, name, own, span)
            else:
                valid = sorted({one.topic.removeprefix("/") for one in robot.ends if _gives(one)})
                message = f"no component of '{robot.name}' publishes or serves '{name}'"
                yield NOT_PUBLISHED.misspelt(span, message, name.removeprefix("/"), valid, "what it has")
            if givers and is_called(givers[0]) and not robot.model.callers:
                message = f"'{name}' is {_kind(givers[0])}, and nobody may call it"
                yield NO_CALLER.at(span, message, help="add 'callers' with the robots that may")
        yield from _unshared(system, robot)


def _gives(one: TopicEnd) -> bool:
    return isinstance(one.end.port, tuple(TAKEN_BY))


def _kind(one: TopicEnd) -> str:
    word = _WORDS[one.type.split("/")[1]]
    return f"{'an' if word == 'action' else 'a'} {word}"


def _wrong_takers(
    system: System, robot: PlacedRobot, name: str, takers: Iterable[tuple[PlacedRobot, TopicEnd]], span: Span
) -> Iterator[Finding]:
    shared, first = shared_name(robot.name, name), givers_of(robot, full_name(robot, name))[0]
    for taker, end in takers:
        where, given = f"'{end.end.component}' of '{taker.name}'", first.end.host
        if end.type != first.type:
            yield OTHER_TYPE.at(span, f"{where} takes {shared} for {_typed(end)}, and it is {_typed(first)}")
        elif is_called(first) and robot.model.callers and not may_call(robot, taker):
            message = f"{where} calls {shared}, and '{taker.name}' is not among the callers of '{robot.name}'"
            names = ", ".join([*robot.model.callers, taker.name])
            at = robot.span(system.root, "callers")
            yield NOT_A_CALLER.at(at, message, help=f"if it may: callers: [{names}]")
        if not endpoint_for(system, robot, given, is_local=given == end.end.host):
            message = f"{where} runs on '{end.end.host}' and needs {shared} from '{given}', which has no address"
            yield UNREACHED_SHARE.at(span, message, help=f"give '{given}' an 'address'")
        for one in (robot, taker):
            if one.plan.bus.router is not None:
                message = f"'{one.name}' has 'bus.router', so {shared} cannot get to {where}"
                yield UNREACHED_SHARE.at(span, message, help="remove 'bus.router'")
    for other in system.robots.values():
        for end in givers_of(other, shared) if other is not robot else ():
            does = "publishes" if isinstance(end.end.port, Out) else "serves"
            message = f"'{end.end.component}' of '{other.name}' {does} {shared}, which '{robot.name}' shares"
            yield TAKEN_NAME.at(span, message, help="give it another name there")


def _typed(one: TopicEnd) -> str:
    is_plain = isinstance(one.end.port, In | Out)
    return f"a {one.type}" if is_plain else f"{_kind(one)} {one.type}"


def _unshared(system: System, robot: PlacedRobot) -> Iterator[Finding]:
    """Yield a finding for each end that takes something of another robot that this one does not share."""
    for one in robot.ends:
        name, _, own = one.topic.removeprefix("/").partition("/")
        other = system.robots.get(name)
        if _gives(one) or other is None or other is robot or givers_of(robot, one.topic):
            continue
        if one.topic not in {shared_name(name, each) for each in other.model.share}:
            does = "listens to" if isinstance(one.end.port, In) else "calls"
            message = f"'{one.end.component}' of '{robot.name}' {does} {one.topic}, which '{name}' does not share"
            yield NOT_SHARED.at(other.span(system.root), message, help=_cure(other, own))


def _cure(robot: PlacedRobot, name: str) -> str:
    given: Collection[str] = {one.topic.removeprefix("/") for one in robot.ends if _gives(one)}
    if name in given:
        return f"share: [{', '.join([*robot.model.share, name])}]"
    return f"'{robot.name}' has {', '.join(sorted(given))}"
