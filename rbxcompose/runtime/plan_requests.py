"""Requests to a supervisor about another plan; apart from the others, which need no plan."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Command, Query
from rbxcompose.compiler.plan.diff import Change
from rbxcompose.runtime.folder import NO_LAYERS, ChosenLayers
from rbxcompose.runtime.requests import ROBOT
from rbxcompose.runtime.supervision.plan_change import Changes, Fate


@dataclass(frozen=True, slots=True)
class ComponentChange:
    """What a change does to a component, and why."""

    name: str
    type: str
    process: str
    fate: Fate
    reasons: tuple[Change, ...]


@dataclass(frozen=True, slots=True)
class PlanComparison:
    """What another plan would change in the running robot.

    `impossible` are the reasons why it can never be done while the robot is up, `why_not` is why it cannot be done now;
    `generation` counts the plans that the robot has had.
    """

    robot: str
    components: tuple[ComponentChange, ...]
    impossible: tuple[str, ...]
    generation: int
    why_not: str
    shares_change: bool = False  # what is known of other hosts, or carried to other robots
    said: tuple[str, ...] = ()  # that links open again; by components, of their work that is under way

    @classmethod
    def of(cls, found: Changes, generation: int, why_not: str, said: tuple[str, ...] = ()) -> PlanComparison:
        """Return changes in a form for people and programs."""
        components = tuple(
            ComponentChange(one.instance.name, one.instance.type, one.instance.process, one.fate, one.reasons)
            for one in found.fated
        )
        notes = (found.links_text, *said) if found.links_change else said
        return cls(found.before.robot, components, found.impossible, generation, why_not, found.shares_change, notes)


@dataclass(frozen=True, slots=True)
class ComparePlan(Query[PlanComparison]):
    """Query what a plan, as text, would change; nothing happens."""

    about = ROBOT
    plan: str


@dataclass(frozen=True, slots=True)
class ApplyPlan(Command):
    """Apply a plan that was compared in this generation; answered when everything new is active.

    `layers` are those that it was compiled with.
    """

    about = ROBOT
    plan: str
    generation: int
    layers: ChosenLayers = NO_LAYERS


@dataclass(frozen=True, slots=True)
class AdoptSaved(Command):
    """Take over settings that were saved as they are: the files are compared with them from now on.

    `plan`, as text, has the values, and `names` says which settings of which components they are.
    """

    about = ROBOT
    plan: str
    names: dict[str, list[str]]


@dataclass(frozen=True, slots=True)
class RevertPlan(Command):
    """Apply the plan from before the last change that was not taken back; answered when everything new is active.

    With `generation`, only if that change was made to the plan of this generation.
    """

    about = ROBOT
    generation: int | None = None
