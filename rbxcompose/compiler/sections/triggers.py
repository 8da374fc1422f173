"""The section `triggers`: what starts missions by itself."""

from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from rbxcompose.base.config import ANYTHING, Config, Name, Refers
from rbxcompose.compiler.sections.missions import INPUT
from rbxcompose.compiler.sections.start import MissionName
from rbxcompose.manifest.fields import InterfaceName, TopicName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import OVERLAY, ROBOT, Reading
from rbxcompose.missions.triggers.trigger import Schedule, daily, parse_cron

TRIGGER = "trigger"
CAUSES = ("at", "cron", "when", "message", "at_start", "ends")
_NEEDS = {"on": "at", "type": "message", "outcome": "ends"}


def _time(text: str) -> str:
    daily(text)
    return text


def _cron(text: str) -> str:
    parse_cron(text)
    return text


class TriggerModel(Config):
    """What starts a mission by itself: one of `at`, `cron`, `when`, `message`, `at_start` and `ends`."""

    mission: MissionName
    """The mission that it starts."""
    at: Annotated[str, AfterValidator(_time)] | None = None
    """A time of day, such as `22:00`."""
    on: tuple[Literal["mon", "tue", "wed", "thu", "fri", "sat", "sun"], ...] = Field((), min_length=1)
    """Days of the week for `at`; without it, every day."""
    cron: Annotated[str, AfterValidator(_cron)] | None = None
    """Times in the five fields of cron: minute, hour, day of the month, month, day of the week."""
    when: str | None = None
    """A condition over the robot's values; it starts the mission when it begins to hold."""
    message: TopicName | None = None
    """A topic; each message on it starts the mission."""
    type: InterfaceName | None = None
    """The type of these messages, if no component publishes them."""
    at_start: Literal[True] | None = None
    """`true`: as soon as the whole robot is active."""
    ends: MissionName | None = None
    """A mission that must have ended."""
    outcome: Name | None = None
    """How it must have ended: `success`, `failure`, `halted` or an end of its own; without it, in any way by itself."""
    priority: int = Field(0, ge=-1000, le=1000)
    """The highest one starts first, and is interrupted only by one at least as high."""
    running: Literal["skip", "queue", "interrupt"] = "skip"
    """What happens while a mission that runs needs the same part of the robot, or is the same: this one is not started,
    waits for the other's end, or cancels it.
    """
    with_: dict[
        Annotated[Name, Refers(INPUT, is_reported=True)], Annotated[Any, Refers(ANYTHING, is_reported=True)]
    ] = Field({}, alias="with")
    """Values of the mission's inputs, by name; they override those under `missions`."""

    @model_validator(mode="after")
    def _one_cause(self) -> Self:
        given = [name for name in CAUSES if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(f"'{name}'" for name in given) or "none"
            raise ValueError(f"needs one of {', '.join(CAUSES)}, which starts the mission: it has {found}")
        for name, needed in _NEEDS.items():
            if getattr(self, name) and needed not in given:
                raise ValueError(f"has '{name}', which belongs to '{needed}'")
        return self

    @property
    def schedule(self) -> Schedule | None:
        """Return the times at which it starts the mission."""
        return daily(self.at, self.on) if self.at else parse_cron(self.cron) if self.cron else None

    @property
    def cause(self) -> str:
        """Return what starts the mission, in words."""
        match self:
            case TriggerModel(at=str(at)):
                return f"at {at} on {', '.join(self.on)}" if self.on else f"at {at}"
            case TriggerModel(cron=str(cron)):
                return f"cron {cron}"
            case TriggerModel(when=str(when)):
                return f"when {when}"
            case TriggerModel(message=str(topic)):
                return f"message on {topic}"
            case TriggerModel(ends=str(mission)):
                return f"{mission} ended in {self.outcome}" if self.outcome else f"{mission} ended"
        return "at start"


@section(
    "triggers",
    TriggerModel,
    order=112,
    names=TRIGGER,
    entry=TRIGGER,
    files=(ROBOT, OVERLAY),
    running=frozenset({"when"}),
    details=lambda read: {name: one.cause for name, one in read.items()},
)
def triggers(reading: Reading[TriggerModel]) -> dict[str, TriggerModel]:
    """What starts missions by itself, by name.

    Example:
        triggers:
          nightly: {at: "22:00", on: [mon, fri], mission: patrol}
          empty:
            when: $battery < 15 %
            mission: patrol
            with: {rounds: 1}
            priority: 10
            running: interrupt
    """
    return reading.entries()
