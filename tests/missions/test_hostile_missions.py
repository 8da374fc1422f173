"""Whatever a mission file holds, reading and checking it gives findings and never an exception."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Report, Span
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions.analysis.examined import check_program
from rbxcompose.missions.language.reader import KEYS, read_program
from rbxcompose.missions.program.registry import kinds
from tests.missions.simulated import ROBOT

HERE = Span("mission.yaml", 1, 1, 1, 2)
OPTIONS = sorted({option for kind in kinds().values() for option in kind.fields if option != kind.name})
WORDS = st.sampled_from(
    ["", "a", "go_to", "dock", "forever", "$x", "$item", "5 s", "30 %", "2", "true", "a b", "${x}", "$battery < 1", "'"]
)
SCALARS = st.builds(lambda text, plain: ScalarNode(text, HERE, plain), WORDS | st.text(max_size=8), st.booleans())
MODIFIERS = ["name", "only_if", "optional", "timeout", "attempts", "type", "when", "default"]
NAMES = st.sampled_from([*KEYS, *sorted(kinds()), *OPTIONS, *MODIFIERS, "a", "go_to", "x", "repeet"])


def mapping(entries: dict[str, TreeNode]) -> MappingNode:
    return MappingNode({name: Entry(ScalarNode(name, HERE), value) for name, value in entries.items()}, HERE)


NODES: st.SearchStrategy[TreeNode] = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4).map(lambda items: SequenceNode(tuple(items), HERE)),
        st.dictionaries(NAMES, inner, max_size=5).map(mapping),
    ),
    max_leaves=12,
)


@given(st.dictionaries(NAMES, NODES, max_size=5), NODES)
def test_random_trees_never_raise(entries: dict[str, TreeNode], task: TreeNode) -> None:
    report = Report()
    program = read_program(mapping({**entries, "do": task}), report)
    assert program is not None
    report.extend(check_program(program, ROBOT))
    assert [node.number for node in program.nodes] == list(range(len(program.nodes)))
