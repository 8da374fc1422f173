"""Links a mission and those that it uses into one program, if nothing is wrong with that: circles, too many nodes."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise

from rbxcompose.base.findings import Finding, Related, Span, kind
from rbxcompose.missions.program.program import Interrupt, MissionNode, Program, Target

MOST_NODES = 20_000  # of a mission and all missions that it uses
DEEPEST = 16  # missions within missions


def link(program: Program, missions: Mapping[str, Program]) -> Program:
    """Return the program with the nodes of the used mission below each `use`; a linked one stays as it is.

    Raises:
        KeyError: if a used mission does not exist; checks report that earlier, and circles as well.
    """
    if all(node.inner or not node.step.uses for node in program.nodes):
        return program
    linker = _Linker(missions)
    linked = linker.mission(program, None, "")
    return replace(linked, nodes=tuple(node for node in linker.nodes if node))


class _Linker:
    """Copies nodes one after the other, with new numbers and with paths that begin at the outermost mission."""

    def __init__(self, missions: Mapping[str, Program]) -> None:
        self.missions = missions
        self.nodes: list[MissionNode | None] = []

    def mission(self, program: Program, parent: int | None, path: str) -> Program:
        """Copy the nodes of a mission, and return it with their new numbers."""
        numbers: dict[int, int] = {}
        for root in [program.main, *(interrupt.root for interrupt in program.interrupts if interrupt.root is not None)]:
            self.copy(program, root, parent, path, numbers)
        interrupts = tuple(_renumbered(interrupt, numbers) for interrupt in program.interrupts)
        return replace(program, main=numbers[program.main], interrupts=interrupts)

    def copy(self, program: Program, old: int, parent: int | None, path: str, numbers: dict[int, int]) -> int:
        """Copy a node and all below it, and return its new number."""
        node, number = program.nodes[old], len(self.nodes)
        numbers[old] = number
        self.nodes.append(None)
        own = f"{path}{node.path}"
        children = tuple(self.copy(program, child, number, path, numbers) for child in node.children)
        inner = None
        if node.step.uses:
            used = self.missions[node.step.uses.text]
            inner = self.mission(used, number, f"{own}.")
            roots = (interrupt.root for interrupt in inner.interrupts if interrupt.root is not None)
            children = (inner.main, *roots)
        self.nodes[number] = replace(
            node, number=number, parent=parent, path=own, children=children, end=len(self.nodes), inner=inner
        )
        return number


def _renumbered(interrupt: Interrupt, numbers: Mapping[int, int]) -> Interrupt:
    root = None if interrupt.root is None else numbers[interrupt.root]
    targets = tuple(Target(numbers[target.number], target.is_round) for target in interrupt.targets)
    return replace(interrupt, root=root, targets=targets)


CIRCLE = kind("RBX4146")
TOO_MUCH = kind("RBX4147")


def used_by(program: Program) -> dict[str, Span]:
    """Return the names of the missions that a mission uses, each with the span of its first use."""
    found: dict[str, Span] = {}
    for node in program.nodes:
        if node.step.uses and node.step.uses.text:
            found.setdefault(node.step.uses.text, node.step.uses.span)
    return found


class Using:
    """Finds which missions, by name, can be linked, and why the others cannot."""

    def __init__(self, missions: Mapping[str, Program]) -> None:
        self._missions = missions
        self._uses = {name: used_by(program) for name, program in missions.items()}
        self._sizes: dict[str, tuple[int, int]] = {}  # node count and depth, including the missions it uses
        self.findings: list[Finding] = []
        self.broken: set[str] = set()  # those that cannot be linked
        for name in missions:
            self._walk(name, [])
        for name, (nodes, depth) in self._sizes.items():
            if nodes > MOST_NODES or depth > DEEPEST:
                self.broken.add(name)
        self.findings += self._too_large()

    def _walk(self, name: str, above: list[str]) -> tuple[int, int]:
        """Return the size of a mission and its depth; a circle counts once."""
        if name in above:
            self._circle([*above[above.index(name) :], name])
            return 0, 0
        if name not in self._missions or name in self._sizes:
            return self._sizes.get(name, (0, 0))
        sizes = {other: self._walk(other, [*above, name]) for other in self._uses[name]}
        nodes = len(self._missions[name].nodes)
        for node in self._missions[name].nodes:
            if node.step.uses:
                nodes += sizes.get(node.step.uses.text, (0, 0))[0]
        self._sizes[name] = nodes, 1 + max((depth for _, depth in sizes.values()), default=0)
        return self._sizes[name]

    def _circle(self, names: list[str]) -> None:
        """Report a circle once, at its first mission, with the span of each step."""
        if names[0] in self.broken:
            return
        self.broken.update(names)
        steps = [(name, other, self._uses[name][other]) for name, other in pairwise(names)]
        message = f"missions use each other in a circle: {' -> '.join(names)}"
        related = [Related(span, f"'{text}' uses '{other}'") for text, other, span in steps[1:]]
        help_text = "remove one of the steps; to do it again, write 'repeat' around it"
        self.findings.append(CIRCLE.at(steps[0][2], message, help=help_text, related=related))

    def _too_large(self) -> Iterator[Finding]:
        """Yield the innermost missions that are too large; those that use them are so as a consequence."""
        for name in self._missions:
            nodes, depth = self._sizes[name]
            if nodes <= MOST_NODES and depth <= DEEPEST:
                continue
            if any(one in self.broken for one in self._uses[name]):
                continue
            span = next(iter(self._uses[name].values()), self._missions[name].nodes[0].span)
            size = f"{nodes:,} nodes" if nodes > MOST_NODES else f"missions are nested {depth} deep"
            most = f"{MOST_NODES:,}" if nodes > MOST_NODES else str(DEEPEST)
            yield TOO_MUCH.at(span, f"mission '{name}' has {size} with all that it uses; {most} are allowed")
