"""Which nodes of a changed mission are those of the mission before: by their names, by what they say, by their kind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from difflib import SequenceMatcher
from functools import cached_property
from typing import Any

from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode
from rbxcompose.missions.program.families import InTurn
from rbxcompose.missions.program.parts import Branches, MachineStates, Next
from rbxcompose.missions.program.program import MissionNode, Program

_ABOUT_CHILDREN = (Branches, MachineStates, Next)


class Pairing:
    """The nodes of two linked programs that stand for each other.

    Both mains are a pair if they are of the same kind, and so are the reactions of interrupts of the same name. Below a
    pair, children of the same name are pairs, then those that say the same, also where they have been moved within
    their list; of the rest those of the same kind that stand between the same pairs. A node that has been put into a
    list, or was left of one, is a pair, too.
    """

    def __init__(self, old: Program, new: Program) -> None:
        self.old, self.new = old, new
        self._contents = {id(program): tuple(map(_own_content, program.nodes)) for program in (old, new)}
        self.before: dict[int, int] = {}
        """The node before of each node that has one, by number."""
        self.around: dict[int, int] = {}
        """The node before that each new list was put around."""
        self.opened: dict[int, int] = {}
        """The node now that is left of each list before."""
        self._pair_missions(old, new)

    @cached_property
    def after(self) -> Mapping[int, int]:
        """Return the node now of each node before that is still there."""
        return {old: new for new, old in self.before.items()}

    def says_the_same(self, number: int) -> bool:
        """Return whether a node says the same as before, without regard to those below it."""
        return number in self.before and self._content(self.new, number) == self._content(self.old, self.before[number])

    def has_same_options(self, number: int) -> bool:
        """Return whether a node has the same options and modifiers as before; names of its children may differ."""
        nodes = self.new.nodes[number], self.old.nodes[self.before[number]]
        options = [(_plain(node.modifiers), _fields(node.step, without=_ABOUT_CHILDREN)) for node in nodes]
        return options[0] == options[1]

    def _content(self, program: Program, number: int) -> Hashable:
        return self._contents[id(program)][number]

    def _pair_missions(self, old: Program, new: Program) -> None:
        self._pair(old.main, new.main)
        roots = {one.name: one.root for one in old.interrupts if one.root is not None}
        for interrupt in new.interrupts:
            if interrupt.root is not None and interrupt.name in roots:
                self._pair(roots[interrupt.name], interrupt.root)

    def _pair(self, old: int, new: int) -> bool:
        """Note a pair with all pairs below it; return whether it is one."""
        before, after = self.old.nodes[old], self.new.nodes[new]
        if _kind(before) != _kind(after):
            return self._pair_around(before, after)
        self.before[new] = old
        if before.inner and after.inner:
            self._pair_missions(before.inner, after.inner)
        else:
            for pair in self._pairs(before, after):
                self._pair(*pair)
        return True

    def _pair_around(self, old: MissionNode, new: MissionNode) -> bool:
        """Note a pair of which one is inside a list that the other version of the mission does not have."""
        if isinstance(new.step, InTurn):
            whole = self._whole(self.old, old)
            inside = sorted(new.children, key=lambda child: self._whole(self.new, self.new.nodes[child]) != whole)
            if any(self._pair(old.number, child) for child in inside):
                self.around[new.number] = old.number
                return True
        if isinstance(old.step, InTurn):
            whole = self._whole(self.new, new)
            inside = sorted(old.children, key=lambda child: self._whole(self.old, self.old.nodes[child]) != whole)
            if any(self._pair(child, new.number) for child in inside):
                self.opened[old.number] = new.number
                return True
        return False

    def _pairs(self, old: MissionNode, new: MissionNode) -> Iterator[tuple[int, int]]:
        """Yield the children of two nodes that are pairs."""
        olds, news = self._keys(self.old, old), self._keys(self.new, new)
        count = {key for key, times in Counter(olds).items() if times == 1}
        unique = {key for key, times in Counter(news).items() if times == 1} & count
        paired_old = {olds.index(key): news.index(key) for key in unique}
        paired_new = set(paired_old.values())
        for _, first, last, begin, end in SequenceMatcher(None, olds, news, autojunk=False).get_opcodes():
            left = [at for at in range(first, last) if at not in paired_old]
            right = [at for at in range(begin, end) if at not in paired_new]
            paired_old |= self._alike(old, new, left, right)
        yield from ((old.children[one], new.children[other]) for one, other in sorted(paired_old.items()))

    def _alike(self, old: MissionNode, new: MissionNode, left: Sequence[int], right: Sequence[int]) -> dict[int, int]:
        """Return the children at these positions that are of the same kind, in order; then what is left of them.

        Of those, one may have been put into a list, or left of one.
        """
        before = [_kind(self.old.nodes[old.children[at]]) for at in left]
        after = [_kind(self.new.nodes[new.children[at]]) for at in right]
        blocks = SequenceMatcher(None, before, after, autojunk=False).get_matching_blocks()
        found = {left[one + at]: right[other + at] for one, other, size in blocks for at in range(size)}
        rest = [at for at in left if at not in found], [at for at in right if at not in found.values()]
        return found | dict(zip(*rest, strict=False))

    def _keys(self, program: Program, node: MissionNode) -> list[Hashable]:
        """Return what children are recognised by: their name, or all that they and those below them say."""
        names = node.step.branches.names if node.step.branches else ()
        children = (program.nodes[child] for child in node.children)
        named = zip(children, names or ("",) * len(node.children), strict=True)
        return [branch or child.name or self._whole(program, child) for child, branch in named]

    def _whole(self, program: Program, node: MissionNode) -> Hashable:
        return self._contents[id(program)][node.number : node.end]


def _kind(node: MissionNode) -> tuple[type, str, str]:
    return type(node.step), node.skill, node.inner.name if node.inner else ""


def _own_content(node: MissionNode) -> Hashable:
    """Return all that a node says itself, wherever it stands, as a value that compares."""
    return _plain(node.step), _plain(node.modifiers), node.name, node.item, node.held, len(node.children)


def _plain(value: Any) -> Hashable:
    """Return a part of a program without the places where it was written."""
    match value:
        case Span():
            return None
        case ScalarNode():
            return value.text, value.plain, _plain(value.filled)
        case MappingNode():
            return tuple((key, _plain(entry.value)) for key, entry in value.entries.items())
        case SequenceNode():
            return tuple(map(_plain, value.items))
        case Mapping():
            return tuple((_plain(key), _plain(entry)) for key, entry in value.items())
        case list() | tuple():
            return tuple(map(_plain, value))
        case set() | frozenset():
            return frozenset(map(_plain, value))
    if is_dataclass(value) and not isinstance(value, type):
        return _fields(value)
    return value if isinstance(value, Hashable) else repr(value)


def _fields(value: Any, without: tuple[type, ...] = ()) -> Hashable:
    found = (getattr(value, field.name) for field in fields(value) if field.compare)
    return type(value), tuple(_plain(one) for one in found if not isinstance(one, without))
