"""Which missions use which, and what can be wrong with that as a whole: circles, and too many nodes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise

from rbxcompose.findings import Finding, Related, Span, kind
from rbxcompose.missions.program.linker import DEEPEST, MOST_NODES
from rbxcompose.missions.program.program import Program

CIRCLE = kind(
    "RBX4146",
    """Missions use each other in a circle

A mission runs as one with all that it uses. One that uses itself, directly or through others, would never end.
To do something again, write `repeat` or a machine.

Bad: `patrol` has `use: rest`, and `rest` has `use: patrol`.

Good: a third mission that does both in turn.

```yaml
do:
  repeat: forever
  do:
    - use: patrol
    - use: rest
```
""",
)
TOO_MUCH = kind(
    "RBX4147",
    """A mission is too large with all that it uses

Each `use` has its own nodes. Twenty thousand nodes, and missions within sixteen others, are enough for every robot;
more is usually a mistake, such as missions that use two others each, which use two others each.

Each `run` has its own copy of all nodes in the data that it may get. With every copy counted, the missions of a robot
may have 5,000 values and operators in such nodes. All their texts together may have 30,000 names and operators, such
as `$battery` and `<`.

Use a mission in a loop instead of many times.
""",
)


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
        sizes = {one: self._walk(one, [*above, name]) for one in self._uses[name]}
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
        steps = [(one, other, self._uses[one][other]) for one, other in pairwise(names)]
        message = f"missions use each other in a circle: {' -> '.join(names)}"
        related = [Related(span, f"'{one}' uses '{other}'") for one, other, span in steps[1:]]
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
