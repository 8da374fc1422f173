"""A robot as a Mermaid flowchart, which GitHub and many editors draw."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.inspection.diagram import Box, BoxShape, Diagram, DiagramWire, WireContent

_ARROWS = {
    WireContent.TOPIC: "-->",
    WireContent.SERVICE: "-.->",
    WireContent.ACTION: "==>",
    WireContent.LOOK_UP: "-.-o",
}
_SHAPES = {BoxShape.COMPONENT: ("[", "]"), BoxShape.MUX: ("{{", "}}"), BoxShape.PROGRAM: ("([", "])")}
_STYLES = (
    "classDef wire fill:none,stroke-dasharray:2 2",
    "classDef mux stroke-width:2px",
)


def mermaid(diagram: Diagram) -> str:
    """Return the text of a flowchart: processes are boxes around their components."""
    return "".join(f"{line}\n" for line in _lines(diagram))


def _lines(diagram: Diagram) -> Iterator[str]:
    ids = {box.key: f"b{index}" for index, box in enumerate(diagram.boxes)}
    yield "flowchart LR"
    yield "  %% topics -->, services -.->, actions ==>, look-ups of transforms -.-o"
    for index, group in enumerate(diagram.groups):
        yield f'  subgraph p{index}["process {group}"]'
        yield from (f"    {_box(box, ids, diagram.start)}" for box in diagram.of_group(group))
        yield "  end"
    yield from (f"  {ids[executive]} --- {ids[program]}" for executive, program in diagram.runs)
    for index, wire in enumerate(diagram.wires):
        yield from (f"  {line}" for line in _wire(wire, f"w{index}", ids))
    yield from (f"  {style}" for style in _STYLES)


def _box(box: Box, ids: dict[str, str], start: str) -> str:
    begin, end = _SHAPES[box.shape]
    kind = "start mission" if box.key == start else box.type
    style = ":::mux" if box.shape is BoxShape.MUX else ""
    below = f"<br/><i>{kind}</i>" if kind != box.name else ""
    return f'{ids[box.key]}{begin}"{box.name}{below}"{end}{style}'


def _wire(wire: DiagramWire, key: str, ids: dict[str, str]) -> Iterator[str]:
    """Yield an arrow with a label; a wire with several ends, or none at one side, has a node of its own."""
    arrow, label = _ARROWS[wire.kind], f"{wire.name}<br/>{wire.short_type}"
    if wire.is_pair:
        [source], [target] = wire.sources, wire.targets
        note = f"<br/>{target.note}" if target.note else ""
        yield f'{ids[source.box]} {arrow}|"{label}{note}"| {ids[target.box]}'
        return
    yield f'{key}(["{label}"]):::wire'
    yield from (f"{ids[source.box]} {arrow} {key}" for source in wire.sources)
    for target in wire.targets:
        note = f'|"{target.note}"|' if target.note else ""
        yield f"{key} {arrow}{note} {ids[target.box]}"
