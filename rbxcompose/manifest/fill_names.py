"""The names that `${...}` may use, and how the check and the evaluation of an expression see them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from typing import NamedTuple

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions import types
from rbxcompose.expressions.types import Type
from rbxcompose.findings import Span
from rbxcompose.manifest import tree
from rbxcompose.manifest.secrets import Secrets
from rbxcompose.manifest.tree import ScalarNode, SequenceNode
from rbxcompose.manifest.validate import to_plain
from rbxcompose.units import Quantity


class Typed(NamedTuple):
    """A type and a value of it; `given` is the place where it was given, None for a default."""

    type: Type
    value: object
    given: Span | None = None


@dataclass(frozen=True, slots=True)
class Names:
    """The names that `${...}` may use: a type and a typed value by dotted name, the environment and the secrets.

    `arguments` holds those of each scope: of the robot (the empty scope), and of each instance of a part.
    """

    values: Mapping[str, Typed] = field(default_factory=dict)
    environment: Mapping[str, str] = field(default_factory=dict)
    secrets: Secrets | None = None
    arguments: Mapping[str, Mapping[str, Typed]] = field(default_factory=dict)

    def known(self, scope: str) -> Mapping[str, Typed]:
        """Return all that a file of this scope may name in an expression."""
        return {**self.values, **self.arguments.get(scope, {})}


def names_of(robot: str, sim: bool, environment: Mapping[str, str], secrets: Secrets | None = None) -> Names:
    """Return the names that every file of a robot knows."""
    return Names({"robot.name": Typed(types.TEXT, robot), "sim": Typed(types.FLAG, sim)}, environment, secrets)


def with_arguments(names: Names, arguments: Mapping[str, Typed], scope: str = "") -> Names:
    """Return `names` with `args.NAME` for each argument of a scope; a broken argument has the value `BROKEN`."""
    known = {f"args.{name}": value for name, value in arguments.items()}
    return replace(names, arguments={**names.arguments, scope: known})


@dataclass(frozen=True, slots=True)
class NameTypes:
    """The names as the static check of an expression sees them."""

    names: Mapping[str, Typed]

    def variable(self, name: str) -> Type | None:
        """Return None: nothing that is known while the robot runs can be filled in."""
        return None

    def word(self, name: str) -> Type | None:
        """Return the type of a name."""
        return self.names[name].type if name in self.names else None

    def variables(self) -> Iterable[str]:
        """Return nothing, see `variable`."""
        return ()

    def words(self) -> Iterable[str]:
        """Return all names."""
        return self.names


@dataclass(frozen=True, slots=True)
class NameValues:
    """The names as the evaluation of an expression sees them: numbers in SI, lists and maps as plain data."""

    names: Mapping[str, Typed]

    def variable(self, name: str) -> object:
        """Raise, since there is no such value."""
        raise KeyError(name)

    def word(self, name: str) -> object:
        """Return the value of a name."""
        value = self.names[name].value
        if isinstance(value, Quantity):
            return value.value
        return to_plain(value) if isinstance(value, ScalarNode | SequenceNode | tree.MappingNode) else value

    def age(self, name: str) -> float:
        """Raise, since there is no such value."""
        raise KeyError(name)

    def is_new(self, name: str) -> bool:
        """Raise, since there is no such value."""
        raise KeyError(name)
