"""A robot, and a mission, as one self-contained HTML page each: a picture, and what stands around it."""

from collections.abc import Iterator, Sequence
from html import escape

from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.layout import MOST_EFFORT, TOO_TANGLED, Edge, Layout, LayoutItem, Rect, effort, lay_out
from rbxcompose.missions.program.outcomes import IDLE, NAMES
from rbxcompose.missions.program.parts import Form
from rbxcompose.missions.view.picture import Drawn, MissionPicture
from rbxcompose.tools.inspection.diagram import Box, BoxShape, Diagram, DiagramWire, Tip, WireContent
from rbxcompose.tools.inspection.mission_text import MARKS, status_of

STYLE = """
:root{--page:#fff;--text:#1f2328;--soft:#59636e;--edge:#d0d7de;--group:#f6f8fa;--body:#fff;
--topic:#0969da;--service:#1a7f37;--action:#8250df;--look:#818b98;--trigger:#bf3989;--mux:#bc4c00}
@media(prefers-color-scheme:dark){:root{--page:#0d1117;--text:#e6edf3;--soft:#9198a1;--edge:#3d444d;--group:#151b23;
--body:#212830;--topic:#4493f8;--service:#3fb950;--action:#ab7df8;--look:#818b98;--trigger:#f778ba;--mux:#f0883e}}
*{box-sizing:border-box}body{margin:0;padding:20px 24px;background:var(--page);color:var(--text);
font:14px/1.45 system-ui,sans-serif}
h1{margin:0;font-size:22px}h2{font-size:16px;margin:24px 0 8px}header p{margin:2px 0 10px;color:var(--soft)}
.legend{display:flex;flex-wrap:wrap;gap:6px 18px;align-items:center;margin-bottom:12px;color:var(--soft)}
.legend label,.legend span{display:flex;gap:6px;align-items:center}.legend label{cursor:pointer}
.legend input{margin:0}.sample{width:20px;height:13px;border:1.5px solid var(--soft);border-radius:4px}
.sample.mux{border:3px double var(--mux);border-radius:1px}.sample.mission{border-color:var(--action);border-radius:7px}
.sample.group{background:var(--group);border:1px solid var(--edge)}
.picture{overflow:auto;border:1px solid var(--edge);border-radius:8px;padding:6px}
.picture svg.graph{display:block;margin:auto}
svg text{font:12px system-ui,sans-serif;fill:var(--text);text-anchor:middle}
svg text.name{font-weight:600;font-size:13px}svg text.type{font-size:11px;fill:var(--soft)}
svg text.topic{font-size:11.5px}svg text.process{text-anchor:start;fill:var(--soft);font-weight:600}
.group{fill:var(--group);stroke:var(--edge)}.body{fill:var(--body);stroke:var(--soft);stroke-width:1.3}
.mux .body,.mux .inner{stroke:var(--mux)}.inner{fill:none;stroke-width:1}.mission .body{stroke:var(--action)}
.pill{fill:var(--page);stroke:var(--edge)}.open .pill{stroke-dasharray:4 3}
.line{fill:none;stroke-width:1.5}.run{stroke:var(--soft)}
.topic .pill{stroke:var(--topic)}.service .pill{stroke:var(--service)}.action .pill{stroke:var(--action)}
.look-up .pill{stroke:var(--look)}.trigger .pill{stroke:var(--trigger)}
.line.topic{stroke:var(--topic)}.line.service{stroke:var(--service);stroke-dasharray:7 4}
.line.action{stroke:var(--action);stroke-width:2.6}.line.look-up{stroke:var(--look);stroke-dasharray:1.5 4}
.line.trigger{stroke:var(--trigger)}
.box{cursor:pointer;outline:none}.box:focus .body{stroke-width:2.6}
.faded .wire:not(.near),.faded .box:not(.near),.faded .run:not(.near){opacity:.13}
.hidden{display:none}
table{border-collapse:collapse;display:block;overflow-x:auto}
th,td{text-align:left;padding:3px 14px 3px 0;border-bottom:1px solid var(--edge);vertical-align:top}
th{color:var(--soft);font-weight:600}td{overflow-wrap:anywhere}
"""

SCRIPT = """
const graph=document.querySelector("svg.graph"),all=s=>[...document.querySelectorAll(s)];
const boxesOf=e=>(e.dataset.boxes||"").split(" ");let held=null;
function show(key){graph.classList.toggle("faded",!!key);const near=new Set([key]);
for(const e of all(".wire,.line.run")){const on=boxesOf(e).includes(key);e.classList.toggle("near",on);
if(on)boxesOf(e).forEach(k=>near.add(k))}
for(const e of all(".box"))e.classList.toggle("near",near.has(e.dataset.box))}
for(const e of all(".box")){e.onpointerenter=()=>held||show(e.dataset.box);e.onpointerleave=()=>held||show(null);
e.onclick=()=>{held=held===e.dataset.box?null:e.dataset.box;show(held)};
e.onkeydown=k=>{if(k.key==="Enter")e.onclick()}}
for(const e of all("input[data-kind]"))e.onchange=()=>{
for(const w of all(`.wire[data-kind="${e.dataset.kind}"],tr[data-kind="${e.dataset.kind}"]`))
w.classList.toggle("hidden",!e.checked)};
"""


_BOX_HEIGHT, _WIRE_HEIGHT = 46.0, 34.0
_WIDE, _SMALL = 7.6, 6.4  # width of a letter of names and of small text [px]
_RUNS = "runs"


def html(drawn: Diagram, whole: Diagram | None = None) -> str:
    """Return the HTML of the page, light or dark, as the reader has set it; the tables have all of `whole`."""
    return "".join(f"{line}\n" for line in _page(drawn, whole or drawn))


def _page(diagram: Diagram, whole: Diagram) -> Iterator[str]:
    yield from _begin(diagram.robot, diagram.about, STYLE)
    yield from _legend(whole)
    yield '</header><div class="picture">'
    yield from _picture(diagram)
    yield "</div>"
    yield from _tables(whole)
    yield f"<script>{SCRIPT}</script></body></html>"


def _begin(name: str, about: str, style: str) -> Iterator[str]:
    """Yield how a page begins, up to the end of its header."""
    yield "<!doctype html>"
    yield f'<html lang="en"><head><meta charset="utf-8"><title>{escape(name)}</title>'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<style>{style}</style></head><body>"
    yield f"<header><h1>{escape(name)}</h1><p>{escape(about)}</p>"


def _legend(diagram: Diagram) -> Iterator[str]:
    """Yield the legend of the lines, with a checkbox for each kind that is drawn."""
    yield '<div class="legend">'
    for kind in WireContent:
        if count := sum(wire.kind is kind for wire in diagram.wires):
            sample = f'<svg width="34" height="10"><path class="line {kind}" d="M1 5H33"/></svg>'
            words = f"{count} {kind}{'' if count == 1 else 's'}"
            yield f'<label><input type="checkbox" checked data-kind="{kind}">{sample}{words}</label>'
    shapes = {box.shape for box in diagram.boxes}
    yield from (f'<span><i class="sample {shape}"></i>{shape}</span>' for shape in BoxShape if shape in shapes)
    yield '<span><i class="sample group"></i>process</span></div>'


def _picture(diagram: Diagram) -> Iterator[str]:
    layout = _layout(diagram)
    yield (
        f'<svg class="graph" width="{layout.width:.0f}" height="{layout.height:.0f}" '
        f'viewBox="0 0 {layout.width:.0f} {layout.height:.0f}" role="img" aria-label="components and wires">'
    )
    yield '<defs><marker id="arrow" viewBox="0 0 8 8" refX="7.5" refY="4" markerWidth="9" markerHeight="9" '
    yield 'markerUnits="userSpaceOnUse" orient="auto">'
    yield '<path d="M0 0L8 4L0 8z" fill="context-stroke"/></marker></defs>'
    for group, rect in layout.groups.items():
        yield f"{_rect(rect, 'group', 10)}"
        yield f'<text class="process" x="{rect.x + 12:.0f}" y="{rect.y + 18:.0f}">process {group}</text>'
    for executive, program in diagram.runs:
        yield from _line(layout, executive, _run(program), "run", f"{executive} {program}", has_arrow=False)
        yield from _line(layout, _run(program), program, "run", f"{executive} {program}", has_arrow=False)
        yield _small(layout.places[_run(program)], _RUNS)
    for number, wire in enumerate(diagram.wires):
        yield from _wire(layout, f"w{number}", wire)
    for box in diagram.boxes:
        yield from _box(layout.places[box.key], box, box.key == diagram.start)
    yield "</svg>"


def _run(program: str) -> str:
    return f"run {program}"


def _layout(diagram: Diagram) -> Layout:
    """Return the positions of boxes, and of wires, which are placed between the boxes they connect."""
    groups = {box.key: box.group for box in diagram.boxes}
    items = [
        LayoutItem(box.key, _width(box.name, box.type), _BOX_HEIGHT, box.group, is_round=box.shape is BoxShape.PROGRAM)
        for box in diagram.boxes
    ]
    edges: list[Edge] = []
    for executive, program in diagram.runs:
        items.append(LayoutItem(_run(program), 30.0, 16.0, groups[program], is_round=True))
        edges += [(executive, _run(program)), (_run(program), program)]
    for number, wire in enumerate(diagram.wires):
        key = f"w{number}"
        width = max(_SMALL * len(text) for text in (wire.name, _second_line(wire))) + 20
        group = groups[(wire.sources or wire.targets)[0].box]
        items.append(LayoutItem(key, width, _WIRE_HEIGHT, group, is_round=True))
        edges += [(tip.box, key) for tip in wire.sources] + [(key, tip.box) for tip in wire.targets]
    return lay_out(items, list(dict.fromkeys(edges)))


def _width(name: str, type_: str) -> float:
    return max(_WIDE * len(name), _SMALL * len(type_), 60.0) + 26


def _wire(layout: Layout, key: str, wire: DiagramWire) -> Iterator[str]:
    boxes = " ".join(dict.fromkeys(tip.box for tip in (*wire.sources, *wire.targets)))
    is_open = "" if wire.sources and wire.targets else " open"
    rect = layout.places[key]
    yield f'<g class="wire {wire.kind}{is_open}" data-kind="{wire.kind}" data-boxes="{escape(boxes)}">'
    yield f"<title>{escape(_title(wire))}</title>"
    for tip in wire.sources:
        yield from _line(layout, tip.box, key, str(wire.kind), boxes, has_arrow=not wire.targets)
    for tip in wire.targets:
        yield from _line(layout, key, tip.box, str(wire.kind), boxes)
    yield _rect(rect, "pill", rect.height / 2)
    x, y = rect.x + rect.width / 2, rect.y
    yield f'<text class="topic" x="{x:.0f}" y="{y + 14:.0f}">{escape(wire.name)}</text>'
    yield f'<text class="type" x="{x:.0f}" y="{y + 27:.0f}">{escape(_second_line(wire))}</text></g>'


def _second_line(wire: DiagramWire) -> str:
    return f"{wire.short_type}, {wire.note}" if wire.note else wire.short_type


def _title(wire: DiagramWire) -> str:
    """Return a description of a wire."""
    lines = [f"{wire.kind} {wire.name}", wire.type, *([f"quality of service: {wire.qos}"] if wire.qos else [])]
    lines += [f"from {_names(wire.sources) or wire.about or 'outside'}", f"to {_names(wire.targets) or 'nothing here'}"]
    return "\n".join(lines)


def _names(tips: tuple[Tip, ...]) -> str:
    return ", ".join(tip.box.removeprefix("mission:") + (f" ({tip.note})" if tip.note else "") for tip in tips)


def _line(layout: Layout, begin: str, end: str, style: str, boxes: str, *, has_arrow: bool = True) -> Iterator[str]:
    arrow = ' marker-end="url(#arrow)"' if has_arrow else ""
    yield f'<path class="line {style}" data-boxes="{escape(boxes)}" d="{layout.paths[begin, end]}"{arrow}/>'


def _box(rect: Rect, box: Box, is_start: bool) -> Iterator[str]:
    x, y = rect.x + rect.width / 2, rect.y
    yield f'<g class="box {box.shape}" data-box="{escape(box.key)}" tabindex="0">'
    yield f"<title>{escape(box.name)}: {escape(box.type)}\n{escape(box.about)}</title>"
    yield _rect(
        rect, "body", {BoxShape.COMPONENT: 7.0, BoxShape.MUX: 2.0, BoxShape.PROGRAM: rect.height / 2}[box.shape]
    )
    if box.shape is BoxShape.MUX:
        yield _rect(Rect(rect.x + 3, rect.y + 3, rect.width - 6, rect.height - 6), "inner", 1)
    yield f'<text class="name" x="{x:.0f}" y="{y + 20:.0f}">{escape(box.name)}</text>'
    kind = "start mission" if is_start else box.type
    yield f'<text class="type" x="{x:.0f}" y="{y + 35:.0f}">{escape(kind)}</text></g>'


def _small(rect: Rect, text: str) -> str:
    return (
        f'{_rect(rect, "pill", rect.height / 2)}<text class="type" x="{rect.x + rect.width / 2:.0f}" '
        f'y="{rect.y + 12:.0f}">{text}</text>'
    )


def _rect(rect: Rect, style: str, radius: float) -> str:
    return (
        f'<rect class="{style}" x="{rect.x:.1f}" y="{rect.y:.1f}" width="{rect.width:.1f}" '
        f'height="{rect.height:.1f}" rx="{radius:.0f}"/>'
    )


def _tables(diagram: Diagram) -> Iterator[str]:
    yield "<section><h2>Components</h2><table><tr><th>name<th>type<th>process<th>what it is</tr>"
    for box in diagram.boxes:
        yield f"<tr>{_cells(box.name, box.type, box.group, box.about)}</tr>"
    yield "</table></section><section><h2>Wires</h2><table><tr><th>kind<th>name<th>type<th>class<th>from<th>to</tr>"
    for wire in diagram.wires:
        begin, end = _names(wire.sources) or wire.about or "outside", _names(wire.targets) or "nothing here"
        cells = _cells(str(wire.kind), wire.name, wire.type, wire.qos, begin, end)
        yield f'<tr data-kind="{wire.kind}">{cells}</tr>'
    yield "</table></section>"


def _cells(*texts: str) -> str:
    return "".join(f"<td>{escape(text)}" for text in texts)


MISSION_STYLE = """
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


_LETTER, _NARROW = 7.6, 6.6  # width of a letter of names and of small text [px]
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
    return "".join(f"{line}\n" for line in _mission_page(picture, statuses))


def _mission_page(picture: MissionPicture, statuses: Sequence[int]) -> Iterator[str]:
    yield from _begin(picture.name, picture.about, MISSION_STYLE)
    if statuses:
        marks = (f'<span class="{NAMES[name]}"><b>{mark}</b> {NAMES[name]}</span>' for name, mark in MARKS.items())
        yield f'<p class="legend">{"".join(marks)}</p>'
    yield "</header><main>"
    yield from _node(picture.main, statuses)
    yield "</main>"
    if picture.interrupts:
        yield '<h2>Interrupts, in order of priority</h2><section class="interrupts">'
        for interrupt in picture.interrupts:
            yield from _node(interrupt, statuses)
        yield "</section>"
    yield "</body></html>"


def _node(drawn: Drawn, statuses: Sequence[int]) -> Iterator[str]:
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
            yield from _node(child, statuses)
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
    layout, pills = _state_layout([*states, *dict.fromkeys(ends)], joined)
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


def _state_layout(
    names: Sequence[str], joined: dict[tuple[str, str], list[str]]
) -> tuple[Layout, dict[tuple[str, str], str]]:
    """Return the places of states and of the labels between them, and the keys of these."""
    pills = {ends: f"{ends[0]} > {ends[1]}" for ends in joined}
    items = [LayoutItem(name, _LETTER * len(name) + 26, _BOX, is_round=True) for name in names]
    for ends, key in pills.items():
        items.append(LayoutItem(key, _NARROW * len(", ".join(joined[ends])) + 18, _PILL, is_round=True))
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
