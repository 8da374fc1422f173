"""`use`: a mission within a mission."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.values import NotArrivedError, Value
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.engine.resume_points import LAST
from rbxcompose.missions.engine.task import Site
from rbxcompose.missions.language.asked import WrittenArgument
from rbxcompose.missions.language.fields import history, inputs, word
from rbxcompose.missions.language.written import PLACED, getter, place
from rbxcompose.missions.program.answers import NodeFlow, NodeLook, Skipped
from rbxcompose.missions.program.families import Straight
from rbxcompose.missions.program.in_turn import WithHistory
from rbxcompose.missions.program.outcomes import FAILURE, RUNNING, Outcomes
from rbxcompose.missions.program.program import Endings, MissionNode, Target
from rbxcompose.missions.program.registry import kind


class UseTask(WithHistory):
    """Runs the mission."""

    __slots__ = ("getters", "inner", "outputs")
    saved = ("outputs",)

    def __init__(self, site: Site, step: UseStep) -> None:
        super().__init__(site)
        if site.inner is None:
            raise TypeError(f"the mission of '{site.node.path}' is not linked")
        self.inner = site.inner
        self.history = step.history
        self.outputs: dict[str, Value] = {}
        inputs = self.inner.program.inputs
        self.getters = {
            argument.name: getter(argument.value, inputs[argument.name].type) for argument in step.arguments
        }

    def begin(self) -> int:
        """Start the mission; with a deep history, restore its data and continue where it was."""
        self.outputs = {}
        if self.engine.places.kept and self.engine.places.take_up(self) and self.inner.begun:
            self.inner.begin_again()
        else:
            self.inner.begin(self._inputs())
        self.forget()
        return self.proceed()

    def proceed(self) -> int:
        """Continue with the mission."""
        status = self.inner.tick(self.engine.time)
        if status != RUNNING:
            self.forget_places()
            self.outputs = self._outputs()
            if self.inner.ending == FAILURE:
                self.engine.reasons[self.number] = self.inner.message or "its mission ended itself in failure"
        return status

    def halt(self) -> None:
        """Stop the mission; with `last` its main node keeps its place, and the next start has fresh data."""
        super().halt()
        if self.history == LAST:
            self.engine.places.kept.discard(self)
            self.engine.places.kept.update(self.inner.main_tasks())

    def halt_below(self) -> None:
        """Stop all that runs in the mission."""
        self.inner.halt()

    def suspend(self, from_start: bool) -> bool:
        """Suspend the leaves of the mission."""
        self.inner.suspend(from_start)
        return False

    def restart(self, target: Target) -> bool:
        """Return false: no node of another mission can be named."""
        return False

    def result(self) -> Value:
        """Return the outputs."""
        return self.outputs

    def _inputs(self) -> dict[str, Value]:
        found: dict[str, Value] = {}
        for name, declared in self.inner.program.inputs.items():
            if name in self.getters:
                found[name] = self.getters[name](self)
            elif declared.default:
                value = declared.default.value
                found[name] = place(self, value) if declared.type.kind in PLACED else value
        return found

    def _outputs(self) -> dict[str, Value]:
        """Return the outputs; one that has no value, because what it reads has not arrived, is left out."""
        found = {}
        for name, asked in self.inner.program.outputs.items():
            try:
                found[name] = evaluate(asked.expression, self.inner.scope)
            except NotArrivedError:
                continue
        return found


@kind("use", UseTask)
@dataclass(frozen=True, slots=True)
class UseStep(Straight):
    """Run another mission of the robot; its outputs can be kept with `save`.

    It sees the robot's values and places, but of this mission only the values in `with`.

    Example:
        do:
          - go_to: corner_1
          - use: patrol
            with:
              rounds: 1
    """

    uses: ScalarNode = word("the name of a mission")
    arguments: tuple[WrittenArgument, ...] = inputs("Values for the inputs of the mission.")
    history: str = history()

    skipped = Skipped.PERHAPS
    has_result = True
    flow = NodeFlow.OPEN
    look = NodeLook("↗")

    def may_end(self, node: MissionNode, endings: Endings) -> Outcomes:
        """Return the outcomes of the mission."""
        return endings.of_mission(self.uses.text)

    def text(self, node: MissionNode) -> str:
        """Return the name of the mission."""
        return self.uses.text
