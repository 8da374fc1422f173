"""`use`: a mission within a mission."""

from __future__ import annotations

from rbxcompose.base.config import MISSION
from rbxcompose.missions import sdk
from rbxcompose.missions.language.grammar import LAST


class UseTask(sdk.WithHistory):
    """Runs the mission."""

    __slots__ = ("getters", "inner", "outputs")
    saved = ("outputs",)

    def __init__(self, site: sdk.Site, step: UseStep) -> None:
        super().__init__(site)
        if site.inner is None:
            raise TypeError(f"the mission of '{site.node.path}' is not linked")
        self.inner = site.inner
        self.history = step.history
        self.outputs: dict[str, sdk.Value] = {}
        inputs = self.inner.program.inputs
        self.getters = {
            argument.name: sdk.getter(argument.value, inputs[argument.name].type) for argument in step.arguments
        }

    def begin(self) -> int:
        """Start the mission; with a deep history, restore its data and continue where it was."""
        self.outputs = {}
        if self.engine.places.kept and self.engine.places.take_up(self) and self.inner.begun:
            self.inner.begin_again()
        else:
            self.inner.begin(self._inputs())
        return self.proceed()

    def proceed(self) -> int:
        """Continue with the mission."""
        status = self.inner.tick(self.engine.time)
        if status != sdk.RUNNING:
            self.forget_places()
            self.outputs = self._outputs()
            if self.inner.ending == sdk.FAILURE:
                self.engine.reasons[self.number] = self.inner.message or "its mission ended itself in failure"
        return status

    def halt(self) -> None:
        """Stop the mission; with `last` its main node keeps its place, and the next start has fresh data."""
        super().halt()
        if self.history == LAST:
            self.engine.places.kept.discard(self)
            self.engine.places.kept.update(self.inner.keepers)

    def halt_below(self) -> None:
        """Stop all that runs in the mission."""
        self.inner.halt()

    def suspend(self, from_start: bool) -> bool:
        """Suspend the leaves of the mission."""
        self.inner.suspend(from_start)
        return False

    def restart(self, target: sdk.Target) -> bool:
        """Return false: no node of another mission can be named."""
        return False

    def result(self) -> sdk.Value:
        """Return the outputs."""
        return self.outputs

    def _inputs(self) -> dict[str, sdk.Value]:
        found: dict[str, sdk.Value] = {}
        for name, declared in self.inner.program.inputs.items():
            if name in self.getters:
                found[name] = self.getters[name](self)
            elif declared.default:
                value = declared.default.value
                found[name] = sdk.place(self, value) if declared.type.kind in sdk.PLACED else value
        return found

    def _outputs(self) -> dict[str, sdk.Value]:
        """Return the outputs; one that has no value, because what it reads has not arrived, is left out."""
        found = {}
        for name, asked in self.inner.program.outputs.items():
            try:
                found[name] = sdk.evaluate(asked.expression, self.inner.scope)
            except sdk.NotArrivedError:
                continue
        return found


@sdk.kind("use", UseTask)
@sdk.dataclass(frozen=True, slots=True)
class UseStep(sdk.Straight):
    """Run another mission of the robot; its outputs can be kept with `save`.

    It sees the robot's values and places, but of this mission only the values in `with`.

    Example:
        do:
          - go_to: corner_1
          - use: patrol
            with:
              rounds: 1
    """

    uses: sdk.ScalarNode = sdk.word("the name of a mission", names=MISSION)
    arguments: tuple[sdk.WrittenArgument, ...] = sdk.inputs("Values for the inputs of the mission.")
    history: str = sdk.history()

    skipped = sdk.Skipped.PERHAPS
    has_result = True
    flow = sdk.NodeFlow.OPEN
    look = sdk.NodeLook("↗")

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the mission, and its inputs."""
        given = ", ".join(f"{sdk.spoken(one.name)} {sdk.argument_in_words(one.value)}" for one in self.arguments)
        return f"Do the mission {self.uses.text}{f', with {given}' if given else ''}"

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the outcomes of the mission."""
        return endings.of_mission(self.uses.text)

    def text(self, node: sdk.MissionNode) -> str:
        """Return the name of the mission."""
        return self.uses.text
