"""A robot as a graph for Graphviz: `dot -Tsvg`."""

from __future__ import annotations

import json
from collections.abc import Iterator

from rbxcompose.inspection.diagram import Box, BoxShape, Diagram, DiagramWire, WireContent

_STYLES = {
    WireContent.TOPIC: 'style=solid color="#1f6feb"',
    WireContent.SERVICE: 'style=dashed color="#1a7f37"',
    WireContent.ACTION: 'style=bold penwidth=2.2 color="#8250df"',
    WireContent.LOOK_UP: 'style=dotted color="#6e7781" arrowhead=odot',
}
_SHAPES = {BoxShape.COMPONENT: "box", BoxShape.MUX: "hexagon", BoxShape.PROGRAM: "note"}


def dot(diagram: Diagram) -> str:
    """Return a directed graph in DOT, with processes as clusters."""
    return "".join(f"{line}\n" for line in _lines(diagram))


def _lines(diagram: Diagram) -> Iterator[str]:
    yield f"digraph {_quoted(diagram.robot)} {{"
    yield "  // topics solid, services dashed, actions bold, look-ups of transforms dotted"
    yield '  graph [rankdir=LR fontname="sans-serif" nodesep=0.35 ranksep=0.7]'
    yield '  node [fontname="sans-serif" fontsize=11 style=rounded]'
    yield '  edge [fontname="sans-serif" fontsize=9]'
    for index, group in enumerate(diagram.groups):
        yield f"  subgraph cluster_{index} {{"
        yield f"    label={_quoted(f'process {group}')} style=rounded"
        yield from (f"    {_box(box, diagram.start)}" for box in diagram.of_group(group))
        yield "  }"
    for executive, program in diagram.runs:
        yield f"  {_quoted(executive)} -> {_quoted(program)} [dir=none]"
    for wire in diagram.wires:
        yield from (f"  {line}" for line in _wire(wire))
    yield "}"


def _box(box: Box, start: str) -> str:
    kind = "start mission" if box.key == start else box.type
    label = _label(*dict.fromkeys((box.name, kind)))
    return f"{_quoted(box.key)} [label={label} shape={_SHAPES[box.shape]}]"


def _wire(wire: DiagramWire) -> Iterator[str]:
    """Yield an edge with a label; a wire with several ends, or none at one side, has a node of its own."""
    style = _STYLES[wire.kind]
    if wire.is_pair:
        [source], [target] = wire.sources, wire.targets
        label = _label(wire.name, wire.short_type, target.note)
        yield f"{_quoted(source.box)} -> {_quoted(target.box)} [label={label} {style}]"
        return
    key = _quoted(f"{wire.kind} {wire.name}")
    yield f"{key} [label={_label(wire.name, wire.short_type)} shape=plaintext style=solid fontsize=9]"
    tail = " dir=none" if wire.targets else ""
    for source in wire.sources:
        yield f"{_quoted(source.box)} -> {key} [{style}{tail}]"
    for target in wire.targets:
        yield f"{key} -> {_quoted(target.box)} [label={_label(target.note)} {style}]"


def _label(*lines: str) -> str:
    return _quoted("\n".join(line for line in lines if line))


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
