"""Rules about triggers."""

from collections.abc import Iterator, Mapping

from rbxcompose.base.findings import Finding, Related, Severity, Span
from rbxcompose.base.rules import MISSIONS, WIRING
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.model.triggers import is_type, message_of
from rbxcompose.compiler.sections.triggers import CAUSES, TriggerModel, triggers
from rbxcompose.missions.analysis.examined import Examined, claims_of
from rbxcompose.missions.program.outcomes import FAILS, SUCCEEDS
from rbxcompose.missions.triggers.trigger import HALTED, INTERRUPT


def _all(robot: Robot) -> Mapping[str, TriggerModel]:
    return robot.manifest.contents.of(triggers)


def _place(robot: Robot, name: str, model: TriggerModel) -> Span:
    """Return the place of the cause of a trigger."""
    return robot.value("triggers", name, next(key for key in CAUSES if getattr(model, key) is not None))


@check("RBX4191", is_fixable=True)
def missing_mission(robot: Robot) -> Iterator[Finding]:
    """A trigger names a mission that the robot does not have."""
    names = robot.manifest.missions
    for name, model in _all(robot).items():
        for key, mission in (("mission", model.mission), ("ends", model.ends)):
            if mission and mission not in names and not robot.manifest.contents.may_have("mission", mission):
                place, message = robot.value("triggers", name, key), f"the robot has no mission '{mission}'"
                yield missing_mission.misspelt(place, message, mission, names, "missions of this robot")


@check("RBX4192")
def never_comes(robot: Robot) -> Iterator[Finding]:
    """The time of a trigger never comes."""
    for name, model in _all(robot).items():
        if model.schedule and not model.schedule.comes:
            message = f"'{model.cron}' never comes: none of its months has such a day"
            yield never_comes.at(_place(robot, name, model), message, help="change the day of the month, or the month")


@check("RBX4193", closed=(WIRING,))
def unknown_message(robot: Robot) -> Iterator[Finding]:
    """The type of the messages that start a mission is not known."""
    for name, model in _all(robot).items():
        if not model.message:
            continue
        if model.type is None and not message_of(robot, model):
            message = f"no component has the topic '{model.message}', so the type of its messages is not known"
            help_text = "write the type beside it, such as 'type: std_msgs/Empty'"
            yield unknown_message.at(_place(robot, name, model), message, help=help_text, about=[model.message])
        elif model.type and not is_type(model.type):
            place, message = robot.value("triggers", name, "type"), f"there is no type of messages '{model.type}'"
            yield unknown_message.at(place, message, help="'rbxcompose msg ls' lists those that there are")


@check("RBX4194", is_fixable=True, closed=(MISSIONS,))
def unknown_outcome(robot: Robot) -> Iterator[Finding]:
    """A trigger waits for an end that its mission does not have."""
    for name, model in _all(robot).items():
        if model.outcome is None or model.ends is None or model.ends not in robot.missions:
            continue
        program = robot.missions[model.ends].program
        own = Examined(program, robot.names).ending.of(program.main).named
        known = [SUCCEEDS, FAILS, HALTED, *own]
        if model.outcome not in known:
            place = robot.value("triggers", name, "outcome")
            message = f"the mission '{model.ends}' has no end '{model.outcome}'"
            yield unknown_outcome.misspelt(place, message, model.outcome, known, "its ends")


@check("RBX4195", closed=(MISSIONS,))
def rival_triggers(robot: Robot) -> Iterator[Finding]:
    """Two triggers of the same priority start missions at the same time, and each interrupts the other."""
    found = [(name, one) for name, one in _all(robot).items() if one.running == INTERRUPT]
    for index, (name, later) in enumerate(found):
        for other, earlier in found[:index]:
            if later.priority == earlier.priority and _coincide(earlier, later) and _clash(robot, earlier, later):
                message = f"'{name}' comes at the same time as '{other}', with the same priority, and ends its mission"
                yield rival_triggers.at(
                    _place(robot, name, later),
                    message,
                    help="give them different priorities: the higher one starts",
                    related=[Related(_place(robot, other, earlier), f"'{other}' comes here")],
                )
                break


def _coincide(one: TriggerModel, other: TriggerModel) -> bool:
    if one.schedule and other.schedule:
        return one.schedule.meets(other.schedule)
    causes = ("when", "message", "at_start", "ends")
    is_same = any(getattr(one, key) and getattr(one, key) == getattr(other, key) for key in causes)
    return is_same and (one.outcome == other.outcome or None in (one.outcome, other.outcome))


def _clash(robot: Robot, one: TriggerModel, other: TriggerModel) -> bool:
    """Return whether the missions are two that cannot run beside each other."""
    names = {one.mission, other.mission} & robot.missions.keys()
    claims = [claims_of(robot.missions[name].program, robot.names) for name in names]
    return len(claims) == len((one, other)) and bool(claims[0] & claims[1])


@check("RBX4196", Severity.WARNING, closed=(MISSIONS,))
def endless_triggers(robot: Robot) -> Iterator[Finding]:
    """The end of a mission starts it again, for ever."""
    leads: dict[str, list[tuple[str, str]]] = {}  # by mission: the triggers that its end fires, and their missions
    for name, model in _all(robot).items():
        if model.ends and model.outcome != HALTED:
            leads.setdefault(model.ends, []).append((name, model.mission))
    told: set[str] = set()
    for mission in leads:
        way = _way_back(mission, leads)
        if way and told.isdisjoint(way):
            told.update(way)
            first, rest = way[0], [Related(robot.key("triggers", name), "and this one") for name in way[1:]]
            message = f"whenever the mission '{mission}' ends, it starts again: this never stops by itself"
            yield endless_triggers.at(
                robot.value("triggers", first, "ends"),
                message,
                help="say which end counts, by 'outcome', or write 'repeat: forever' in one mission",
                related=rest,
            )


def _way_back(goal: str, leads: Mapping[str, list[tuple[str, str]]]) -> tuple[str, ...]:
    """Return the fewest triggers by which the end of a mission leads to its start; nothing if none do."""
    ways: dict[str, tuple[str, ...]] = {goal: ()}
    for mission in (found := [goal]):
        for name, following in leads.get(mission, ()):
            if following == goal:
                return (*ways[mission], name)
            if following not in ways:
                ways[following] = (*ways[mission], name)
                found.append(following)
    return ()


@check("RBX4197")
def two_starts(robot: Robot) -> Iterator[Finding]:
    """`start:` runs a mission while a trigger starts another one."""
    for name, model in _all(robot).items():
        if model.at_start and robot.manifest.start is not None:
            start = robot.manifest.start
            yield two_starts.at(
                robot.key("triggers", name, "at_start"),
                f"'start' runs the mission '{start}' at the same time",
                help=f"remove 'start: {start}', or let this one follow it: 'ends: {start}'",
                related=[Related(robot.value("start"), "the mission that starts, too")],
            )
