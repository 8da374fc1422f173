"""Links a mission and those that it uses into one program with a single row of nodes."""

from collections.abc import Mapping
from dataclasses import replace

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
