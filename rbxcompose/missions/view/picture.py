"""A mission as a picture: rows of nodes with their contents, for text, diagrams and pages alike."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any, NamedTuple

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.text import condition_in_words
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.program.parts import Form
from rbxcompose.missions.program.program import CONTINUE, END, RESTART, Interrupt, MissionNode, Program, RobotNames

LONGEST = 60  # characters of the text in a node


@dataclass(frozen=True, slots=True)
class Arrow:
    """A transition of a machine: on this outcome (empty: on any) to this state or end."""

    outcome: str
    to: str


@dataclass(frozen=True, slots=True)
class Drawn:
    """One node: its number in the linked program, what it is, the text in it, and what is around it.

    `role` is what it is to its parent (`then`, a branch); an interrupt is a node of its own, without a number.
    `form` is a word of `Form`. `sentence` says what it does, read aloud; `place` is where that stands among all
    sentences: 1.2 is the second one within the first.
    """

    number: int | None
    kind: str
    text: str = ""
    name: str = ""
    role: str = ""
    notes: tuple[str, ...] = ()
    arrows: tuple[Arrow, ...] = ()
    is_start: bool = False
    children: tuple[Drawn, ...] = ()
    sign: str = ""
    form: str = Form.AFTER
    sentence: str = ""
    place: str = ""

    @property
    def title(self) -> str:
        """Return the kind with the text in it."""
        return f"{self.kind} {self.text}".strip()

    def all(self) -> Iterator[Drawn]:
        """Yield it and all below it."""
        yield self
        for child in self.children:
            yield from child.all()


@dataclass(frozen=True, slots=True)
class MissionPicture:
    """A mission: its main node and its interrupts."""

    name: str
    about: str
    main: Drawn
    interrupts: tuple[Drawn, ...] = ()
    count: int = 0

    @property
    def roots(self) -> tuple[Drawn, ...]:
        """Return the nodes at the top."""
        return (self.main, *self.interrupts)


def picture_to_data(picture: MissionPicture) -> dict[str, Any]:
    """Return a picture as data for JSON."""
    return asdict(picture)


def picture_from_data(data: Mapping[str, Any]) -> MissionPicture:
    """Return the picture from the data that `picture_to_data` made."""
    interrupts = tuple(map(_drawn_from, data["interrupts"]))
    return MissionPicture(data["name"], data["about"], _drawn_from(data["main"]), interrupts, data["count"])


def _drawn_from(data: Mapping[str, Any]) -> Drawn:
    more = {
        "notes": tuple(data["notes"]),
        "arrows": tuple(Arrow(**arrow) for arrow in data["arrows"]),
        "children": tuple(map(_drawn_from, data["children"])),
    }
    return Drawn(**{**data, **more})


def picture_of(program: Program, robot: RobotNames) -> MissionPicture:
    """Return the picture of a mission, including the missions it uses."""
    linked = link(program, robot.missions)
    sketch = _Sketch(linked, robot)
    interrupts = tuple(_interrupt(sketch, interrupt, f"{at}") for at, interrupt in enumerate(linked.interrupts, 2))
    return MissionPicture(linked.name, linked.about, _drawn(sketch, linked.main, "1"), interrupts, len(linked.nodes))


class _Sketch(NamedTuple):
    """A linked mission that is drawn, and what the robot offers it."""

    linked: Program
    robot: RobotNames


def _interrupt(sketch: _Sketch, interrupt: Interrupt, place: str) -> Drawn:
    children = (_drawn(sketch, interrupt.root, f"{place}.1"),) if interrupt.root is not None else ()
    restarts = f" {interrupt.restarts.text}" if interrupt.restarts else ""
    notes = (f"afterwards {interrupt.afterwards}{restarts}",)
    then = {CONTINUE: "go on", RESTART: f"restart{restarts or ' the mission'}", END: "end in success"}
    react = f"{'do this, then ' if children else ''}{then[interrupt.afterwards]}"
    words = f"Whenever {condition_in_words(interrupt.when.expression)}, {react}"
    text = f"when {interrupt.when.expression.text}"
    return Drawn(
        *(None, "interrupt", text, interrupt.name, "", notes),
        children=children,
        sentence=f"{interrupt.name}: {words}",
        place=place,
    )


def _drawn(sketch: _Sketch, number: int, place: str, role: str = "", is_start: bool = False, before: str = "") -> Drawn:
    linked = sketch.linked
    node = linked.nodes[number]
    step, look = node.step, node.step.look
    start = step.states.start if step.states else ""
    places = [f"{place}.{at}" for at in range(1, len(node.children) + 1)]
    children = tuple(
        _drawn(sketch, child, places[at], one, bool(start) and linked.nodes[child].name == start, step.before(at))
        for at, (child, one) in enumerate(zip(node.children, _roles(linked, node), strict=True))
    )
    if node.inner is not None:
        reactions = [interrupt for interrupt in node.inner.interrupts if interrupt.root is not None]
        inner = (_interrupt(sketch, reaction, f"{place}.{at}") for at, reaction in enumerate(reactions, 2))
        children = (children[0], *inner)
    leads = step.leads_to.to.items() if step.leads_to else ()
    arrows = tuple(Arrow(outcome, to) for outcome, to in leads)
    name = "" if role == node.name else node.name
    text, notes = _short(step.text(node)), tuple(_notes(node))
    sentence = _sentence(sketch, node, before, name)
    return Drawn(
        *(number, step.word, text, name, role, notes, arrows, is_start, children, look.sign, look.form),
        *(sentence, place),
    )


def _sentence(sketch: _Sketch, node: MissionNode, before: str, name: str) -> str:
    """Return what a node does, with its modifiers, read aloud."""
    clauses = filter(None, (modifier.clause() for modifier in reversed([*node.modifiers.values()])))
    said = f"{node.step.sentence(node, sketch.robot)}{''.join(f'; {one}' for one in clauses)}"
    title = "" if node.step.look.form == Form.STATE else name
    return ": ".join(f"{part[0].upper()}{part[1:]}" if part is said else part for part in (before, title, said) if part)


def heading_of(drawn: Drawn, node: MissionNode) -> str:
    """Return the number and the sentence of a node without its modifiers, and of a state without where it leads."""
    clauses = sum(bool(modifier.clause()) for modifier in node.modifiers.values())
    words = drawn.sentence.rsplit("; ", clauses)[0] if clauses else drawn.sentence
    return f"{drawn.place} {words.partition(' (')[0] if node.step.look.form == Form.STATE else words}"


def _roles(linked: Program, node: MissionNode) -> Sequence[str]:
    """Return what each child is to its node: the key under which it was written, where that is worth showing."""
    written = [linked.nodes[child].path.removeprefix(node.path).strip(".").partition(".")[0] for child in node.children]
    return [item if node.step.look.has_roles and not item.isdecimal() else "" for item in written]


def _notes(node: MissionNode) -> Iterator[str]:
    """Yield the modifiers of a node, from the outside in, in words."""
    for key, modifier in node.modifiers.items():
        for word in modifier.moments.deeds if modifier.moments else (key,):
            yield _short(f"{word} {modifier.said}".strip().replace("_", " "))


def _short(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 3]}..."
