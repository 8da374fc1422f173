"""Which missions use which, and what can be wrong with that as a whole: circles, and too many nodes."""

from collections.abc import Iterator, Mapping
from itertools import pairwise

from rbxcompose.base.findings import Finding, Related, Span, kind
from rbxcompose.missions.program.linker import DEEPEST, MOST_NODES
from rbxcompose.missions.program.program import Program

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
