"""The section `process`: the process group of a robot that has a single one."""

from rbxcompose.base.config import Name
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import OVERLAY, ROBOT, Reading
from rbxcompose.manifest.validate import validate


@section("process", Name, order=105, files=(ROBOT, OVERLAY))
def process(reading: Reading[str]) -> str | None:
    """The process group of all components that do not name their own, also of those that every robot has.

    Without it, each type has its default. In a single process, the patrol robot takes half of the processor and three
    quarters of the memory, but a crash of one component stops all: write `world` for a simulated robot, which then goes
    down, as simulated truth is lost, and `robot` for a real one, whose process then starts again.

    Example:
        process: world
    """
    return validate(str, reading.node, ("process",), reading.report) if reading.node is not None else None
