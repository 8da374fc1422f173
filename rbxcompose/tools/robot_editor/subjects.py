"""What can be edited of a robot: its places, and who goes first at its muxes; its parts are in a module of their own.

A subject tells what a page is shown, how what it sends is written, and that nothing else has changed by it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from rbxcompose.base.requests import Refused
from rbxcompose.base.units import ANGLE, LENGTH, TIME, Dimension, UnitError, format_quantity, to_si
from rbxcompose.commands.new_files import AnswerError, read_name
from rbxcompose.compiler.composition.value_edits import is_same, value_text
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.muxes.sections.muxes import muxes
from rbxcompose.manifest.tree import KeyPath, text_at

FARTHEST = 1e6  # [m] from the origin of `map`; no view shows what is farther away
HIGHEST = 1_000_000  # priority
_LONGEST = 60  # characters of a text
Where = Callable[[KeyPath], dict[str, Any]]


class Subject:
    """A section of the manifest that a page edits."""

    section = ""
    what = ""
    """What one of its entries is called."""
    operations: Sequence[str] = ("add", "set", "rename", "remove")
    """What can be done to an entry."""
    is_alone: bool = True
    """Whether it leaves other subjects as they are; a part brings entries of its own."""

    def entries(self, robot: Robot, where: Where) -> list[dict[str, Any]]:
        """Return what a page shows of it."""
        raise NotImplementedError

    def state(self, robot: Robot) -> Mapping[str, Any]:
        """Return its entries by name, to be compared."""
        raise NotImplementedError

    def new_entry(self, robot: Robot, path: KeyPath, change: Mapping[str, Any]) -> tuple[str, str]:
        """Return the name and the text of a new entry.

        Raises:
            Refused: if there can be none.
        """
        raise NotImplementedError

    def new_name(self, robot: Robot, path: KeyPath, written: str, change: Mapping[str, Any]) -> str:
        """Return how a new name is written in the file of an entry that is called `written` there.

        Raises:
            Refused: if it is none.
        """
        raise NotImplementedError

    def written(self, robot: Robot, path: KeyPath, change: Mapping[str, Any]) -> dict[tuple[str, ...], str]:
        """Return the texts of values by their keys below the entry.

        Raises:
            Refused: if one of them is none.
        """
        raise NotImplementedError

    def surroundings(self, before: Robot, after: Robot) -> dict[str, Any]:
        """Return what else a page needs to know of a robot before and after the changes."""
        return {}


class Places(Subject):
    """Poses in `map` by name."""

    section, what = "places", "a place"
    fields: Mapping[str, Dimension] = MappingProxyType({"x": LENGTH, "y": LENGTH, "heading": ANGLE})

    def entries(self, robot: Robot, where: Where) -> list[dict[str, Any]]:
        """Return each place with its numbers in SI, and as they are written."""
        found = []
        for name, place in robot.manifest.places.items():
            written = {key: self._text(robot, name, key, getattr(place, key)) for key in self.fields}
            numbers = {"x": place.x, "y": place.y, "heading": place.heading, "colour": place.colour}
            found.append({"name": name, **numbers, "written": written, **where((self.section, name))})
        return found

    def state(self, robot: Robot) -> Mapping[str, Any]:
        """Return the places; names apart, since a renamed one is another one."""
        return robot.manifest.places

    def new_entry(self, robot: Robot, path: KeyPath, change: Mapping[str, Any]) -> tuple[str, str]:
        """Return a place as a map within a line."""
        name = valid_name(path[1], self.what, robot.manifest.places)
        values = self._values(robot, path, change)
        if not {"x", "y"} <= values.keys():
            raise Refused("a place needs 'x' and 'y'")
        if values.get("heading") == value_text(0.0, ANGLE):
            del values["heading"]
        order = [key for key in (*self.fields, "colour") if key in values]
        return name, f"{{{', '.join(f'{key}: {values[key]}' for key in order)}}}"

    def new_name(self, robot: Robot, path: KeyPath, written: str, change: Mapping[str, Any]) -> str:
        """Return a name without what the instance of a part puts before it."""
        name = valid_name(change.get("name"), self.what, robot.manifest.places)
        prefix = str(path[1]).removesuffix(written)
        own = name.removeprefix(prefix)
        if not name.startswith(prefix) or not own:
            raise Refused(f"'{path[1]}' comes from a part: its name begins with '{prefix}'")
        return own

    def written(self, robot: Robot, path: KeyPath, change: Mapping[str, Any]) -> dict[tuple[str, ...], str]:
        """Return the texts of what is another value now, in the units in which they are written."""
        if path[1] not in robot.manifest.places:
            raise Refused(f"there is no place '{str(path[1])[:_LONGEST]}'")
        return {(key,): text for key, text in self._values(robot, path, change).items()}

    def _values(self, robot: Robot, path: KeyPath, change: Mapping[str, Any]) -> dict[str, str]:
        given, place = change.get("values"), robot.manifest.places.get(str(path[1]))
        if not isinstance(given, dict) or not given:
            raise Refused("a place has 'x', 'y', 'heading' and 'colour'")
        found = {}
        for key, value in given.items():
            if key == "colour":
                found[key] = colour_text(value)
            elif key in self.fields:
                number, text = quantity_text(key, value, self.fields[key], written_text(robot, (*path, key)))
                if key != "heading" and abs(number) > FARTHEST:
                    raise Refused(f"'{key}' is farther away than {FARTHEST:g} m")
                if place is None or not is_same(getattr(place, key), number) or isinstance(value, str):
                    found[key] = text
            else:
                raise Refused(f"a place has no '{str(key)[:_LONGEST]}'")
        return found

    def _text(self, robot: Robot, name: str, key: str, value: float) -> str:
        written = written_text(robot, (self.section, name, key))
        return written if written and "${" not in written else format_quantity(value, self.fields[key])


class Muxes(Subject):
    """Priorities and timeouts of the inputs and locks of muxes; a value is named `inputs.teleop.priority`."""

    section, what = "muxes", "a mux"
    operations = ("set",)
    groups = ("inputs", "locks")

    def entries(self, robot: Robot, where: Where) -> list[dict[str, Any]]:
        """Return each mux with what has a rank there, as it is written."""
        found = []
        for name, mux in robot.manifest.contents.of(muxes).items():
            rows = [self._row(robot, name, group, key, where) for group in self.groups for key in getattr(mux, group)]
            file = next((row["file"] for row in rows if row["file"]), "")
            plain = {"name": name, "has_priorities": mux.has_priorities, "file": file, "why_not": ""}
            found.append({**plain, "rows": rows})
        return found

    def state(self, robot: Robot) -> Mapping[str, Any]:
        """Return the muxes."""
        return robot.manifest.contents.of(muxes)

    def written(self, robot: Robot, path: KeyPath, change: Mapping[str, Any]) -> dict[tuple[str, ...], str]:
        """Return the texts of priorities and timeouts."""
        mux, given = self.state(robot).get(str(path[1])), change.get("values")
        if mux is None:
            raise Refused(f"there is no mux '{str(path[1])[:_LONGEST]}'")
        if not isinstance(given, dict) or not given:
            raise Refused("a mux has priorities and timeouts")
        found: dict[tuple[str, ...], str] = {}
        for key, value in given.items():
            group, _, rest = key.partition(".")
            name, _, field = rest.rpartition(".")
            entries = getattr(mux, group) if group in self.groups else {}
            if name not in entries or field not in ("priority", "timeout"):
                raise Refused(f"the mux '{path[1]}' has no '{key[:_LONGEST]}'")
            if field == "priority":
                found[group, name, field] = priority_text(value)
            else:
                number, text = quantity_text(field, value, TIME, written_text(robot, (*path, group, name, field)))
                if number < 0:
                    raise Refused("'timeout' must not be negative")
                found[group, name, field] = text
        return found

    def _row(self, robot: Robot, mux: str, group: str, name: str, where: Where) -> dict[str, Any]:
        one = getattr(self.state(robot)[mux], group)[name]
        path = (self.section, mux, group, name)
        timeout = written_text(robot, (*path, "timeout"))
        if "${" in timeout or (not timeout and one.timeout is not None):
            timeout = format_quantity(one.timeout, TIME)
        source = getattr(one, "source", None) or ""
        rest = {"group": group, "name": name, "source": source, "priority": one.priority, "timeout": timeout}
        return {**rest, **where(path)}


def priority_text(value: Any) -> str:
    """Return a priority as it is written.

    Raises:
        Refused: if it is no whole number.
    """
    try:
        number = int(value) if isinstance(value, str) else value
    except ValueError:
        number = None
    if not isinstance(number, int) or isinstance(number, bool) or abs(number) > HIGHEST:
        raise Refused(f"'priority' must be a whole number up to {HIGHEST:,}")
    return str(number)


def valid_name(name: Any, what: str, taken: Mapping[str, Any]) -> str:
    """Return a name that nothing has.

    Raises:
        Refused: if it is none.
    """
    try:
        return read_name(name if isinstance(name, str) else "", what, taken)
    except AnswerError as error:
        finding = error.finding
        raise Refused(f"{finding.message}: {finding.help}" if finding.help else finding.message) from error


def written_text(robot: Robot, path: KeyPath) -> str:
    """Return a value as the file has it; empty if none has."""
    steps = robot.manifest.history.of(path)
    return text_at(steps[-1].node) if steps else ""


def quantity_text(key: str, value: Any, dimension: Dimension, old: str) -> tuple[float, str]:
    """Return a number in SI and how it is written: one with a unit as it is, else in the unit of the `old` text.

    Raises:
        Refused: if it is no finite number with such a unit.
    """
    try:
        if isinstance(value, str):
            if len(value) > _LONGEST:
                raise UnitError(f"must have at most {_LONGEST} characters")
            return to_si(value, dimension), " ".join(value.split())
        if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
            raise UnitError("must be a finite number")
        text = value_text(float(value), dimension, old)
        return to_si(text, dimension), text
    except (UnitError, OverflowError, StopIteration) as error:
        words = error.message if isinstance(error, UnitError) else "is too large"
        detail = f", but {error.detail}" if isinstance(error, UnitError) and error.detail else ""
        helped = f": {error.help}" if isinstance(error, UnitError) and error.help else ""
        raise Refused(f"'{key}' {words}{detail}{helped}") from error


def colour_text(value: Any) -> str:
    """Return a colour as it is written.

    Raises:
        Refused: if it is none: it is too long, or would be filled in.
    """
    if not isinstance(value, str) or len(value) > _LONGEST or not value.isprintable() or "$" in value:
        raise Refused("'colour' is a word, or '#' with digits")
    return value if value.isalpha() and value not in ("true", "false", "null") else json.dumps(value)
