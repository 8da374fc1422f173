"""`log`: write a line to the robot's log."""

from __future__ import annotations

from rbxcompose.missions import sdk


class LogTask(sdk.Task):
    """Writes one line."""

    __slots__ = ("step",)

    def __init__(self, site: sdk.Site, step: LogStep) -> None:
        super().__init__(site)
        self.step = step

    def begin(self) -> int:
        """Write it."""
        self.engine.say(sdk.Logged(self.step.level, self.run.filled(self.step.template, self.scope)))
        return sdk.SUCCESS


@sdk.kind("log", LogTask)
@sdk.dataclass(frozen=True, slots=True)
class LogStep(sdk.Deed):
    """Write one line; `$name` in it is filled in.

    Example:
        do:
          log: The battery has $battery
          level: warn
    """

    template: sdk.Template = sdk.text()
    level: str = sdk.choice(*sdk.LEVELS, help="Its severity.")

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the text."""
        return sdk.logged_in_words(self.template, self.level)

    def text(self, node: sdk.MissionNode) -> str:
        """Return the text, in which names are not filled in."""
        return self.template.text

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return that it fails only if it cannot read a value."""
        return sdk.ALWAYS_SUCCEEDS if sdk.is_sure(node, endings.program, endings.robot) else sdk.ANY
