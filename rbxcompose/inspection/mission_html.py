"""A mission as one self-contained HTML page: nested boxes, with machines as diagrams of their states."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

from rbxcompose.inspection.layout import MOST_EFFORT, TOO_TANGLED, Layout, LayoutItem, NotDrawnError, effort, lay_out
from rbxcompose.inspection.mission_style import STYLE
from rbxcompose.inspection.mission_text import MARKS, status_of
from rbxcompose.missions.program.look import Form
from rbxcompose.missions.program.statuses import IDLE, NAMES
from rbxcompose.missions.view.picture import Drawn, MissionPicture

_LETTER, _SMALL = 7.6, 6.6  # width of a letter of names and of small text [px]
_BESIDE = (Form.BESIDE, Form.MACHINE)
_BOX, _PILL = 34.0, 22.0  # heights [px]


def mission_html(picture: MissionPicture, statuses: Sequence[int] = ()) -> str:
    """Return the HTML of the page, light or dark as the reader has set it, with the status of each node if known.

    Raises:
        NotDrawnError: if Graphviz is not installed, or would take too long.
    """
    if sum(_effort(one) for root in picture.roots for one in root.all()) > MOST_EFFORT:
        message = f"mission '{picture.name}' has too many transitions for a picture"
        raise NotDrawnError(TOO_TANGLED.at(None, message, help="use '--format text', 'dot' or 'mermaid'"))
    return "".join(f"{line}\n" for line in _page(picture, statuses))


def _page(picture: MissionPicture, statuses: Sequence[int]) -> Iterator[str]:
    title = escape(picture.name)
    yield "<!doctype html>"
    yield f'<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<style>{STYLE}</style></head><body>"
    yield f"<header><h1>{title}</h1><p>{escape(picture.about)}</p>"
    if statuses:
        marks = (f'<span class="{NAMES[one]}"><b>{mark}</b> {NAMES[one]}</span>' for one, mark in MARKS.items())
        yield f'<p class="legend">{"".join(marks)}</p>'
    yield "</header><main>"
    yield from _box(picture.main, statuses)
    yield "</main>"
    if picture.interrupts:
        yield '<h2>Interrupts, in order of priority</h2><section class="interrupts">'
        for one in picture.interrupts:
            yield from _box(one, statuses)
        yield "</section>"
    yield "</body></html>"


def _box(drawn: Drawn, statuses: Sequence[int]) -> Iterator[str]:
    status = status_of(drawn, statuses)
    kinds = f"box {NAMES[status]} {escape(drawn.kind)} {'group' if drawn.children else 'leaf'}"
    number = "" if drawn.number is None else f' data-node="{drawn.number}"'
    yield f'<div class="{kinds}"{number} title="{escape(NAMES[status])}">{_head(drawn, status, bool(statuses))}'
    if drawn.form == Form.MACHINE:
        yield from _states(drawn, statuses)
    if drawn.children:
        flow = "beside" if drawn.form in _BESIDE else "after"
        yield f'<div class="inside {flow}">'
        for child in drawn.children:
            yield from _box(child, statuses)
        yield "</div>"
    yield "</div>"


def _head(drawn: Drawn, status: int, is_live: bool) -> str:
    mark = f'<b class="mark">{MARKS[status]}</b>' if is_live and status != IDLE else ""
    sign = f'<i class="sign">{drawn.sign}</i>' if drawn.sign else ""
    names = " ".join(dict.fromkeys(one for one in (drawn.role, drawn.name) if one))
    name = f'<b class="name">{escape(names)}</b>' if names else ""
    kind = f'<span class="kind">{escape(drawn.kind)}</span>'
    text = f'<span class="text">{escape(drawn.text)}</span>' if drawn.text else ""
    notes = "".join(f'<span class="note">{escape(one)}</span>' for one in drawn.notes)
    start = '<span class="note">start</span>' if drawn.is_start else ""
    leads = "".join(
        f'<span class="lead">{escape(one.outcome or "then")} → {escape(one.to)}</span>' for one in drawn.arrows
    )
    return f'<div class="head">{mark}{name}{sign}{kind}{text}{start}{notes}{leads}</div>'


def _effort(drawn: Drawn) -> int:
    """Return how hard the diagram of a machine is to lay out; 0 for every other node."""
    if drawn.form != Form.MACHINE:
        return 0
    joined = {(state.name, arrow.to) for state in drawn.children for arrow in state.arrows}
    names = {*(state.name for state in drawn.children), *(to for _, to in joined)}
    return effort(len(names) + len(joined), 2 * len(joined))


def _states(machine: Drawn, statuses: Sequence[int]) -> Iterator[str]:
    """Yield the diagram of a machine: states, ends, and the transitions between them."""
    states = {one.name: one for one in machine.children}
    joined: dict[tuple[str, str], list[str]] = {}
    for state in machine.children:
        for arrow in state.arrows:
            joined.setdefault((state.name, arrow.to), []).append(arrow.outcome or "then")
    ends = [to for _, to in joined if to not in states]
    layout, pills = _layout([*states, *dict.fromkeys(ends)], joined)
    yield (
        f'<svg class="states" width="{layout.width:.0f}" height="{layout.height:.0f}" role="img" '
        f'aria-label="states and transitions">'
    )
    yield '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
    yield '<path d="M0 0L8 4L0 8z" fill="context-stroke"/></marker></defs>'
    for (begin, to), key in pills.items():
        yield f'<path class="line" d="{layout.paths[begin, key]}"/>'
        yield f'<path class="line" d="{layout.paths[key, to]}" marker-end="url(#tip)"/>'
        yield _shape(layout, key, "pill", ", ".join(joined[begin, to]))
    for name in [*states, *dict.fromkeys(ends)]:
        status = NAMES[status_of(states[name], statuses)] if name in states else "end"
        start = " start" if name in states and states[name].is_start else ""
        yield _shape(layout, name, f"state {status}{start}", name)
    yield "</svg>"


def _layout(
    names: Sequence[str], joined: dict[tuple[str, str], list[str]]
) -> tuple[Layout, dict[tuple[str, str], str]]:
    """Return the places of states and of the labels between them, and the keys of these."""
    pills = {ends: f"{ends[0]} > {ends[1]}" for ends in joined}
    items = [LayoutItem(name, _LETTER * len(name) + 26, _BOX, is_round=True) for name in names]
    for ends, key in pills.items():
        items.append(LayoutItem(key, _SMALL * len(", ".join(joined[ends])) + 18, _PILL, is_round=True))
    edges = [edge for (begin, to), key in pills.items() for edge in ((begin, key), (key, to))]
    return lay_out(items, edges), pills


def _shape(layout: Layout, key: str, style: str, text: str) -> str:
    rect = layout.places[key]
    x, y = rect.x + rect.width / 2, rect.y + rect.height / 2 + 4
    return (
        f'<g class="{style}"><rect x="{rect.x:.0f}" y="{rect.y:.0f}" width="{rect.width:.0f}" '
        f'height="{rect.height:.0f}" rx="{rect.height / 2:.0f}"/>'
        f'<text x="{x:.0f}" y="{y:.0f}">{escape(text)}</text></g>'
    )
