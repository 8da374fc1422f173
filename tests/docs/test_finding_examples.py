"""The page of each kind of finding shows the mistake and its cure, and both are what they say."""

from __future__ import annotations

import re
import textwrap
from functools import cache
from pathlib import Path

import pytest

from rbxcompose.base.findings import FindingKind, safe_fixes
from rbxcompose.commands.finding_pages import all_kinds, body_of
from rbxcompose.testing.manifests import Checked
from tests.docs.examples import HEADER, ROBOT, check_mission, check_robot, profiles_of, with_sections
from tests.soak import Soak

NOT_SHOWN = {
    "RBX3600": "the mistake is in the file of a world",
    "RBX3604": "the mistake is in the file of a world",
    "RBX1103": "an example would be too large to read; the long number of its page is told as RBX1109",
    "RBX1105": "the comma of its example is told as text that needs quotes, RBX1101",
    "RBX1111": "the mistake is in the bytes of a file",
    "RBX1207": "the mistake is in a file that is not there",
    "RBX1303": "the mistake is on the command line",
    "RBX1308": "the mistake is in two files",
    "RBX1310": "the mistake shows only beside the robot without the profile",
    "RBX1320": "the mistake is a file that is no YAML",
    "RBX3109": "no component that ships sends heartbeats",
    **dict.fromkeys(
        [f"RBX20{n:02}" for n in (*range(1, 16), *range(21, 26))],
        "the mistake is in a URDF file; tests of these try the examples",
    ),
    **dict.fromkeys(
        ("RBX2017", "RBX2018", "RBX3640", "RBX3641", "RBX3710", "RBX3720", "RBX3802"),
        "the mistake is on the command line",
    ),
    "RBX2020": "the mistake needs a xacro file; a test of it has one",
    **dict.fromkeys(
        ("RBX1322", "RBX3026", "RBX3027", "RBX3028", "RBX3029"),
        "the mistake is in the text of a message, or its folder",
    ),
    "RBX7003": "the example would be too large to read",
    "RBX4115": "the example is cut short: nobody wants to read 40 levels",
    "RBX4146": "the mistake is in two files",
    **dict.fromkeys(("RBX4163", "RBX4166", "RBX4167", "RBX4180", "RBX4181"), "the mistake is in two files"),
    "RBX4147": "the example would be too large to read",
    "RBX3120": "no component that ships reads a topic in another QoS class",
    "RBX4116": "no component that ships has an action that cannot be restarted",
}
SOMETIMES_FIXED = {  # not as they show
    f"RBX{n}" for n in (1002, 1003, 1102, 1106, 1201, 1304, 3006, 3007, 4105, 4106, 4110, 4113, 4114, 4150)
}
ONLY_SAID = ("RBX22", "RBX23", "RBX42", "RBX61", "RBX90", "RBX91", "RBX92", "RBX93", "RBX94")
"""The families of servos, arms, tests, systems, running robots, files."""

BATTERY = "components:\n  battery:\n    type: battery_sim\n", 4
BASE = "components:\n  base:\n    type: diff_drive_sim\n", 4
GO_TO = "components:\n  go_to:\n    type: go_to\n", 4
INPUTS = "muxes:\n  cmd_vel:\n    inputs:\n      navigation: {from: go_to, priority: 10, timeout: 0.5 s}\n", 6
STANDS_BELOW = {
    "RBX1001": ("components:\n", 2),
    "RBX1002": INPUTS,
    "RBX1003": BASE,
    "RBX1102": ("diagnostics:\n  analyzers:\n    power:\n", 6),
    "RBX1104": BATTERY,
    "RBX1109": GO_TO,
    **dict.fromkeys(("RBX1201", "RBX1202", "RBX1203", "RBX1205"), GO_TO),
    "RBX1204": ("bus:\n", 2),
}
"""The lines above an example that is less than a section, and how far it is indented below them."""

_EXAMPLE = re.compile(r"^(Bad|Good):[^\n]*\n\n?```yaml\n(.*?)^```", re.MULTILINE | re.DOTALL)
OF_MISSIONS = ("RBX41", "RBX7010", "RBX7011")  # whose examples are missions


def examples(kind: FindingKind) -> dict[str, str]:
    return dict(_EXAMPLE.findall(body_of(kind)))


def compiled(kind: FindingKind, text: str, folder: Path) -> Checked:
    above, depth = STANDS_BELOW.get(kind.code, ("", 0))
    fragment = above + textwrap.indent(text, " " * depth)
    if kind.code.startswith(OF_MISSIONS) and not fragment.startswith(("missions:", "values:", "triggers:")):
        return check_mission(HEADER + fragment, folder)
    robot = with_sections(ROBOT, fragment)
    return check_robot(robot, folder, profiles=profiles_of(fragment), real=kind.code.startswith("RBX80"))


@cache
def shown() -> list[FindingKind]:
    kinds = sorted(all_kinds().items())
    return [kind for code, kind in kinds if code not in NOT_SHOWN and not code.startswith(ONLY_SAID)]


@pytest.mark.timeout(200)
def test_the_bad_example_has_the_mistake_and_its_page_tells_whether_it_can_be_fixed(tmp_path: Path) -> None:
    without, fixed = set(), set()
    for kind in shown():
        found = compiled(kind, examples(kind)["Bad"], tmp_path / kind.code)
        its = [finding for finding in found.compilation.report if finding.code == kind.code]
        without |= set() if its else {kind.code}
        fixed |= {kind.code} if safe_fixes(its, found.compilation.sources) else set()
    assert without == set()
    assert fixed == {kind.code for kind in shown() if kind.is_fixable} - SOMETIMES_FIXED


@pytest.mark.timeout(200)
def test_the_good_example_has_it_no_more(tmp_path: Path, soak: Soak) -> None:
    kinds = shown()[:: soak.examples(5, 1)]
    good = {kind.code: kind for kind in kinds if "Good" in examples(kind)}
    codes = {code: compiled(kind, examples(kind)["Good"], tmp_path / code).codes for code, kind in good.items()}
    assert {code for code, found in codes.items() if code in found} == set()


def test_every_exception_is_a_kind() -> None:
    assert NOT_SHOWN.keys() | SOMETIMES_FIXED <= all_kinds().keys()
