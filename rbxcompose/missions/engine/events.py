"""Typed events that an engine reports while a mission runs; a shell writes the log from them."""

from collections.abc import Mapping

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import Value


@dataclass(frozen=True, slots=True)
class SkillStarted:
    """A skill was started; `leaf` is the number of its node, `text` the step as people read it."""

    leaf: int
    skill: str
    arguments: Mapping[str, Value]
    text: str


@dataclass(frozen=True, slots=True)
class SkillEnded:
    """A skill ended by itself (`success`, `failure`) or was `halted`, after `duration` [s]."""

    leaf: int
    skill: str
    result: str
    duration: float
    message: str = ""


@dataclass(frozen=True, slots=True)
class NodeStarted:
    """A named node or a state of a machine was started."""

    node: int
    name: str
    is_state: bool = False


@dataclass(frozen=True, slots=True)
class NodeEnded:
    """A named node or a state ended: `success`, `failure`, `skipped`, `halted`, or an outcome of its own."""

    node: int
    name: str
    result: str
    is_state: bool = False


@dataclass(frozen=True, slots=True)
class BranchEnded:
    """A branch of a parallel ended, or was halted with it; `name` is the branch's, as `node` has none of its own."""

    node: int
    name: str
    result: str


@dataclass(frozen=True, slots=True)
class Transition:
    """A machine goes from a state to another state or to one of its ends, on an outcome."""

    machine: int
    state: str
    outcome: str
    to: str


@dataclass(frozen=True, slots=True)
class Published:
    """A node published a message on a topic."""

    node: int
    topic: str
    fields: Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class InterruptStarted:
    """A condition of `interrupts:` holds; `shown` are the values that it read, as text."""

    name: str
    condition: str
    shown: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class InterruptEnded:
    """The reaction is done; `afterwards` says how the mission continues, `back_to` are the leaves that were halted.

    `restarted` is the name of what restarts. If nothing of that name was running, `afterwards` is `continue`.
    """

    name: str
    afterwards: str
    back_to: tuple[int, ...]
    restarted: str = ""


@dataclass(frozen=True, slots=True)
class Logged:
    """A node logged a text; the level is `info`, `warn` or `error`."""

    level: str
    text: str


@dataclass(frozen=True, slots=True)
class Reported:
    """Something is wrong with the mission at this place, a file and line."""

    place: str
    message: str


@dataclass(frozen=True, slots=True)
class Stopped:
    """A breakpoint or a step stops the mission at a node, before it begins or `after` it ended; `text` is the node."""

    node: int
    place: str
    text: str
    after: str = ""


@dataclass(frozen=True, slots=True)
class Intervened:
    """A person changed the course of the mission: without this, the run cannot be reproduced."""

    text: str


@dataclass(frozen=True, slots=True)
class MissionEnded:
    """The mission ended in `success` or `failure`, or was `halted` from outside; `outcome` may be an end's name.

    `doubt` is what a success would hide.
    """

    result: str
    message: str = ""
    outcome: str = ""
    doubt: str = ""

    @property
    def words(self) -> str:
        """Return its end's own name, if it has one, why it ended, and what to doubt; empty if nothing is to be said."""
        is_known = self.outcome in ("", self.result) or self.message.endswith(self.outcome)
        own = "" if is_known else f"ended in {self.outcome}"
        return ": ".join(text for text in (own, self.message, self.doubt) if text)


MissionEvent = (
    SkillStarted
    | SkillEnded
    | NodeStarted
    | NodeEnded
    | BranchEnded
    | Transition
    | Published
    | InterruptStarted
    | InterruptEnded
    | Logged
    | Reported
    | Stopped
    | Intervened
    | MissionEnded
)
