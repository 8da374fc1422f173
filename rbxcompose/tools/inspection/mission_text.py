"""A mission as lines of text, as a Mermaid flowchart, or in DOT."""

import json
from collections.abc import Iterator, Sequence

from rbxcompose.base.printable import fitted, plain
from rbxcompose.missions.program.outcomes import FAILURE, IDLE, NAMES, RUNNING, SKIPPED, SUCCESS
from rbxcompose.missions.program.parts import Form
from rbxcompose.missions.view.picture import Drawn, MissionPicture

MARKS = {IDLE: "·", RUNNING: "▶", SUCCESS: "✓", FAILURE: "✗", SKIPPED: "-"}
_RESET, _FAINT = "\x1b[0m", "\x1b[2m"
_COLOURS = {IDLE: _FAINT, RUNNING: "\x1b[1;36m", SUCCESS: "\x1b[32m", FAILURE: "\x1b[31m", SKIPPED: _FAINT}
_STEP = "  "
_LONGEST = 2000  # characters of a sentence
COLOURS = {"running": "#0969da", "success": "#1a7f37", "failure": "#cf222e", "skipped": "#818b98"}
_SAFE = str.maketrans({'"': "'", "<": "&lt;", ">": "&gt;", "#": "&num;"})


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


def mission_sentences(picture: MissionPicture, statuses: Sequence[int] = ()) -> str:
    """Return a mission in plain sentences with numbers, with the status of each node if known."""
    head = f"{picture.name}: {picture.about}" if picture.about else picture.name
    lines = (_said(drawn, statuses) for root in picture.roots for drawn in root.all())
    return "".join(f"{line}\n" for line in (plain(head), *lines))


def _said(drawn: Drawn, statuses: Sequence[int]) -> str:
    mark = f"{MARKS[status_of(drawn, statuses)]} " if statuses else ""
    indent = _STEP * drawn.place.count(".")
    return f"{indent}{mark}{drawn.place} {plain(drawn.sentence, _LONGEST)}{':' if drawn.children else ''}"


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


def mission_mermaid(picture: MissionPicture, statuses: Sequence[int] = ()) -> str:
    """Return the text of a flowchart, with the status of each node if known."""
    return "".join(f"{line}\n" for line in _mermaid(picture, statuses))


def mission_dot(picture: MissionPicture, statuses: Sequence[int] = ()) -> str:
    """Return the text of a graph for Graphviz, with the status of each node if known."""
    return "".join(f"{line}\n" for line in _dot(picture, statuses))


def label_of(drawn: Drawn) -> str:
    """Return the label of a box, as lines."""
    names = [one for one in dict.fromkeys((drawn.role, drawn.name)) if one]
    title = "state" if drawn.form == Form.STATE else drawn.title
    return "\n".join([*([": ".join(names)] if names else []), title, *drawn.notes])


def _keys(picture: MissionPicture) -> dict[int, str]:
    """Return the key of each box by the identity of what it shows."""
    drawn = [one for root in picture.roots for one in root.all()]
    return {id(one): f"n{number}" for number, one in enumerate(drawn)}


def _edges(picture: MissionPicture) -> Iterator[tuple[str, str, str, bool]]:
    """Yield the lines: from, to, label, and whether it is a transition."""
    keys = _keys(picture)
    for one in (one for root in picture.roots for one in root.all()):
        yield from ((keys[id(one)], keys[id(child)], "", False) for child in one.children)
        states = {child.name: keys[id(child)] for child in one.children if child.form == Form.STATE}
        for state in (child for child in one.children if child.form == Form.STATE):
            for arrow in state.arrows:
                to = states.get(arrow.to, f"{keys[id(one)]}_{arrow.to}")
                yield states[state.name], to, arrow.outcome, True


def _ends(picture: MissionPicture) -> Iterator[tuple[str, str]]:
    """Yield the reachable ends of machines: key and name."""
    keys = _keys(picture)
    for one in (one for root in picture.roots for one in root.all()):
        states = {child.name for child in one.children if child.form == Form.STATE}
        reached = dict.fromkeys(arrow.to for child in one.children for arrow in child.arrows)
        yield from ((f"{keys[id(one)]}_{name}", name) for name in reached if name not in states)


def _mermaid(picture: MissionPicture, statuses: Sequence[int]) -> Iterator[str]:
    yield "flowchart LR"
    keys = _keys(picture)
    for one in (one for root in picture.roots for one in root.all()):
        text = label_of(one).translate(_SAFE).replace("\n", "<br>")
        begin, end = ("([", "])") if one.form == Form.STATE else ("[", "]") if one.children else ("(", ")")
        style = f":::{NAMES[status_of(one, statuses)]}" if statuses and status_of(one, statuses) else ""
        yield f'  {keys[id(one)]}{begin}"{text}"{end}{style}'
    yield from (f'  {key}((("{name}")))' for key, name in _ends(picture))
    for begin, end, label, is_transition in _edges(picture):
        arrow = f'-->|"{label.translate(_SAFE)}"|' if label else "-->" if is_transition else "---"
        yield f"  {begin} {arrow} {end}"
    if statuses:
        yield from (f"  classDef {name} fill:{colour},color:#fff" for name, colour in COLOURS.items())


def _dot(picture: MissionPicture, statuses: Sequence[int]) -> Iterator[str]:
    yield f"digraph {_quoted(picture.name)} {{"
    yield '  rankdir=LR node [shape=box fontname="sans-serif" fontsize=11] edge [fontname="sans-serif" fontsize=10]'
    keys = _keys(picture)
    for one in (one for root in picture.roots for one in root.all()):
        shape = " shape=ellipse" if one.form == Form.STATE else " style=rounded" if not one.children else ""
        status = NAMES[status_of(one, statuses)]
        colour = f' color="{COLOURS[status]}" penwidth=2.5' if statuses and status in COLOURS else ""
        yield f"  {keys[id(one)]} [label={_quoted(label_of(one))}{shape}{colour}]"
    yield from (f"  {key} [label={_quoted(name)} shape=doublecircle]" for key, name in _ends(picture))
    for begin, end, label, is_transition in _edges(picture):
        more = f" [label={_quoted(label)}]" if is_transition else " [dir=none style=dotted]"
        yield f"  {begin} -> {end}{more}"
    yield "}"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
