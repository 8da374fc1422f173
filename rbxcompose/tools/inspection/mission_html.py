"""A mission as one self-contained HTML page: nested boxes, with machines as diagrams of their own."""

from collections.abc import Iterator, Sequence
from html import escape

from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.layout import MOST_EFFORT, TOO_TANGLED, Layout, LayoutItem, effort, lay_out
from rbxcompose.missions.program.answers import Form
from rbxcompose.missions.program.outcomes import IDLE, NAMES
from rbxcompose.missions.view.picture import Drawn, MissionPicture
from rbxcompose.tools.inspection.mission_text import MARKS, status_of

STYLE = """
:root{--page:#fff;--text:#1f2328;--soft:#59636e;--edge:#d0d7de;--body:#fff;--group:#f6f8fa;
--running:#0969da;--success:#1a7f37;--failure:#cf222e;--skipped:#818b98;--state:#8250df}
@media(prefers-color-scheme:dark){:root{--page:#0d1117;--text:#e6edf3;--soft:#9198a1;--edge:#3d444d;--body:#212830;
--group:#151b23;--running:#4493f8;--success:#3fb950;--failure:#f85149;--skipped:#9198a1;--state:#ab7df8}}
*{box-sizing:border-box}body{margin:0;padding:20px 24px;background:var(--page);color:var(--text);
font:13px/1.35 system-ui,sans-serif}
h1{margin:0;font-size:22px}h2{font-size:15px;margin:20px 0 8px;color:var(--soft)}
header p{margin:2px 0 10px;color:var(--soft)}.legend{display:flex;gap:18px}
.box{border:1px solid var(--edge);border-left-width:4px;border-radius:7px;background:var(--body);max-width:100%}
.box.group{background:var(--group)}.group .group{background:var(--body)}.group .group .group{background:var(--group)}
.box.running{border-color:var(--running)}.box.success{border-color:var(--success)}
.box.failure{border-color:var(--failure)}.box.skipped{border-style:dashed}
.running>.head .mark,.legend .running{color:var(--running)}.success>.head .mark,.legend .success{color:var(--success)}
.failure>.head .mark,.legend .failure{color:var(--failure)}.skipped>.head .mark{color:var(--skipped)}
.box.running>.head{background:color-mix(in srgb,var(--running) 13%,transparent);border-radius:4px}
.head{display:flex;flex-wrap:wrap;gap:3px 7px;align-items:baseline;padding:4px 9px}
.kind{color:var(--soft)}.leaf>.head .kind{color:var(--text)}.sign{font-style:normal;color:var(--soft)}
.text{font-weight:600;overflow-wrap:anywhere}.name{color:var(--state)}
.note,.lead{font-size:11px;color:var(--soft);border:1px solid var(--edge);border-radius:9px;padding:0 7px}
.lead{border-color:var(--state)}
.inside{display:flex;flex-wrap:wrap;gap:7px 7px;padding:2px 8px 8px;align-items:flex-start}
.inside.after>.box:not(:last-child){margin-right:15px;position:relative}
.inside.after>.box:not(:last-child)::after{content:"→";position:absolute;right:-19px;top:3px;color:var(--soft)}
.fallback>.inside.after>.box:not(:last-child)::after{content:"?";right:-16px}
.machine>.inside{flex-direction:column;align-items:stretch}
.interrupts{display:flex;flex-wrap:wrap;gap:9px;align-items:flex-start}
svg.states{display:block;margin:2px 8px 8px;max-width:100%;overflow:visible}
svg text{font:12px system-ui,sans-serif;fill:var(--text);text-anchor:middle}
g.state rect{fill:var(--body);stroke:var(--state);stroke-width:1.4}g.state.start rect{stroke-width:3}
g.state text{font-weight:600}g.state.end rect{stroke:var(--soft);stroke-dasharray:4 2}
g.state.running rect{stroke:var(--running);fill:color-mix(in srgb,var(--running) 18%,var(--body));stroke-width:3}
g.state.success rect{stroke:var(--success)}g.state.failure rect{stroke:var(--failure)}
.pill rect{fill:var(--page);stroke:var(--edge)}.pill text{font-size:11px;fill:var(--soft)}
.line{fill:none;stroke:var(--soft);stroke-width:1.3}
"""


_LETTER, _SMALL = 7.6, 6.6  # width of a letter of names and of small text [px]
_BESIDE = (Form.BESIDE, Form.MACHINE)
_BOX, _PILL = 34.0, 22.0  # heights [px]


def mission_html(picture: MissionPicture, statuses: Sequence[int] = ()) -> str:
    """Return the HTML of the page, light or dark as the reader has set it, with the status of each node if known.

    Raises:
        NotDoneError: if Graphviz is not installed, or would take too long.
    """
    if sum(_effort(one) for root in picture.roots for one in root.all()) > MOST_EFFORT:
        message = f"mission '{picture.name}' has too many transitions for a picture"
        raise NotDoneError(TOO_TANGLED.at(None, message, help="use '--format text', 'dot' or 'mermaid'"))
    return "".join(f"{line}\n" for line in _page(picture, statuses))


def _page(picture: MissionPicture, statuses: Sequence[int]) -> Iterator[str]:
    title = escape(picture.name)
    yield "<!doctype html>"
    yield f'<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<style>{STYLE}</style></head><body>"
    yield f"<header><h1>{title}</h1><p>{escape(picture.about)}</p>"
    if statuses:
        marks = (f'<span class="{NAMES[name]}"><b>{mark}</b> {NAMES[name]}</span>' for name, mark in MARKS.items())
        yield f'<p class="legend">{"".join(marks)}</p>'
    yield "</header><main>"
    yield from _box(picture.main, statuses)
    yield "</main>"
    if picture.interrupts:
        yield '<h2>Interrupts, in order of priority</h2><section class="interrupts">'
        for interrupt in picture.interrupts:
            yield from _box(interrupt, statuses)
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
    notes = "".join(f'<span class="note">{escape(note)}</span>' for note in drawn.notes)
    start = '<span class="note">start</span>' if drawn.is_start else ""
    leads = "".join(
        f'<span class="lead">{escape(arrow.outcome or "then")} → {escape(arrow.to)}</span>' for arrow in drawn.arrows
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
    states = {child.name: child for child in machine.children}
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
