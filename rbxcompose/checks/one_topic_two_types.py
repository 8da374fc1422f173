"""One topic with two types."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.flow import is_written
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd, resolve
from rbxcompose.rules import WIRING
from rbxcompose.sdk.ports import Looks

TYPE = "message"  # the setting of those whose type is chosen


@check("RBX3002", closed=(WIRING,))
def one_topic_two_types(robot: Robot) -> Iterator[Finding]:
    """Two ports of one topic have different types."""
    taken = {
        (resolve(f"{mux}/{name}", robot.manifest.bus.namespace or ""), one.source.partition(".")[0])
        for mux, entry in robot.manifest.muxes.items()
        for name, one in entry.inputs.items()
        if one.source  # a type that does not fit there is reported where the mux names its source
    }
    ends = [end for end in robot.ends if not isinstance(end.port, Looks) and (end.topic, end.instance) not in taken]
    for topic, group in groupby(sorted(ends, key=lambda end: end.topic), key=lambda end: end.topic):
        first, *others = sorted(group, key=robot.end_span)
        for other in others:
            if other.type_name == first.type_name:
                continue
            if other.instance == first.instance and first.instance in robot.manifest.muxes:
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


def _cure(robot: Robot, *ends: PortEnd) -> str:
    """Return what helps: another type for the one whose type is a setting, else another topic."""
    for end, wanted in zip(ends, (ends[1], ends[0]), strict=True):
        if is_written(robot, robot.components[end.instance], TYPE):
            return f"write '{TYPE}: {wanted.type_name.replace('/msg/', '/')}' in '{end.instance}', or another topic"
    return "give one of them another topic with 'connect:'"


def _name_used_twice(robot: Robot, mux: str, name: str) -> Finding:
    """Return the finding for a mux that has an input and a lock of the same name, and so on one topic."""
    return one_topic_two_types.at(
        robot.key("muxes", mux, "locks", name),
        f"mux '{mux}' uses the name '{name}' twice, for an input and for a lock: both are the topic '{mux}/{name}'",
        label="the lock",
        help="give the lock a name of its own",
        related=[Related(robot.key("muxes", mux, "inputs", name), "the input")],
    )
