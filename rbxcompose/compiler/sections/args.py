"""The section `args`: what a user of a robot or part may want to set."""

from rbxcompose.base.config import ARGUMENT
from rbxcompose.base.findings import Span
from rbxcompose.manifest.arguments import ArgumentModel, DeclaredArgument, read_argument
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Reading, Short


@section(
    "args",
    ArgumentModel,
    order=10,
    names=ARGUMENT,
    entry="argument",
    short=Short("default", only_over="the argument's value"),
    is_composed=False,
)
def args(reading: Reading[ArgumentModel]) -> dict[str, tuple[DeclaredArgument | None, Span]]:
    """Arguments by name: what a user of the robot or part may want to set, read by `${args.NAME}`.

    Example:
        args:
          speed:
            type: speed
            default: 0.3 m/s
            min: 5 cm/s
            max: 0.5 m/s
            about: Speed between places.
    """
    return {
        name: (read_argument(name, entry.value, ("args", name), reading.report), entry.key.span)
        for name, entry in reading.named()
    }
