"""Files of diagnostic_aggregator become groups that follow its rules."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.diagnostics.ros1 import Ros1Aggregator
from rbxcompose.domains.diagnostics.settings import DiagnosticsModel
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus
from rbxcompose.testing import check_text
from rbxcompose.testing.golden import Golden
from tests.importing.imports import EXAMPLES, Imported, import_files, import_texts
from tests.loops import for_all

PATH = "diagnostic_aggregator/"


def diagnostics(folder: Path, *texts: str) -> Imported:
    return import_texts(folder, *texts, program="diagnostics")


@pytest.mark.parametrize("name", ["ros1", "ros2"])
def test_what_is_written_and_what_is_told(name: str, repository: Path, golden: Golden, tmp_path: Path) -> None:
    found = import_files([EXAMPLES / f"diagnostics/{name}.yaml"], name, "diagnostics")
    golden.check(f"diagnostics_{name}.yaml", found.text)
    golden.check(f"diagnostics_{name}.txt", found.words)
    assert check_text(found.text, tmp_path).plan.robot == name


ONE = "{type: GenericAnalyzer, path: A, contains: a}"


@pytest.mark.parametrize(
    "text",
    [
        f"analyzers: {{a: {ONE}}}\n",
        f"diagnostic_aggregator: {{pub_rate: 1, analyzers: {{a: {ONE}}}}}\n",
        f"analyzers: {{ros__parameters: {{a: {ONE}}}}}\n",
        f"/lab/agg: {{ros__parameters: {{analyzers: {{a: {ONE}}}}}}}\n",
        "x: {ros__parameters: {a.type: diagnostic_aggregator/GenericAnalyzer, a.path: A, a.contains: [a]}}\n",
    ],
)
def test_analyzers_are_found_wherever_ros_keeps_them(text: str, tmp_path: Path) -> None:
    found = diagnostics(tmp_path, text)
    assert found.data["diagnostics"]["analyzers"] == {
        "a": {"type": "generic", "path": "A", "match": [{"contains": "a"}]}
    }
    assert found.told == []


def test_several_files_make_one_tree(tmp_path: Path) -> None:
    texts = [f"pub_rate: {rate}\nanalyzers: {{a: {ONE}}}\n" for rate in (1, 2)]
    found = diagnostics(tmp_path, *texts)
    assert list(found.data["diagnostics"]["analyzers"]) == ["a", "a_2"]
    assert found.data["diagnostics"]["rate"] == "1 Hz"
    assert found.told == [("RBX2232", 1)]


def test_an_item_that_loses_its_prefix_shows_as_in_ros(tmp_path: Path) -> None:
    laser = "{type: GenericAnalyzer, path: Laser, contains: Frequency, remove_prefix: hokuyo_node}"
    found = diagnostics(tmp_path, f"base_path: Robot\nanalyzers: {{laser: {laser}}}\n")
    assert found.told == []
    tree = Ros1Aggregator(DiagnosticsModel.model_validate(found.data["diagnostics"]))
    tree.feed(0.0, [DiagnosticStatus(0, "hokuyo_node: Frequency"), DiagnosticStatus(0, "hokuyo_node: Port")])
    names = [row.status.name for row in tree.report(0.0)]
    assert "/Robot/Laser/Frequency" in names
    assert "/Robot/Other/hokuyo_node: Port" in names  # nothing matches by such a prefix


WRONG = {
    "a list": ("[1]\n", "RBX2231", 1),
    "another program": ("topics: []\n", "RBX2231", 1),
    "another node": (f"a: {{ros__parameters: {{b: 1}}}}\nx: {{ros__parameters: {{a: {ONE}}}}}\n", "RBX2230", 1),
    "no type": (f"analyzers:\n  a: {ONE}\n  b: {{path: B}}\n", "RBX2296", 3),
    "no path": (f"analyzers:\n  a: {ONE}\n  b: {{type: GenericAnalyzer, contains: b}}\n", "RBX2296", 3),
    "matches nothing": (f"analyzers:\n  a: {ONE}\n  b: {{type: GenericAnalyzer, path: B}}\n", "RBX2296", 3),
    "an empty group": (f"analyzers:\n  a: {ONE}\n  b: {{type: AnalyzerGroup, path: B}}\n", "RBX2296", 3),
    "misspelt": (f"analyzers:\n  a: {ONE}\n  b: {{type: GenericAnalyzer, path: B, startwith: b}}\n", "RBX1001", 3),
    "a class of others": (f"analyzers:\n  a: {ONE}\n  b: {{type: x/YAnalyzer, path: B}}\n", "RBX2230", 3),
    "a time in words": (f"analyzers:\n  a: {ONE[:-1]}, timeout: five}}\n", "RBX1003", 2),
    "a rate in words": (f"pub_rate: fast\nanalyzers: {{a: {ONE}}}\n", "RBX1003", 1),
    "no regex": (f"analyzers:\n  a: {ONE[:-1]}, regex: '(b'}}\n", "RBX2297", 2),
    "simulated time": (f"use_sim_time: true\nanalyzers: {{a: {ONE}}}\n", "RBX2230", 1),
    "it discards what is never stale": (
        f"analyzers:\n  a: {ONE[:-1]}, timeout: -1.0,\n    discard_stale: true}}\n",
        "RBX2230",
        3,
    ),
    "critical": (f"critical: true\nanalyzers: {{a: {ONE}}}\n", "RBX2230", 1),
}


@for_all("name", WRONG)
def test_what_is_wrong_is_told_at_its_place(name: str, tmp_path: Path) -> None:
    text, code, line = WRONG[name]
    assert (code, line) in diagnostics(tmp_path, text).told


WORDS = st.sampled_from(["a", "A b", "*", "[x", "/a/b", "$x", "", "ä", "true"])
TEXTS = WORDS | st.lists(WORDS, max_size=3)
GENERIC = st.fixed_dictionaries(
    {"type": st.sampled_from([f"{PATH}GenericAnalyzer", "DiscardAnalyzer", "IgnoreAnalyzer"]), "path": WORDS},
    optional={
        **dict.fromkeys(
            ("startswith", "contains", "name", "regex", "expected", "find_and_remove_prefix", "remove_prefix"), TEXTS
        ),
        "timeout": st.floats(-1, 100),
        "num_items": st.integers(-1, 9),
        "discard_stale": st.booleans(),
    },
)
ANALYZERS = st.recursive(
    st.dictionaries(WORDS.filter(bool), GENERIC, min_size=1, max_size=3),
    lambda below: st.dictionaries(
        WORDS.filter(bool),
        st.fixed_dictionaries({"type": st.just("AnalyzerGroup"), "path": WORDS, "analyzers": below}),
        min_size=1,
        max_size=2,
    ),
    max_leaves=4,
)


@given(ANALYZERS)
def test_whatever_a_file_says_what_is_written_can_be_read(
    tmp_path_factory: pytest.TempPathFactory, analyzers: dict[str, Any]
) -> None:
    folder = tmp_path_factory.mktemp("any")
    found = diagnostics(folder, yaml.safe_dump({"analyzers": analyzers}))
    if found.text:
        assert [code for code in check_text(found.text, folder).codes if code[:5] == "RBX10" or code == "RBX5010"] == []
