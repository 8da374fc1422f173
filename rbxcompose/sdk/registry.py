"""Component types and skills in Python by name; only those that a manifest uses are imported."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import field
from difflib import get_close_matches
from types import MappingProxyType
from typing import Any, ClassVar, Literal, TypeVar, get_args, get_origin, get_type_hints

from rbxcompose.base.config import Config, Dimensioned, Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import COUNT, FLAG, PLACE, POSE, TEXT, Type, choice_of, quantity_of
from rbxcompose.base.findings import DID_YOU_MEAN, SIMILAR
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.plugins import BrokenPluginError, Plugins
from rbxcompose.base.units import NUMBER
from rbxcompose.sdk.capabilities import Capability
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import In, Port, ServesAction, ServesTopic, name_problem

T = TypeVar("T", bound=type[Component[Any]])
K = TypeVar("K", bound=Capability)

PLUGINS = Plugins("component", "components")
_TYPES: dict[str, type[Component[Any]]] = {}


def component(name: str) -> Callable[[T], T]:
    """Register a component class under the name of its type.

    Raises:
        TypeError: if it is not a subclass of `Component`.
        ValueError: if another class has this name, a port cannot have its name or its topic, or a port or a method
            refers to a port that it does not have.
    """

    def register(cls: T) -> T:
        if not issubclass(cls, Component):
            raise TypeError(f"{cls.__module__}.{cls.__qualname__} is not a subclass of Component")
        other = _TYPES.get(name)
        if other is not None and (other.__module__, other.__qualname__) != (cls.__module__, cls.__qualname__):
            raise ValueError(f"two component types are named '{name}': {other.__module__} and {cls.__module__}")
        _require_names(cls)
        _require_ends(cls)
        _require_handled(cls)
        cls.type_name = name
        _TYPES[name] = cls
        return cls

    return register


_OF_INSTANCES = ("name", "config", "context", "bound", "at_end")


def _require_names(cls: type[Component[Any]]) -> None:
    """Raise ValueError if a port hides what every component has, such as `stop`, or its topic is no name in ROS."""
    for name, port in inspect.getmembers(cls, lambda member: isinstance(member, Port)):
        where = f"{cls.__module__}.{cls.__qualname__}.{name}"
        if name in _OF_INSTANCES or hasattr(Component, name):
            raise ValueError(f"{where} hides what every component has under this name: give the port another one")
        if port.topic and (problem := name_problem(port.topic)):
            raise ValueError(f"{where}: {problem}")


def _require_ends(cls: type[Component[Any]]) -> None:
    """Raise ValueError if orders are reported or halted at a port that the class does not have."""
    ports = [port for _, port in inspect.getmembers(cls) if isinstance(port, Port)]
    for port in ports:
        for word in ("ends", "halts") if isinstance(port, ServesTopic) else ():
            other = getattr(port, word)
            if other is not None and not any(other is one for one in ports):
                where = f"{cls.__module__}.{cls.__qualname__}"
                raise ValueError(f"{where}: '{word}' of the port '{port.name}' is not a port of this class")


def _require_handled(cls: type[Component[Any]]) -> None:
    """Raise ValueError if a method is named like the handler that a port lacks, but for a slip: `on_rwa` for `raw`.

    A method for several ports may have their common words, such as `on_scan` for `scan_left`.
    """
    kinds = {"accept_": ServesAction} | ({"on_": In} if cls.received is Component.received else {})
    for prefix, kind in kinds.items():
        methods = {name.removeprefix(prefix) for name in dir(cls) if name.startswith(prefix)}
        strangers = sorted(name for name in methods if not isinstance(getattr(cls, name, None), Port))
        ports = dict(inspect.getmembers(cls, lambda member: isinstance(member, Port))) if strangers else {}
        lacking = [name for name, port in ports.items() if isinstance(port, kind) and name not in methods]
        for name in strangers:
            slips = [port for port in lacking if f"_{name}_" not in f"_{port}_"]
            if near := get_close_matches(name, slips, n=1, cutoff=SIMILAR):
                wrong = f"{cls.__module__}.{cls.__qualname__}.{prefix}{name}"
                raise ValueError(f"{wrong} is for no port: {DID_YOU_MEAN} '{prefix}{near[0]}'?")


def component_names() -> list[str]:
    """Return the names of all types, sorted, without importing any."""
    return sorted({*PLUGINS.names(), *_TYPES})


def component_type(name: str) -> type[Component[Any]]:
    """Return the class of a type, importing its file if necessary.

    Raises:
        KeyError: if no type has this name.
        BrokenPluginError: if it belongs to another package and cannot be used.
    """
    return PLUGINS.find(name, _TYPES, f"class by @component({name!r})")


def declared(name: str, config: Config, kind: type[K]) -> list[K]:
    """Return the capabilities of a kind that a component of type `name` has with this configuration."""
    return [capability for capability in component_type(name).capabilities(config) if isinstance(capability, kind)]


def usable_names() -> list[str]:
    """Import all types and return their names, sorted, without broken ones of other packages."""
    return [name for name in component_names() if not why_unusable(name)]


def types_with(port: type[Port[Any]], topic: str, interface: str) -> list[str]:
    """Return the types of this project that users list and whose class has a port of this kind, topic and ROS type."""
    own = [name for name in component_names() if name not in PLUGINS.third_party]
    found = []
    for name in own:
        ports = [one for _, one in inspect.getmembers(component_type(name)) if isinstance(one, port)]
        fitting = (
            one.topic == topic and one.interface is not None and interface == one.interface.TYPE for one in ports
        )
        if any(fitting) and not component_type(name).made_by:
            found.append(name)
    return found


def why_unusable(name: str) -> str:
    """Return why the type of this name cannot be used; empty if it can."""
    try:
        component_type(name)
    except BrokenPluginError as error:
        return str(error)
    return ""


SKILL_PLUGINS = Plugins("skill", "skills")
Returned = bool | str | Mapping[str, object]  # how a skill ended: success or not, an outcome, or success with results

F = TypeVar("F", bound=Callable[..., Any])
_SKILLS: dict[str, SkillType] = {}
_WRITABLE: Mapping[Any, Type] = {
    str: TEXT,
    bool: FLAG,
    int: COUNT,
    float: quantity_of(NUMBER),
    Place: PLACE,
    Pose2: POSE,
}


class Activity:
    """A skill that takes time: one object per start.

    It runs in the process of missions, so a call has 5 ms; for longer work or waits, use a component with an action.

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
    return sorted({*SKILL_PLUGINS.names(), *_SKILLS})


def skill_type(name: str) -> SkillType:
    """Return a skill, importing its file if necessary.

    Raises:
        KeyError: if no skill has this name.
        BrokenPluginError: if it belongs to another package and cannot be used.
    """
    return SKILL_PLUGINS.find(name, _SKILLS, f"skill by @skill({name!r})")


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
    if hint not in _WRITABLE:
        raise TypeError(f"{who} needs a type: a quantity such as Speed, Place, Pose2, str, bool, int, float or Literal")
    return _WRITABLE[hint]
