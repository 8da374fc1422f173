"""Composition: identity, later wins, associativity, and what an overlay may not do."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Report, Span
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.composition.layers import read_sets
from rbxcompose.compiler.composition.overlay import compose, settled
from rbxcompose.compiler.composition.robot_manifest import History, HistoryStep
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import BROKEN, Entry, KeyPath, MappingNode, ScalarNode, TreeNode, at, children, value_span
from rbxcompose.manifest.validate import to_plain
from tests.conftest import ROOT

HERE = Span("f", 1, 1, 1, 2)


def read(text: str, file: str = "robot.yaml") -> MappingNode:
    node, findings = read_text(text, file)
    assert isinstance(node, MappingNode), findings
    return node


def composed(base: str, *overlays: str) -> tuple[object, Report]:
    report = Report()
    tree = compose(
        settled(read(base), report), [(read(text, "profile.yaml"), "profile 'x'") for text in overlays], report
    )
    return to_plain(tree), report


def a_map(data: object) -> MappingNode:
    node = a_node(data)
    assert isinstance(node, MappingNode)
    return node


def a_node(data: object) -> TreeNode:
    if isinstance(data, dict):
        return MappingNode({name: Entry(ScalarNode(name, HERE), a_node(value)) for name, value in data.items()}, HERE)
    return ScalarNode(str(data), HERE)


LEAVES = st.sampled_from("pqr")  # a name is either always a map or always a leaf, as in a schema
MAPS = st.recursive(
    st.dictionaries(LEAVES, st.integers(0, 9), max_size=3),
    lambda inner: st.tuples(
        st.dictionaries(LEAVES, st.integers(0, 9), max_size=2), st.dictionaries(st.sampled_from("xyz"), inner)
    ).map(lambda pair: {**pair[0], **pair[1]}),
    max_leaves=6,
)


def merged(*layers: object) -> MappingNode:
    report = Report()
    base, *overlays = map(a_map, layers)
    tree = compose(base, [(overlay, "overlay") for overlay in overlays], report)
    assert not report.findings
    return tree


@given(MAPS)
def test_an_empty_overlay_changes_nothing(base: object) -> None:
    assert to_plain(merged(base, {})) == to_plain(a_map(base))
    assert to_plain(merged({}, base)) == to_plain(a_map(base))


@given(MAPS, MAPS, MAPS)
def test_it_does_not_matter_which_overlays_are_composed_first(a: object, b: object, c: object) -> None:
    first = compose(merged(a, b), [(a_map(c), "c")], Report())
    last = compose(a_map(a), [(merged(b, c), "b and c")], Report())
    assert to_plain(first) == to_plain(last)


@given(MAPS, MAPS)
def test_the_later_value_wins(base: object, overlay: dict[str, object]) -> None:
    result = to_plain(merged(base, overlay))
    assert isinstance(result, dict)
    assert {name: result[name] for name in overlay if name in "pqr"} == {n: v for n, v in overlay.items() if n in "pqr"}


def renamed(data: object, ending: str) -> object:
    """Return a map whose names have an ending of their own, so that it has none in common with another."""
    return (
        {f"{name}{ending}": renamed(below, ending) for name, below in data.items()} if isinstance(data, dict) else data
    )


@given(MAPS, MAPS, MAPS)
def test_overlays_that_have_no_name_in_common_may_come_in_any_order(base: object, one: object, other: object) -> None:
    first, second = renamed(one, "1"), renamed(other, "2")
    assert to_plain(merged(base, first, second)) == to_plain(merged(base, second, first))


@given(MAPS, st.lists(MAPS, max_size=3))
def test_the_history_of_a_value_ends_with_the_one_that_holds(base: object, layers: list[object]) -> None:
    history = History()
    tree = a_map(base)
    history.write((), HistoryStep("base", tree, tree.span))
    for number, layer in enumerate(layers):
        tree = compose(tree, [(a_map(layer), f"layer {number}")], Report(), history)
    for path, node in below(tree):
        if isinstance(node, ScalarNode):
            steps = history.of(path)
            wrote = ["base"] if at(a_map(base), path) is not None else []
            wrote += [f"layer {n}" for n, layer in enumerate(layers) if at(a_map(layer), path) is not None]
            assert ([step.layer for step in steps], steps[-1].node) == (wrote, node)


def below(node: TreeNode, path: KeyPath = ()) -> Iterator[tuple[KeyPath, TreeNode]]:
    for key, child in children(node):
        yield (*path, key), child
        yield from below(child, (*path, key))


def test_maps_merge_by_key_and_lists_replace() -> None:
    data, report = composed("a: {k: 1, l: [1, 2]}\nb: 1\n", "a: {l: [3]}\n")
    assert data == {"a": {"k": 1, "l": [3]}, "b": 1}
    assert not report.findings


def test_each_value_keeps_the_place_where_it_was_written() -> None:
    tree = compose(read("a: {k: 1, m: 2}\n"), [(read("a:\n  k: 3\n", "profile.yaml"), "x")], Report())
    assert str(value_span(tree, ("a", "k"))) == "profile.yaml:2:6"
    assert str(value_span(tree, ("a", "m"))) == "robot.yaml:1:14"


def test_remove_takes_out_and_replace_does_not_merge() -> None:
    data, report = composed("a: {k: 1}\nb: {k: 1, m: 2}\n", "a: !remove\nb: !replace {m: 3}\n")
    assert data == {"b": {"m": 3}}
    assert not report.findings


def test_removing_what_is_not_there_is_a_finding() -> None:
    _, report = composed("components:\n  battery: {type: b}\n", "components:\n  batery: !remove\n")
    (finding,) = report
    assert finding.code == "RBX1302"
    assert finding.message == "profile 'x' removes 'batery', which does not exist in 'components'"
    assert finding.help == "did you mean 'battery'?"


def test_changing_a_component_that_is_not_there_is_a_finding_and_adding_one_is_not() -> None:
    base = "components:\n  battery: {type: b}\n"
    data, report = composed(base, "components:\n  batery: {runtime: 30 s}\n  spare: {type: b}\n")
    assert data == {"components": {"battery": {"type": "b"}, "spare": {"type": "b"}}}
    (finding,) = report
    assert (finding.code, str(finding.span), finding.help) == ("RBX1302", "profile.yaml:2:3", "did you mean 'battery'?")


def test_remove_outside_of_an_overlay_is_a_finding() -> None:
    data, report = composed("a: {b: !remove }\n")
    assert data == {"a": {"b": BROKEN}}, "it is there, so that nothing misses it"
    assert [finding.code for finding in report] == ["RBX1305"]


def test_short_forms_of_missions_and_arguments_can_be_changed_in_part() -> None:
    base = "missions:\n  patrol: p.yaml\nargs:\n  speed: {type: speed, default: 1 m/s}\n"
    data, _ = composed(base, "missions:\n  patrol: {with: {rounds: 3}}\nargs:\n  speed: 2 m/s\n")
    assert data == {
        "missions": {"patrol": {"file": "p.yaml", "with": {"rounds": 3}}},
        "args": {"speed": {"type": "speed", "default": "2 m/s"}},
    }


ROBOT = "components:\n  battery: {type: b, runtime: 45 s}\nargs:\n  speed: {type: speed}\nmissions: {patrol: p.yaml}\n"


def with_sets(*sets: str) -> tuple[MappingNode, Report, dict[str, str]]:
    report, sources = Report(), dict[str, str]()
    root = settled(read(ROBOT), report)
    return compose(root, read_sets(sets, root, report, sources), report), report, sources


def test_a_set_begins_with_a_component_or_a_section() -> None:
    sets = ("battery.runtime=30 s", "components.battery.warn=50 %", "args.speed=1 m/s", "missions.patrol.with.rounds=3")
    tree, report, _ = with_sets(*sets)
    assert not report.findings
    assert to_plain(tree) == {
        "components": {"battery": {"type": "b", "runtime": "30 s", "warn": "50 %"}},
        "args": {"speed": {"type": "speed", "default": "1 m/s"}},
        "missions": {"patrol": {"file": "p.yaml", "with": {"rounds": 3}}},
    }


@pytest.mark.parametrize("path", ["battery", "components.battery"])
def test_a_set_removes_a_component(path: str) -> None:
    tree, report, _ = with_sets(f"{path}=!remove")
    assert not report.findings
    assert to_plain(tree.entries["components"].value) == {}


def test_a_set_cannot_remove_what_is_not_there() -> None:
    _, report, _ = with_sets("batery=!remove")
    assert [(finding.code, finding.help) for finding in report] == [("RBX1302", "did you mean 'battery'?")]


def test_the_value_of_a_set_is_yaml_and_keeps_its_place_in_the_argument() -> None:
    tree, _, sources = with_sets("bus.domain=3", "battery.list=[1, {a: b}]")
    assert to_plain(at(tree, ("components", "battery", "list")) or tree) == [1, {"a": "b"}]
    assert value_span(tree, ("components", "battery", "list", 1, "a")) == Span("--set", 2, 22, 2, 23)
    assert sources["--set"].split("\n")[1][21] == "b"


def test_a_set_that_leads_to_nothing_is_a_finding_with_the_nearest_name() -> None:
    _, report, _ = with_sets("batery.runtime=30 s", "args.sped=1 m/s", "args=3", "battery=3", "nothing", "a..b=1")
    assert [(finding.code, finding.help) for finding in report] == [
        ("RBX1302", "did you mean 'battery'?"),
        ("RBX1302", "did you mean 'speed'?"),
        ("RBX1302", "a path starts with: speed"),
        ("RBX1303", "write --set battery.KEY=VALUE"),
        ("RBX1303", "write --set nothing=VALUE"),
        ("RBX1303", "write --set a.b=1"),
    ]


def test_a_set_that_names_an_argument_or_a_mission_alone_is_told_the_whole_path() -> None:
    _, report, _ = with_sets("speed=1 m/s", "patrol.with.rounds=3")
    assert [(finding.code, finding.help) for finding in report] == [
        ("RBX1302", "did you mean 'args.speed'?"),
        ("RBX1302", "did you mean 'missions.patrol.with.rounds'?"),
    ]


def test_a_value_of_a_set_that_is_no_yaml_is_a_finding_in_the_argument() -> None:
    _, report, _ = with_sets("battery.runtime=[1, 2")
    (finding,) = report
    assert finding.span
    assert (finding.code, finding.span.file) == ("RBX1102", "--set")


@pytest.mark.parametrize("nothing", ["", "null", "~"])
def test_a_robot_starts_no_mission_if_start_is_empty(nothing: str) -> None:
    for robot in ("robots/turtlebot", "robots/box_robot"):
        compilation = compile_robot(str(ROOT / robot), sets=[f"start={nothing}"], environment={})
        assert not compilation.report.has_errors
        assert compilation.plan
        assert compilation.plan.start is None


def test_an_empty_value_of_a_set_is_empty() -> None:
    tree, report, _ = with_sets("battery.runtime=")
    assert not report.findings
    assert to_plain(tree.entries["components"].value) == {"battery": {"type": "b", "runtime": None}}
