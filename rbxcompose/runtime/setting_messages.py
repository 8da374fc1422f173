"""What the supervisor, the process groups and the judge tell each other about changes of live settings."""

from __future__ import annotations

from rbxcompose.dataclass import dataclass
from rbxcompose.params.change import ChangeRefusal, WantedChange
from rbxcompose.runtime.options import ChosenLayers


@dataclass(frozen=True, slots=True)
class PrepareChange:
    """Look whether components, by name, would accept new settings, and keep them for that; send `ChangePrepared`."""

    number: int
    wanted: WantedChange


@dataclass(frozen=True, slots=True)
class CommitChange:
    """Apply the settings that were prepared, then send `ChangeFollowed`."""

    number: int


@dataclass(frozen=True, slots=True)
class UndoChange:
    """Give components back the settings that they had before, then send `ChangeFollowed`."""

    number: int


@dataclass(frozen=True, slots=True)
class EndChange:
    """The change is over, done or not."""

    number: int


@dataclass(frozen=True, slots=True)
class ChangeDecided:
    """The answer to `AskForChange`: why it is not done, or nothing."""

    number: int
    refusal: ChangeRefusal | None


@dataclass(frozen=True, slots=True)
class AskRules:
    """For the judge: may components have the configurations of `new`, if others have those of `now`?

    Both are plans as text. Rules of another `generation` of the plan are made of the robot's files anew.
    """

    number: int
    generation: int
    file: str
    layers: ChosenLayers
    now: list[str]
    new: list[str]


@dataclass(frozen=True, slots=True)
class AskForChange:
    """Somebody wants to change settings of components, by their nodes; `ChangeDecided` carries the same number."""

    number: int
    wanted: WantedChange


@dataclass(frozen=True, slots=True)
class ChangePrepared:
    """Why components of the process would refuse a change, or nothing.

    `now` are those of its components whose settings are not those of the plan, `new` those that rules could notice, as
    they will be; both are plans as text, or empty.
    """

    number: int
    refusal: str
    now: str = ""
    new: str = ""


@dataclass(frozen=True, slots=True)
class ChangeFollowed:
    """Components have applied or taken back a change; else why one of them has not."""

    number: int
    refusal: str


@dataclass(frozen=True, slots=True)
class RulesSay:
    """The answer of the judge: which rule would be broken, or nothing."""

    number: int
    refusal: ChangeRefusal | None


SettingOrder = PrepareChange | CommitChange | UndoChange | EndChange | ChangeDecided | AskRules
SettingWord = AskForChange | ChangePrepared | ChangeFollowed | RulesSay
