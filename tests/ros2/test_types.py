"""Our types beside those of a real ROS 2: their hashes, and the bytes of messages both ways."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.msgs.definitions import INTERFACES, Structure, attribute, interface_names, parse, parts, type_hash
from rbxcompose.msgs.registry import SHIPPED
from rbxcompose.msgs.types import Message
from tests.msgs.samples import instances
from tests.soak import Soak, rare

WITNESS = Path(__file__).with_name("types_witness.py")
NOT_OURS: dict[str, str] = {}
"""Types of that ROS 2 that we lack, each with the reason: those with a `wstring` would be here, but tests have them."""


@pytest.fixture(scope="module")
def witness(ros2_python: Path) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [ros2_python, str(WITNESS)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8"
    ) as process:
        yield process
        process.kill()


@pytest.fixture(scope="module")
def theirs(witness: subprocess.Popen[str]) -> dict[str, Any]:
    assert witness.stdout is not None
    found: dict[str, Any] = json.loads(witness.stdout.readline())
    return found


def test_all_types_have_the_hashes_of_ros_2(theirs: dict[str, Any]) -> None:
    hashes = {name: one for name, one in theirs["hashes"].items() if name not in NOT_OURS}
    assert {name: type_hash(name, SHIPPED) for name in hashes} == hashes
    assert sum("/msg/" in name for name in hashes) >= 153
    assert sum("/srv/" in name for name in hashes) >= 100  # each service is five structures


def test_messages_of_ros_2_are_read_and_written_again_and_ours_are_read_by_it(
    theirs: dict[str, Any], witness: subprocess.Popen[str], soak: Soak
) -> None:
    samples: dict[str, list[str]] = theirs["samples"]
    read = {
        name: [decode(registry.message(name), bytes.fromhex(one)) for one in ones] for name, ones in samples.items()
    }
    ours = {name: _some(registry.message(name)) for name in [*samples][:: soak.examples(4, 1)]}
    question = {
        "again": {name: [encode(one).hex() for one in ones] for name, ones in read.items()},
        "ours": {name: [encode(one).hex() for one in ones] for name, ones in ours.items()},
    }
    assert witness.stdin is not None
    assert witness.stdout is not None
    witness.stdin.write(json.dumps(question) + "\n")
    witness.stdin.flush()
    answer = json.loads(witness.stdout.readline())
    assert answer["differing"] == []
    back = {
        name: [decode(registry.message(name), bytes.fromhex(one)) for one in ones]
        for name, ones in answer["theirs"].items()
    }
    assert back == ours


def _some(message: type[Message]) -> list[Message]:
    """Return a few messages with random values, the same ones each time."""
    found: list[Message] = []

    @settings(
        max_examples=4,
        derandomize=True,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
        deadline=None,
    )
    @given(instances(message).filter(lambda one: not any("\0" in text for text in _texts(one))))
    def take(one: Message) -> None:
        found.append(one)

    take()
    return found


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, tuple):
        for one in value:
            yield from _texts(one)
    elif isinstance(value, Message):
        for name in value.FIELDS:
            yield from _texts(getattr(value, attribute(name)))


OWN = {
    "msg/Grasp.msg": """# A grasp.
uint8 KIND_PINCH=1
string NAME="a # in it"
std_msgs/Header header
Finger[<=4] fingers
float32[2] widths [0.5, 1.0]
string<=8 label "none"
char[] letters
""",
    "msg/Finger.msg": "byte flags\nbool[] touches\ngeometry_msgs/Wrench[2] wrench\nuint64 end -0\n",
    "msg/Nothing.msg": "",
    "srv/Open.srv": "Grasp grasp\n---\nbool success\nNothing nothing\n",
    "action/Close.action": "float64 force 1.5\n---\n---\nFinger[] fingers\nstring[<=3] texts\n",
}


def test_rosidl_gives_a_users_own_types_the_same_hashes(ros2_python: Path, tmp_path: Path) -> None:
    for path, text in OWN.items():
        file = tmp_path / "my_msgs" / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    texts = {f"my_msgs/{path.partition('.')[0]}": text for path, text in OWN.items()}
    structures = dict(SHIPPED)
    for name, text in texts.items():
        structures |= parts(name, parse(name, text))
    theirs = _rosidl(ros2_python, tmp_path / "my_msgs")
    assert {name.rpartition("/")[2].split("_")[0] for name in theirs} == {"Grasp", "Finger", "Nothing", "Open", "Close"}
    assert {name: type_hash(name, Overlaid(structures)) for name in theirs} == theirs


class Overlaid(dict[str, Structure]):
    """Structures, with the standard ones below."""

    def __missing__(self, name: str) -> Structure:
        return SHIPPED[name]


NOT_THERE = (
    *(f"{name}_msgs" for name in ("control", "nav2", "object_recognition", "octomap", "people", "vision")),
    "topic_tools_interfaces",
)


@pytest.mark.parametrize("package", rare("tf2_msgs", "rbxcompose_msgs", "example_interfaces", *NOT_THERE))
def test_rosidl_gives_our_texts_of_what_this_ros_2_lacks_the_same_hashes(ros2_python: Path, package: str) -> None:
    theirs = _rosidl(ros2_python, INTERFACES / package)
    assert {name: type_hash(name, SHIPPED) for name in theirs} == theirs
    assert {name for name in interface_names("msg") if name.startswith(f"{package}/")} <= theirs.keys()


def _rosidl(ros2_python: Path, package: Path) -> dict[str, str]:
    command = [str(ros2_python), str(WITNESS.with_name("rosidl_witness.py")), str(package)]
    done = subprocess.run(command, capture_output=True, check=True, encoding="utf-8")
    found: dict[str, str] = json.loads(done.stdout)
    return found
