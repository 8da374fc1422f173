"""What is wrong in files of ArbotiX is told with its place, and the rest is imported."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.importing.imports import import_texts
from tests.loops import for_all
from tests.soak import Soak

JOINT = "joints:\n  pan: {id: 1}\n"
WRONG = {
    "not yaml": ("joints: {pan: {id: 1}\n", "RBX1102", 2),
    "empty": ("", "RBX1102", 1),
    "two documents": ("joints: {}\n---\nport: a\n", "RBX1102", 2),
    "a list": ("[1, 2]\n", "RBX2231", 1),
    "another program": ("analyzers: {power: {type: AnalyzerGroup}}\n", "RBX2231", 1),
    "nothing in it": ("port: /dev/ttyUSB0\n", "RBX2238", 0),
    "unknown key": (f"{JOINT}baudrate: 9600\n", "RBX1001", 3),
    "unknown key of a joint": ("joints:\n  pan: {id: 1, nuetral: 5}\n", "RBX1001", 2),
    "unknown key of a controller": (
        f"{JOINT}controllers:\n  a: {{type: follow_controller, joints: [pan], speed: 1}}\n",
        "RBX1001",
        4,
    ),
    "joints are a list": ("joints: [pan]\n", "RBX1003", 1),
    "joint is a number": ("joints: {pan: 1, tilt: {id: 2}}\n", "RBX1003", 1),
    "no id": ("joints: {tilt: {id: 2}, pan: {neutral: 512}}\n", "RBX1002", 1),
    "id out of range": ("joints: {tilt: {id: 2}, pan: {id: 253}}\n", "RBX1005", 1),
    "octal id": ("joints: {tilt: {id: 2}, pan: {id: 010}}\n", "RBX1003", 1),
    "same id": ("joints:\n  pan: {id: 1}\n  tilt: {id: 1}\n", "RBX2214", 3),
    "no name": ("joints: {tilt: {id: 2}, '': {id: 1}}\n", "RBX1105", 1),
    "a name that nobody can see": ('joints: {tilt: {id: 2}, "\\e": {id: 1}}\n', "RBX1106", 1),
    "speed in words": ("joints:\n  pan: {id: 1, max_speed: fast}\n", "RBX1003", 2),
    "no speed": ("joints:\n  pan: {id: 1, max_speed: 0}\n", "RBX1005", 2),
    "infinite": ("joints:\n  pan: {id: 1, max_angle: .inf}\n", "RBX1109", 2),
    "far": ("joints:\n  pan: {id: 1, max_angle: 1e300}\n", "RBX1005", 2),
    "limits in disorder": ("joints:\n  pan: {id: 1, min_angle: 90, max_angle: -90}\n", "RBX1005", 2),
    "limit beyond the usual one": ("joints:\n  pan: {id: 1, min_angle: 160}\n", "RBX1005", 2),
    "limit out of reach": ("joints:\n  pan: {id: 1, neutral: 300, min_angle: -145}\n", "RBX2235", 2),
    "no such servo": ("joints:\n  tilt: {id: 2}\n  pan: {id: 1, ticks: 2048}\n", "RBX2233", 3),
    "no such type": ("joints:\n  tilt: {id: 2}\n  pan: {id: 1, type: dinamixel}\n", "RBX1004", 3),
    "hobby servo": ("joints:\n  tilt: {id: 2}\n  pan: {id: 1, type: hobby_servo}\n", "RBX2230", 3),
    "linear joint": (f"{JOINT}  lift: {{type: calibrated_linear, max_position: 0.3}}\n", "RBX2230", 3),
    "linear controller": (f"{JOINT}controllers:\n  lift: {{type: linear_controller_i, joint: lift}}\n", "RBX2230", 4),
    "no type of a controller": (f"{JOINT}controllers:\n  a: {{joints: [pan]}}\n", "RBX1002", 4),
    "unknown controller": (f"{JOINT}controllers:\n  a: {{type: omni_controller}}\n", "RBX1004", 4),
    "no joints of a controller": (f"{JOINT}controllers:\n  a: {{type: follow_controller}}\n", "RBX1002", 4),
    "unknown joint": (f"{JOINT}controllers:\n  a: {{type: follow_controller, joints: [pam]}}\n", "RBX2215", 4),
    "number for a joint": (f"{JOINT}controllers:\n  a: {{type: follow_controller, joints: [pan, 2]}}\n", "RBX1003", 4),
    "unknown joint of a gripper": (f"{JOINT}hand: {{model: parallel, joint: finger}}\n", "RBX2215", 3),
    "unknown gripper": (f"{JOINT}hand: {{model: threesided, joint: pan}}\n", "RBX1004", 3),
    "scale of nothing": (f"{JOINT}hand: {{model: parallel, joint: pan, scale: 0}}\n", "RBX1005", 3),
    "too fast": (f"{JOINT}read_rate: 2000\n", "RBX1005", 3),
    "sensors": (f"{JOINT}analog_sensors: {{ir: {{pin: 1}}}}\n", "RBX2230", 3),
    "another frame": (f"{JOINT}controllers:\n  b: {{type: diff_controller, odom_frame_id: map}}\n", "RBX2230", 4),
    "base": (f"{JOINT}controllers:\n  b: {{type: diff_controller, accel_limit: 1}}\n", "RBX2236", 4),
    "guessed model": (JOINT, "RBX2234", 1),
    "no body": (JOINT, "RBX2239", 2),
}


@for_all("mistake", WRONG)
def test_a_mistake_is_told_at_its_place(mistake: str, tmp_path: Path) -> None:
    text, code, line = WRONG[mistake]
    found = import_texts(tmp_path, text)
    assert (code, line) in found.told, found.words


@for_all("mistake", [name for name, (text, _, _) in WRONG.items() if "tilt: {id: 2}" in text])
def test_the_rest_is_imported(mistake: str, tmp_path: Path) -> None:
    assert list(import_texts(tmp_path, WRONG[mistake][0]).data["joints"]) == ["tilt"]


def test_a_controller_goes_on_without_a_joint_that_was_left_out(tmp_path: Path) -> None:
    joints = "joints: {pan: {id: 1}, old: {type: hobby_servo, id: 2}}\n"
    both, alone = "{type: follow_controller, joints: [pan, old]}", "{type: follow_controller, joints: [old]}"
    found = import_texts(tmp_path, f"{joints}controllers:\n  both: {both}\n  alone: {alone}\n")
    assert list(found.data["controllers"]) == ["both"]
    assert "# without old" in found.text
    assert ("RBX2230", 4) in found.told


def test_what_has_no_manifest_has_an_error(tmp_path: Path) -> None:
    for text, _, _ in WRONG.values():
        found = import_texts(tmp_path, text)
        assert found.text or found.report.has_errors


KEYS = "joints controllers port baud rate read_rate type id ticks neutral range min_angle max_angle invert model joint"
NAMES = st.sampled_from([*KEYS.split(), "pan", "tilt", "max_opening", "onboard", "sync_read", "timeout"]) | st.text()
WORDS = st.sampled_from(["follow_controller", "diff_controller", "hobby_servo", "singlesided", "dualservo", "pan"])
VALUES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | WORDS
TREES = st.recursive(VALUES, lambda below: st.lists(below, max_size=3) | st.dictionaries(NAMES, below, max_size=5))
JOINTS = st.dictionaries(
    st.text(max_size=8) | st.sampled_from(["pan", "tilt"]),
    st.fixed_dictionaries({"id": st.integers(0, 260)}, optional=dict.fromkeys(KEYS.split()[8:13], VALUES)),
    max_size=4,
)
ROBOTS = st.fixed_dictionaries({"joints": JOINTS}, optional=dict.fromkeys(("controllers", "port", "hand"), TREES))


def test_whatever_is_in_a_file_the_result_is_a_manifest_or_none(soak: Soak) -> None:
    @settings(max_examples=soak.examples(40, 3000), database=None)
    @given(TREES | ROBOTS)
    def law(tree: Any) -> None:
        with TemporaryDirectory() as folder:
            found = import_texts(Path(folder), yaml.safe_dump(tree, allow_unicode=True))
        assert found.text or found.report.has_errors
        assert not found.text or found.data["kind"] == "Robot"

    law()
