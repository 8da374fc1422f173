"""Rules about muxes: sources, ranks, timeouts, locks, and what meets on a topic without one or beside one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby

from rbxcompose.base.findings import (
    NAMES,
    WIRING,
    Finding,
    Related,
    Severity,
    clauses,
    correction,
    suggest,
    surely_meant,
)
from rbxcompose.base.units import TIME, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.checks.wiring import is_command
from rbxcompose.compiler.model.build import MISSION
from rbxcompose.compiler.model.flow import Wrong, is_written, period_of, setting_span
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotComponent, resolve
from rbxcompose.domains.muxes.config import HIGHEST, MODE_OF, TIMELESS, VELOCITIES, HoldFirst, MuxConfig, is_own
from rbxcompose.domains.muxes.requests import NONE
from rbxcompose.domains.muxes.sections.muxes import MuxModel, muxes
from rbxcompose.missions.analysis.facts import published
from rbxcompose.sdk.capabilities import CommandsMotion, Drives, Forwards, Setting
from rbxcompose.sdk.ports import In, Looks, Out, Port, Qos

_MOST_SHOWN = 8  # inputs that are pointed at
ENDINGS = ("on_idle", "on_lock")
LONGEST = 60.0  # [s]: commands come many times a second
TYPE = "message"  # the setting of those whose type is chosen


@check("RBX3130")
def mux_heartbeat(robot: Robot) -> Iterator[Finding]:
    """A heartbeat of a mux has no timeout."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        for name, lock in entry.locks.items():
            if lock.timeout is None and lock.topic is None:
                yield mux_heartbeat.at(
                    robot.key("muxes", mux, "locks", name),
                    f"lock '{name}' of mux '{mux}' never engages: it has no timeout",
                    help="add 'timeout: 0.3 s', or the 'topic' of a flag",
                )


@check("RBX3132", is_fixable=True)
def mux_initial(robot: Robot) -> Iterator[Finding]:
    """What a mux selects first is not one of its inputs."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        if entry.works_by == "select" and entry.initial is not None and entry.initial not in (NONE, *entry.inputs):
            span = robot.value("muxes", mux, "initial")
            yield mux_initial.at(
                span,
                f"mux '{mux}' has no input '{entry.initial}'",
                help=suggest(entry.initial, [*entry.inputs, NONE], "inputs"),
                fix=correction(entry.initial, entry.inputs, span),
            )


@check("RBX3138")
def mux_name(robot: Robot) -> Iterator[Finding]:
    """An input or a lock of a mux has a name that the mux needs itself."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        names = [("inputs", name) for name in entry.inputs] + [("locks", name) for name in entry.locks]
        for key, name in names:
            if is_own(name):
                yield mux_name.at(
                    robot.key("muxes", mux, key, name),
                    f"mux '{mux}' needs the name '{name}' itself",
                    help="choose another name",
                )


@check("RBX3136")
def mux_no_time(robot: Robot) -> Iterator[Finding]:
    """A timeout of a mux is 0."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        timeouts = [("inputs", name, mux_input.timeout) for name, mux_input in entry.inputs.items()]
        timeouts += [("locks", name, lock.timeout) for name, lock in entry.locks.items()]
        for key, name, timeout in timeouts:
            if timeout == 0 and entry.profile not in TIMELESS:
                yield mux_no_time.at(
                    robot.value("muxes", mux, key, name, "timeout"),
                    f"{key[:-1]} '{name}' of mux '{mux}' has no time at all",
                    help="a few times the time between two messages is enough, such as '0.5 s'",
                )


@check("RBX3111")
def mux_of_mux(robot: Robot) -> Iterator[Finding]:
    """An input of a mux takes from a mux."""
    known, namespace = robot.manifest.contents.of(muxes), robot.manifest.bus.namespace or ""
    for mux, entry in known.items():
        own = resolve(entry.topic or mux, namespace)
        for name, mux_input in entry.inputs.items():
            is_own_topic = resolve(mux_input.topic or "", namespace) == own
            source = mux if is_own_topic else (mux_input.source or "").partition(".")[0]
            if source not in known:
                continue
            is_loop = source == mux
            message = "takes its own output" if is_loop else f"takes from the mux '{source}'"
            inputs = ", ".join(f"'{each}'" for each in known[source].inputs)
            yield mux_of_mux.at(
                robot.value("muxes", mux, "inputs", name, "topic" if is_own_topic else "from"),
                f"input '{name}' of mux '{mux}' {message}",
                help="remove this input" if is_loop else f"give this mux the inputs of that one: {inputs}",
                related=[Related(robot.key("muxes", source), "the mux that it takes from")],
            )


@check("RBX3104")
def mux_priority(robot: Robot) -> Iterator[Finding]:
    """Two inputs of a mux have the same priority."""
    for mux, name, _, priority, related in _same_priorities(robot, "default"):
        yield mux_priority.at(
            robot.value("muxes", mux, "inputs", name, "priority"),
            f"two inputs of mux '{mux}' have the same priority {priority}",
            label=f"input '{name}'",
            help="the higher priority wins: give each input its own",
            related=related,
        )


@check("RBX3137", Severity.WARNING)
def mux_same_rank(robot: Robot) -> Iterator[Finding]:
    """Two inputs of a mux have the same priority, and the one that holds it keeps it."""
    for mux, name, other, rank, related in _same_priorities(robot, "yocs"):
        yield mux_same_rank.at(
            robot.value("muxes", mux, "inputs", name, "priority"),
            f"inputs '{other}' and '{name}' of mux '{mux}' have the same priority {rank}: who holds keeps it",
            help="give each input its own priority",
            related=related,
        )


def _same_priorities(robot: Robot, profile: str) -> Iterator[tuple[str, str, str, int, list[Related]]]:
    """Yield mux, input, an earlier input of the same priority, that priority, and the earlier one's place."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        first: dict[int, str] = {}
        for name, rank in entry.ranks.items() if entry.profile == profile else ():
            other = first.setdefault(rank, name)
            if other != name:
                place = robot.value("muxes", mux, "inputs", other, "priority")
                yield mux, name, other, rank, [Related(place, f"input '{other}'")]


@check("RBX3134", Severity.WARNING)
def mux_rank_range(robot: Robot) -> Iterator[Finding]:
    """A priority beyond those of the profile `twist_mux`."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        if entry.profile != "twist_mux":
            continue
        for name, rank in entry.ranks.items():
            if not 0 < rank <= HIGHEST:
                effect = f"counts as {HIGHEST}" if rank > 0 else "never gets through"
                yield mux_rank_range.at(
                    robot.value("muxes", mux, "inputs", name, "priority"),
                    f"input '{name}' of mux '{mux}' {effect}: its priority is {rank}",
                    help=f"give it a priority from 1 to {HIGHEST}",
                )


@check("RBX3135", closed=(WIRING,))
def mux_rest(robot: Robot) -> Iterator[Finding]:
    """A mux is to stop what zeros do not stop."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        config = _config(robot.components.get(mux))
        if config is None:
            continue
        for path in _stops(entry) if not config.has_rest else ():
            yield mux_rest.at(
                robot.key("muxes", mux, *path),
                f"zeros of {config.message} are no rest, so mux '{mux}' cannot stop with them",
                help="leave it out; or, if zeros are rest for the receiver, add 'zero_stops: true'",
            )
        if entry.handover is not None and config.message not in VELOCITIES:
            yield mux_rest.at(
                robot.key("muxes", mux, "handover"),
                f"a hand-over is for velocities, and mux '{mux}' forwards {config.message}",
                help="leave it out",
            )


def _config(component: RobotComponent | None) -> MuxConfig | None:
    return component.config if component and isinstance(component.config, MuxConfig) else None


def _stops(entry: MuxModel) -> Iterator[tuple[str, ...]]:
    """Yield the paths of keys that need a message of rest."""
    for key, ending in (("on_idle", entry.on_idle), ("on_lock", entry.on_lock)):
        if ending not in (None, "none"):
            yield (key,)
    yield from (("inputs", name, "zero_releases") for name, item in entry.inputs.items() if item.zero_releases)


@check("RBX3003", is_fixable=True, closed=(NAMES,))
def mux_source(robot: Robot) -> Iterator[Finding]:
    """The `from:` of a mux input names no output."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        for name, source in entry.inputs.items():
            if source.source is None:
                continue
            if wrong := missing(robot, source.source) or unclear(robot, mux, source.source):
                span = robot.value("muxes", mux, "inputs", name, "from")
                fix = correction(wrong.name, wrong.valid, span, within=source.source)
                message = f"input '{name}' of mux '{mux}' {wrong.message}"
                yield mux_source.at(span, message, help=wrong.help, fix=fix, about=[name, mux, wrong.name])


def missing(robot: Robot, source: str) -> Wrong | None:
    """Return what is wrong with the source of a mux input; None if it exists."""
    component, _, port = source.partition(".")
    if component not in robot.written | robot.brought:
        message = f"takes from a component that the robot does not have: '{component}'"
        valid = robot.manifest.components
        is_sure = surely_meant(component, set(valid)) is not None
        is_open = "" if is_sure else "without 'from' the input is open to the outside"
        return Wrong(message, clauses(suggest(component, valid, "components of this robot"), is_open), component, valid)
    part = robot.components.get(component)
    if part is None:
        return None  # it exists, but has mistakes, which are reported at their own place
    outputs = [end.name for end in part.ends if isinstance(end.port, Out)]
    if port and port not in outputs:
        message = f"takes from an output that '{component}' does not have: '{port}'"
        return Wrong(message, suggest(port, outputs, "its outputs"), port, outputs)
    if not outputs:
        return Wrong(f"takes from '{component}', which publishes nothing")
    return None


def unclear(robot: Robot, mux: str, source: str) -> Wrong | None:
    """Return the error of a source that does not say which of several outputs is meant, None if it is clear."""
    component, _, port = source.partition(".")
    part = robot.components.get(component)
    if part is None or port:
        return None
    outputs = [end for end in part.ends if isinstance(end.port, Out)]
    if len(outputs) == 1 or any(end.port.topic == mux for end in outputs):
        return None
    names = ", ".join(f"{component}.{end.name}" for end in outputs)
    return Wrong(f"takes from '{component}', which publishes nothing on '{mux}'", f"name one of its outputs: {names}")


@check("RBX3101")
def mux_timeout(robot: Robot) -> Iterator[Finding]:
    """An input of a mux times out between two of its messages."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        for name, source in entry.inputs.items():
            component = robot.components.get((source.source or "").partition(".")[0])
            period = period_of(component) if component else None
            if component and period is not None and source.timeout and source.timeout < 2 * period - 1e-9:
                when = "before" if source.timeout <= period else "if one message is late, before"
                yield mux_timeout.at(
                    robot.value("muxes", mux, "inputs", name, "timeout"),
                    f"input '{name}' of mux '{mux}' times out {when} '{component.name}' sends its next message",
                    label=f"it sends every {format_quantity(period, TIME)}",
                    help=f"make it several times as long: '{format_quantity(10 * period, TIME)}'",
                    related=[Related(robot.component_span(component.name), "the source")],
                )


@check("RBX3107", closed=(WIRING,))
def mux_type(robot: Robot) -> Iterator[Finding]:
    """A mux input takes an output of another type."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        for name, mux_input in entry.inputs.items():
            own = robot.components[mux].end(name)
            component = (mux_input.source or "").partition(".")[0]
            for writer in robot.writers.get(own.topic, ()) if own else ():
                if own and writer.instance == component and writer.type_name != own.type_name:
                    yield mux_type.at(
                        robot.value("muxes", mux, "inputs", name, "from"),
                        f"input '{name}' of mux '{mux}' takes {writer.type_name}, but the mux forwards {own.type_name}",
                        help=f"take an output of type {own.type_name}",
                        related=[Related(robot.component_span(component), "the source")],
                    )


@check("RBX3133", Severity.WARNING)
def mux_unreached(robot: Robot) -> Iterator[Finding]:
    """An input of a mux never gets through."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        ranks = entry.ranks if entry.profile == "twist_mux" else {}
        endless = [name for name, rank in ranks.items() if rank > 0 and not entry.inputs[name].timeout]
        top = max(endless, key=lambda name: ranks[name], default="")
        places = list(ranks)
        below = [
            name
            for place, (name, rank) in enumerate(ranks.items())
            if top and (rank, -place) < (ranks[top], -places.index(top))
        ]
        if below:
            shown = ", ".join(f"'{name}'" for name in below)
            yield mux_unreached.at(
                robot.value("muxes", mux, "inputs", top, "timeout"),
                f"input '{top}' of mux '{mux}' never expires, so what is below it never gets through: {shown}",
                help="give it a timeout such as '0.5 s'",
                related=[Related(robot.key("muxes", mux, "inputs", name), "held back") for name in below[:_MOST_SHOWN]],
            )


@check("RBX3131")
def mux_word(robot: Robot) -> Iterator[Finding]:
    """A key of a mux has no meaning in its mode."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        if entry.profile != "default" and entry.works_by != MODE_OF[entry.profile]:
            message = f"the profile '{entry.profile}' of mux '{mux}' has the mode '{MODE_OF[entry.profile]}'"
            yield mux_word.at(robot.value("muxes", mux, "mode"), message, help="leave one of them out")
        for path in _meaningless(entry):
            yield mux_word.at(
                robot.key("muxes", mux, *path),
                f"'{path[-1]}' has no meaning in the mode '{entry.works_by}' of mux '{mux}'",
                help="leave it out, or choose another mode",
            )


def _meaningless(entry: MuxModel) -> Iterator[tuple[str, ...]]:
    """Yield the paths of keys that the mode does not know."""
    if entry.works_by != "select":
        yield from ((key,) for key in ("initial", "lazy") if key in entry.model_fields_set)
    if not entry.has_priorities:
        yield from (("inputs", name, "priority") for name, item in entry.inputs.items() if item.priority is not None)
        yield from (("locks", name, "priority") for name, lock in entry.locks.items() if lock.priority is not None)


@check("RBX3514", Severity.WARNING, closed=(WIRING,))
def idle_hold(robot: Robot) -> Iterator[Finding]:
    """A mux holds a command for longer than the base follows it."""
    bases = list(_bases(robot))
    for mux, entry in robot.manifest.contents.of(muxes).items():
        for ending in ENDINGS:
            written = getattr(entry, ending)
            brakes = [(base, after) for base, after, name in bases if name == mux]
            if not isinstance(written, HoldFirst) or not brakes:
                continue
            base, after = max(brakes, key=lambda brake: brake[1].value)
            if written.hold > after.value:
                held, braked = format_quantity(written.hold, TIME), format_quantity(after.value, TIME)
                yield idle_hold.at(
                    robot.value("muxes", mux, ending, "hold"),
                    f"'{mux}' holds the last command for {held}, but '{base.name}' brakes after {braked}",
                    help=f"make it shorter than {braked}",
                    related=[Related(setting_span(robot, (base, after.field)), "it brakes")],
                )


def _bases(robot: Robot) -> Iterator[tuple[RobotComponent, Setting[float], str]]:
    """Yield each base that brakes by itself, with each mux that sends it commands."""
    for base, drives in robot.declared(Drives):
        end = base.end(drives.commands)
        for writer in robot.writers.get(end.topic, ()) if end and drives.stops_after else ():
            sender = robot.components[writer.instance]
            if drives.stops_after and any(forwards.output == writer.name for forwards in sender.declared(Forwards)):
                yield base, drives.stops_after, sender.name


@check("RBX3105")
def idle_lock(robot: Robot) -> Iterator[Finding]:
    """A lock of a mux blocks no input."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        ranks = entry.ranks
        lowest = min(ranks, key=lambda name: ranks[name], default="")
        for name, priority in entry.lock_ranks.items():
            if lowest and priority <= ranks[lowest]:
                yield idle_lock.at(
                    robot.value("muxes", mux, "locks", name, "priority"),
                    f"lock '{name}' of mux '{mux}' holds back no input: none has a priority below {priority}",
                    help="give it a higher priority than the inputs that it should hold back",
                    related=[Related(robot.value("muxes", mux, "inputs", lowest, "priority"), "the lowest input")],
                )


@check("RBX3109")
def lock_timeout(robot: Robot) -> Iterator[Finding]:
    """A lock of a mux engages between two of its heartbeats."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        for name, lock in entry.locks.items():
            end = robot.components[mux].end(f"lock_{name}") if mux in robot.components else None
            for writer in robot.writers.get(end.topic, ()) if end else ():
                period = period_of(robot.components[writer.instance])
                if period is not None and lock.timeout and lock.timeout < 2 * period - 1e-9:
                    when = "before" if lock.timeout <= period else "if one is late, before"
                    yield lock_timeout.at(
                        robot.value("muxes", mux, "locks", name, "timeout"),
                        f"lock '{name}' of mux '{mux}' engages {when} '{writer.instance}' sends its next heartbeat",
                        label=f"it sends every {format_quantity(period, TIME)}",
                        help=f"make it several times as long: '{format_quantity(10 * period, TIME)}'",
                        related=[Related(robot.component_span(writer.instance), "the source")],
                    )


@check("RBX3108", Severity.WARNING, closed=(WIRING, NAMES))
def long_timeout(robot: Robot) -> Iterator[Finding]:
    """An input of a mux stays live long after its source fell silent."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        for name, mux_input in entry.inputs.items():
            end = robot.components[mux].end(name)
            timeout = mux_input.timeout or 0.0
            if end and isinstance(end.port, In) and end.port.qos is Qos.COMMAND and timeout > LONGEST:
                yield long_timeout.at(
                    robot.value("muxes", mux, "inputs", name, "timeout"),
                    f"input '{name}' of mux '{mux}' stays live for {format_quantity(timeout, TIME)} after its last "
                    "command",
                    help="a few times the time between two commands is enough, such as '0.5 s'",
                )


@check("RBX3141", Severity.WARNING)
def no_take_over(robot: Robot) -> Iterator[Finding]:
    """No input can take over from a component that drives."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        ranks = entry.ranks if entry.profile == "default" else {}
        protecting = _protecting(robot, entry)
        driving = {name: rank for name, rank in ranks.items() if entry.inputs[name].source and name not in protecting}
        open_ones = [name for name in ranks if name not in driving and name not in protecting]
        if any(rank <= max(driving.values(), default=0) for rank in entry.lock_ranks.values()):
            continue  # reported as RBX3110
        if open_ones and driving and max(ranks[name] for name in open_ones) < min(driving.values()):
            best = max(open_ones, key=lambda name: ranks[name])
            first = min(driving, key=lambda name: driving[name])
            yield no_take_over.at(
                robot.value("muxes", mux, "inputs", best, "priority"),
                f"whoever commands at '{best}' cannot take over: all that drives by itself is above it",
                label=f"input '{best}'",
                help=f"the higher priority wins: write one above {max(driving.values())}",
                related=[Related(robot.value("muxes", mux, "inputs", first, "priority"), f"input '{first}'")],
            )


@check("RBX3142", Severity.WARNING)
def past_protection(robot: Robot) -> Iterator[Finding]:
    """Somebody may command a base while a component protects the robot."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        ranks, protecting = entry.ranks, _protecting(robot, entry)
        for name in protecting:
            source = entry.inputs[name].source
            if not entry.has_priorities:
                yield past_protection.at(
                    robot.value("muxes", mux, "inputs", name, "from"),
                    f"mux '{mux}' lets others through while '{source}' protects the robot: it has no priorities",
                    help="use the mode 'priority', and give this input the highest one",
                )
                continue
            above = [key for key, rank in ranks.items() if rank > ranks.get(name, rank) and key not in protecting]
            for key in above:
                yield past_protection.at(
                    robot.value("muxes", mux, "inputs", key, "priority"),
                    f"input '{key}' of mux '{mux}' overrules '{source}', which protects the robot",
                    help=f"the higher priority wins: give '{name}' one above {max(ranks[other] for other in above)}",
                    related=[Related(robot.value("muxes", mux, "inputs", name, "priority"), f"input '{name}'")],
                )


def _protecting(robot: Robot, entry: MuxModel) -> list[str]:
    """Return the inputs of a mux whose source commands only to protect the robot."""
    found = []
    for name, mux_input in entry.inputs.items():
        component = robot.components.get((mux_input.source or "").partition(".")[0])
        if component and any(commands.protects for commands in component.declared(CommandsMotion)):
            found.append(name)
    return found


@check("RBX3110", Severity.WARNING)
def passed_lock(robot: Robot) -> Iterator[Finding]:
    """A lock of a mux does not hold back a component that drives."""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        ranks, protecting = entry.ranks, _protecting(robot, entry)
        driving = {key: rank for key, rank in ranks.items() if entry.inputs[key].source and key not in protecting}
        for name, priority in entry.lock_ranks.items():
            above = [key for key, rank in driving.items() if rank >= priority]
            if above and min(ranks.values()) < priority:  # otherwise it holds back nothing at all
                yield passed_lock.at(
                    robot.value("muxes", mux, "locks", name, "priority"),
                    f"lock '{name}' of mux '{mux}' does not hold back '{above[0]}', which drives by itself",
                    help=f"give it a priority above {max(ranks[key] for key in above)}",
                    related=[
                        Related(robot.value("muxes", mux, "inputs", key, "priority"), f"input '{key}'") for key in above
                    ],
                )


@check("RBX3102")
def past_the_mux(robot: Robot) -> Iterator[Finding]:
    """A component subscribes to an input of a mux instead of its output."""
    outputs = {name: _outputs(component) for name, component in robot.components.items()}
    for topic, ends in robot.readers.items():
        inputs = [end for end in ends if end.name in outputs[end.instance]]
        muxes = {end.instance for end in inputs}
        for end in ends:
            if muxes and end.instance not in muxes and isinstance(end.port, In) and end.port.qos is Qos.COMMAND:
                mux, own = robot.components[inputs[0].instance], inputs[0]
                if own.topic in {port_end.topic for port_end in mux.ends if isinstance(port_end.port, Out)}:
                    continue  # the mux takes what it writes itself, which is reported there
                yield past_the_mux.at(
                    robot.end_span(end),
                    f"'{end.instance}' subscribes to '{topic}', bypassing the mux '{mux.name}'",
                    help=f"subscribe to the mux's output: '{end.name}: {outputs[own.instance][own.name]}'",
                    related=[Related(robot.key(*mux.path, "inputs", own.name), "this is an input of the mux")],
                )


def _outputs(mux: RobotComponent) -> dict[str, str]:
    """Return the topic to which a mux forwards what each of its inputs receives; empty if it is no mux."""
    found: dict[str, str] = {}
    for forwards in mux.declared(Forwards):
        if output := mux.end(forwards.output):
            found = dict.fromkeys(forwards.inputs, output.port.topic) | found  # the first that takes an input
    return {name: topic for name, topic in found.items() if topic}


@check("RBX3106")
def taken_twice(robot: Robot) -> Iterator[Finding]:
    """Two mux inputs take the same output."""
    first: dict[str, tuple[str, str]] = {}
    for mux, entry in robot.manifest.contents.of(muxes).items():
        for name, mux_input in entry.inputs.items():
            if mux_input.source is None:
                continue
            other = first.setdefault(mux_input.source, (mux, name))
            if other != (mux, name):
                yield taken_twice.at(
                    robot.value("muxes", mux, "inputs", name, "from"),
                    f"input '{name}' of mux '{mux}' takes the same as another input: '{mux_input.source}'",
                    help="remove one of the two",
                    related=[Related(robot.value("muxes", other[0], "inputs", other[1], "from"), "taken here")],
                )


@check("RBX3002", closed=(WIRING,))
def one_topic_two_types(robot: Robot) -> Iterator[Finding]:
    """Two ports of one topic have different types."""
    taken = {
        (resolve(f"{mux}/{name}", robot.manifest.bus.namespace or ""), mux_input.source.partition(".")[0])
        for mux, entry in robot.manifest.contents.of(muxes).items()
        for name, mux_input in entry.inputs.items()
        if mux_input.source  # a type that does not fit there is reported where the mux names its source
    }
    ends = [end for end in robot.ends if not isinstance(end.port, Looks) and (end.topic, end.instance) not in taken]
    ends = [end for end in ends if not _is_doubtful(robot.components.get(end.instance), end)]
    for topic, group in groupby(sorted(ends, key=lambda end: end.topic), key=lambda end: end.topic):
        first, *others = sorted(group, key=robot.end_span)
        for other in others:
            if other.type_name == first.type_name:
                continue
            if other.instance == first.instance and first.instance in robot.manifest.contents.of(muxes):
                yield _name_used_twice(robot, first.instance, topic.rpartition("/")[-1])
            else:
                yield one_topic_two_types.at(
                    robot.end_span(other),
                    f"'{topic}' is {first.type_name} for '{first.instance}', "
                    f"but {other.type_name} for '{other.instance}'",
                    label=f"its port '{other.name}'",
                    help=_cure(robot, first, other),
                    related=[Related(robot.end_span(first), f"its port '{first.name}'")],
                )


def _is_doubtful(made: RobotComponent | None, end: PortEnd) -> bool:
    """Return whether a port follows from a configuration with mistakes: not if all components of the type have it."""
    return made is not None and not made.is_sound and not isinstance(getattr(made.cls, end.name, None), Port)


def _cure(robot: Robot, *ends: PortEnd) -> str:
    """Return what helps: another type for the one whose type is a setting, else another topic, if one may have that."""
    for end, wanted in zip(ends, (ends[1], ends[0]), strict=True):
        if is_written(robot, robot.components[end.instance], TYPE):
            return f"write '{TYPE}: {wanted.type_name.replace('/msg/', '/')}' in '{end.instance}', or another topic"
    return robot.parted("another topic", *([(end, "ANOTHER_NAME")] for end in reversed(ends)))


def _name_used_twice(robot: Robot, mux: str, name: str) -> Finding:
    """Return the finding for a mux that has an input and a lock of the same name, and so on one topic."""
    return one_topic_two_types.at(
        robot.key("muxes", mux, "locks", name),
        f"mux '{mux}' uses the name '{name}' twice, for an input and for a lock: both are the topic '{mux}/{name}'",
        label="the lock",
        help="give the lock a name of its own",
        related=[Related(robot.key("muxes", mux, "inputs", name), "the input")],
    )


@check("RBX3001", closed=(WIRING, NAMES))
def two_writers(robot: Robot) -> Iterator[Finding]:
    """Two components write commands on one topic without a mux."""
    commands = sorted(commands_of(robot), key=lambda end: end.topic)
    for topic, ends in groupby(commands, key=lambda end: end.topic):
        mux = robot.manifest.contents.of(muxes).get(topic.strip("/"))
        if mux and any(mux_input.source and missing(robot, mux_input.source) for mux_input in mux.inputs.values()):
            continue  # the mux was to take one of them, and its mistake is reported at its own place
        writers = sorted(ends, key=lambda end: (end.instance == MISSION, robot.component_span(end.instance)))
        first, *others = writers
        related = [Related(robot.component_span(first.instance), "and this one")]
        for other in others:
            if other.instance == MISSION:
                yield from _by_missions(robot, other, first, related)
                continue
            yield two_writers.at(
                robot.component_span(other.instance),
                f"'{other.instance}' and '{first.instance}' both write commands on '{topic}'",
                label="this one",
                help=_remedy(robot, topic, writers, (first.instance, other.instance)),
                related=related,
                about=(other.instance, first.instance, topic),
            )


def commands_of(robot: Robot) -> Iterator[PortEnd]:
    """Yield the ends that publish what somebody is commanded by, whatever they call it themselves."""
    commanded = {(end.topic, end.type_name) for end in robot.ends if isinstance(end.port, In) and is_command(end)}
    for end in robot.ends:
        if isinstance(end.port, Out) and (is_command(end) or (end.topic, end.type_name) in commanded):
            yield end


def _by_missions(robot: Robot, end: PortEnd, writer: PortEnd, related: list[Related]) -> Iterator[Finding]:
    """Yield a finding for each place where a mission publishes beside a component."""
    forwards = robot.components[writer.instance].declared(Forwards)
    free = [topic for forward in forwards for topic in _open_inputs(robot, writer.instance, forward)]
    example = "give it an input, such as 'mission: {priority: 5, timeout: 0.5 s}', and publish there"
    put = f"publish on an open input of the mux: {', '.join(free)}" if free else example
    for mission in robot.missions.values():
        for message in (template for node in mission.program.nodes for template in published(node)):
            if resolve(message.target.text, robot.manifest.bus.namespace or "") == end.topic:
                text = f"this mission and '{writer.instance}' both write commands on '{end.topic}'"
                help_text = put if forwards else _new_mux(end.topic)
                about = (writer.instance, end.topic)
                yield two_writers.at(message.target.span, text, help=help_text, related=related, about=about)


def _open_inputs(robot: Robot, mux: str, forwards: Forwards) -> list[str]:
    """Return the topics of a mux on which nothing in the robot publishes yet."""
    ends = [end for end in robot.components[mux].ends if end.name in forwards.inputs]
    return [end.port.topic for end in ends if not robot.writers.get(end.topic)]


def _remedy(robot: Robot, topic: str, writers: Iterable[PortEnd], both: tuple[str, str]) -> str:
    """Return how to combine two of the writers: in the mux that is also a writer, or else in a new one."""
    mux = next((writer.instance for writer in writers if robot.components[writer.instance].declared(Forwards)), None)
    if mux is None:
        return _new_mux(topic)
    missing = " and ".join(f"'from: {name}'" for name in both if name != mux)
    return f"the mux '{mux}' has to decide: give it an input {missing}"


def _new_mux(topic: str) -> str:
    return f"put both into a mux: 'muxes: {{{topic.strip('/')}: ...}}' with an input 'from:' each"
