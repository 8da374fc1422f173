"""A mission as lines of text: one node per line, with its status."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rbxcompose.missions.program.look import Form
from rbxcompose.missions.program.statuses import FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS
from rbxcompose.missions.view.picture import Drawn, MissionPicture
from rbxcompose.printable import fitted, plain

MARKS = {IDLE: "·", RUNNING: "▶", SUCCESS: "✓", FAILURE: "✗", SKIPPED: "-"}
_RESET, _FAINT = "\x1b[0m", "\x1b[2m"
_COLOURS = {IDLE: _FAINT, RUNNING: "\x1b[1;36m", SUCCESS: "\x1b[32m", FAILURE: "\x1b[31m", SKIPPED: _FAINT}
_STEP = "  "


def mission_text(picture: MissionPicture, statuses: Sequence[int] = ()) -> str:
    """Return the text of a mission, with the status of each node if known."""
    return "".join(f"{line}\n" for line in mission_lines(picture, statuses))


def mission_lines(
    picture: MissionPicture, statuses: Sequence[int] = (), *, width: int = 200, colour: bool = False
) -> list[str]:
    """Return the lines, each of at most `width` columns."""
    head = plain(f"{picture.name}: {picture.about}" if picture.about else picture.name)
    nodes = (line for root in picture.roots for line in _lines(root, "", statuses, width, colour))
    return [fitted(head, width), *nodes]


def _lines(drawn: Drawn, indent: str, statuses: Sequence[int], width: int, colour: bool) -> Iterator[str]:
    status = status_of(drawn, statuses)
    mark = f"{MARKS[status]} " if statuses else ""
    line = fitted(f"{indent}{mark}{_words(drawn)}", width)
    yield f"{_COLOURS[status]}{line}{_RESET}" if colour and statuses else line
    for child in drawn.children:
        yield from _lines(child, indent + _STEP, statuses, width, colour)
    for arrow in drawn.arrows:
        line = fitted(f"{indent}{_STEP}{arrow.outcome or 'then'} -> {arrow.to}", width)
        yield f"{_FAINT}{line}{_RESET}" if colour else line


def running_lines(picture: MissionPicture, statuses: Sequence[int], width: int) -> list[str]:
    """Return the lines of the running nodes and of those that contain them."""
    return [fitted(line, width) for root in picture.roots for line in _running(root, "", statuses)]


def _running(drawn: Drawn, indent: str, statuses: Sequence[int]) -> Iterator[str]:
    if status_of(drawn, statuses) == RUNNING:
        yield f"{indent}{MARKS[RUNNING]} {_words(drawn)}"
        for child in drawn.children:
            yield from _running(child, indent + _STEP, statuses)


def status_of(drawn: Drawn, statuses: Sequence[int]) -> int:
    """Return the status of a node; an interrupt has that of its reaction."""
    number = drawn.number
    if number is None:
        number = drawn.children[0].number if drawn.children else None
    return statuses[number] if number is not None and number < len(statuses) else IDLE


def _words(drawn: Drawn) -> str:
    role = f"{drawn.role}: " if drawn.role else ""
    name = f"{drawn.name}: " if drawn.name and drawn.form != Form.STATE else ""
    title = f"state {drawn.name}" if drawn.form == Form.STATE else drawn.title
    notes = f"  ({', '.join(drawn.notes)})" if drawn.notes else ""
    start = "  (start)" if drawn.is_start else ""
    return plain(f"{role}{name}{title}{notes}{start}")
