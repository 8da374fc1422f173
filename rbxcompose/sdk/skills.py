"""Skills in Python: a function, or a class for a skill that takes time; each is one file and one decorator.

They run in the process of missions, so a call has 5 ms; for longer work or waits, use a component with an action.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import field
from types import MappingProxyType
from typing import Any, ClassVar, Literal, TypeVar, get_args, get_origin, get_type_hints

from rbxcompose.base.config import Dimensioned, Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import COUNT, FLAG, PLACE, POSE, TEXT, Type, choice_of, quantity_of
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.plugins import Plugins
from rbxcompose.base.units import NUMBER

PLUGINS = Plugins("skill", "skills")
Returned = bool | str | Mapping[str, object]  # how a skill ended: success or not, an outcome, or success with results

F = TypeVar("F", bound=Callable[..., Any])
_SKILLS: dict[str, SkillType] = {}
_TYPES: Mapping[Any, Type] = {str: TEXT, bool: FLAG, int: COUNT, float: quantity_of(NUMBER), Place: PLACE, Pose2: POSE}


class Activity:
    """A skill that takes time: one object per start.

    `start` takes the arguments. `step` is called `rate` times per second, first immediately, with the robot time [s],
    until it returns how the skill ended. One that can be paused defines `pause` and `resume`, and is declared as
    `pausable`.
    """

    rate: ClassVar[float] = 20.0  # [Hz] of `step`

    def step(self, now: float) -> Returned | None:
        """Continue; return None until the skill ends."""
        raise NotImplementedError

    def halt(self) -> None:
        """Stop immediately: nothing waits for the skill any more."""

    def pause(self, now: float) -> None:
        """Hold, at robot time `now` [s]; `step` is not called until `resume`."""

    def resume(self, now: float) -> None:
        """Continue, at robot time `now` [s]."""


@dataclass(frozen=True, slots=True)
class SkillType:
    """A declared skill: `make` is the function, or the class of the activity. The first argument is the main one."""

    name: str
    make: Callable[..., Any]
    arguments: Mapping[str, Type]
    required: frozenset[str]
    claims: str = ""
    restartable: bool = True
    pausable: bool = False
    outcomes: Mapping[str, str] = field(default_factory=dict)

    @property
    def main(self) -> str:
        """Return the argument that a single value means."""
        return next(iter(self.arguments), "")

    @property
    def is_activity(self) -> bool:
        """Return whether the skill may take time."""
        return inspect.isclass(self.make)


def skill(
    name: str,
    *,
    claims: str = "",
    restartable: bool = True,
    pausable: bool = False,
    outcomes: Mapping[str, str] = MappingProxyType({}),
) -> Callable[[F], F]:
    """Declare a skill: a function with typed arguments, or an `Activity` whose `start` has them.

    It ends with True, False, one of its `outcomes` (each counts as `success` or `failure`), or a map of results; a
    function that returns nothing has succeeded. Any exception is a failure. `claims` is the part of the robot that it
    needs exclusively.

    Raises:
        TypeError: if an argument has no type that a mission can write, or an activity cannot be used.
        ValueError: if another skill has this name, or an outcome counts as something else.
    """

    def register(made: F) -> F:
        if wrong := set(outcomes.values()) - {"success", "failure"}:
            raise ValueError(f"an outcome counts as success or failure, not as {', '.join(sorted(wrong))}")
        other = _SKILLS.get(name)
        if other is not None and _place(other.make) != _place(made):
            raise ValueError(f"two skills are named '{name}': {_place(other.make)} and {_place(made)}")
        arguments, required = _arguments(made)
        _SKILLS[name] = SkillType(name, made, arguments, required, claims, restartable, pausable, outcomes)
        return made

    return register


def skill_names() -> list[str]:
    """Return the names of all skills in Python, sorted, without importing any."""
    return sorted({*PLUGINS.names(), *_SKILLS})


def skill_type(name: str) -> SkillType:
    """Return a skill, importing its file if necessary.

    Raises:
        KeyError: if no skill has this name.
        BrokenPluginError: if it belongs to another package and cannot be used.
    """
    return PLUGINS.find(name, _SKILLS, f"skill by @skill({name!r})")


def _place(made: Callable[..., Any]) -> str:
    return f"{made.__module__}.{made.__qualname__}"


def _arguments(made: Callable[..., Any]) -> tuple[dict[str, Type], frozenset[str]]:
    """Return the arguments with their types, and the required ones."""
    function: Callable[..., Any] = made
    if inspect.isclass(made):
        if not issubclass(made, Activity) or not callable(getattr(made, "start", None)):
            raise TypeError(f"{_place(made)} is not a subclass of Activity with a method 'start'")
        function = getattr(made, "start")  # noqa: B009 - each subclass has arguments of its own
    hints = get_type_hints(function, include_extras=True)
    found: dict[str, Type] = {}
    required = set()
    for name, parameter in inspect.signature(function).parameters.items():
        if name == "self":
            continue
        if parameter.kind not in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY):
            raise TypeError(f"{_place(made)}: '*{name}' cannot be written in a mission")
        found[name] = _type_of(hints.get(name), f"{_place(made)}: the argument '{name}'")
        if parameter.default is parameter.empty:
            required.add(name)
    return found, frozenset(required)


def _type_of(hint: Any, who: str) -> Type:
    for one in getattr(hint, "__metadata__", ()):
        if isinstance(one, Dimensioned):
            return quantity_of(one.dimension)
    if get_origin(hint) is Literal:
        return choice_of(*get_args(hint))
    if hint not in _TYPES:
        raise TypeError(f"{who} needs a type: a quantity such as Speed, Place, Pose2, str, bool, int, float or Literal")
    return _TYPES[hint]
