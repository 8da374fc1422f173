"""Two libraries and ours agree where every link is: for shipped robots and for random ones, at random positions."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.base.findings import Report
from rbxcompose.compiler.composition.robot_file import load_robot
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.sections.body import body
from rbxcompose.manifest.reader import ParsedText, Texts
from tests.body.kinematics import Three, description_of
from tests.body.random_bodies import positions, urdfs
from tests.soak import Soak

ROBOTS = sorted((Path(__file__).parents[2] / "robots").glob("*/robot.yaml"))
CLOSE = 1e-9


def bodies(in_profiles: bool) -> dict[str, Description]:
    """Return each body that robots have, by the first robot and profile that has it."""
    found: dict[str, tuple[str, Description]] = {}
    for file in ROBOTS:
        parsed: dict[tuple[str, str], ParsedText] = {}
        plain = manifest_of(file, parsed)
        names = [f"{file.parent.name} {profile}" for profile in plain.profiles] if in_profiles else []
        others = {name: manifest_of(file, parsed, name.split()[1]) for name in names}
        for name, manifest in {file.parent.name: plain, **others}.items():
            if (description := manifest.contents.of(body)) is not None:
                found.setdefault(description.text, (name, description))
    return dict(found.values())


def manifest_of(file: Path, parsed: dict[tuple[str, str], ParsedText], *profiles: str) -> RobotManifest:
    manifest = load_robot(file, report=Report(), sources=Texts({}, parsed), profiles=profiles, environment={})
    assert manifest, file
    return manifest


@pytest.mark.timeout(600)
def test_three_libraries_agree_on_every_link_of_the_shipped_robots(soak: Soak) -> None:
    examples = soak.examples(2, 1000)
    found = bodies(soak.is_on)
    for name, description in found.items():
        _agree(name, Three(description), examples)
    links = sum(len(one.body.links) for one in found.values())
    note = f"{links} links of {', '.join(found)} at each example, beside two libraries"
    soak.tell("poses of links: shipped robots", examples, 0, note)


def _agree(name: str, three: Three, examples: int) -> None:
    @settings(max_examples=examples, database=None)
    @given(positions(three.body))
    def agree(at: dict[str, float]) -> None:
        assert three.largest_difference(at) < CLOSE, name

    agree()


@pytest.mark.timeout(600)
def test_three_libraries_agree_on_every_link_of_a_random_body(soak: Soak) -> None:
    examples = soak.examples(6, 1000)
    links: list[int] = []

    @settings(max_examples=examples, database=None, suppress_health_check=list(HealthCheck))
    @given(st.data(), urdfs())
    def agree(data: st.DataObject, text: str) -> None:
        three = Three(description_of(text))
        links.append(len(three.body.links))
        for _ in range(3):
            assert three.largest_difference(data.draw(positions(three.body))) < CLOSE

    agree()
    note = f"{sum(links):,} links at 3 positions, beside two libraries"
    soak.tell("poses of links: random bodies", examples, 0, note)
