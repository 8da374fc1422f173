"""What people say about missions, word by word: `run patrol --set rounds=1 --from tour`."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rbxcompose.sdk.bound import Refused

SET, FROM = "--set", "--from"


@dataclass(frozen=True, slots=True)
class Words:
    """A verb, the mission that is meant (empty: the only one), inputs as text, the state to begin with."""

    verb: str
    mission: str = ""
    inputs: Mapping[str, str] = field(default_factory=dict)
    start: str = ""

    @property
    def text(self) -> str:
        """Return it as one line, which `words_of` reads."""
        inputs = [word for name, text in self.inputs.items() for word in (SET, f"{name}={text}")]
        mission = [self.mission] if self.mission else []
        return shlex.join([self.verb, *mission, *inputs, *([FROM, self.start] if self.start else [])])


def words_of(line: str) -> Words:
    """Read a line.

    Raises:
        Refused: if it cannot be read.
    """
    try:
        verb, *rest = shlex.split(line) or [""]
    except ValueError as error:
        raise Refused(f"cannot be read: {error}") from error
    mission, start = "", ""
    inputs: dict[str, str] = {}
    while rest:
        word = rest.pop(0)
        if word in (SET, FROM):
            if not rest:
                raise Refused(f"'{word}' needs a value")
            value = rest.pop(0)
            if word == FROM:
                start = value
            else:
                name, text = setting(value)
                inputs[name] = text
        elif mission:
            raise Refused(f"one mission at a time: '{mission}' or '{word}'")
        else:
            mission = word
    return Words(verb, mission, inputs, start)


def setting(text: str) -> tuple[str, str]:
    """Read `rounds=2`.

    Raises:
        Refused: if there is no name or no `=`.
    """
    name, equals, value = text.partition("=")
    if not name or not equals:
        raise Refused(f"'{text}' is no NAME=VALUE")
    return name, value


def joined(lines: Sequence[str]) -> Mapping[str, str]:
    """Return settings such as `rounds=2` by name; raises as `setting` does."""
    return dict(map(setting, lines))
