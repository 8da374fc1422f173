"""Each check has a golden pair: a robot with its mistake, and what `check` says of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.base.plugins import domain_of, package_of
from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.check_runner import EVERY_ROBOT, PLUGINS, all_checks
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.msgs.std_msgs import Empty
from rbxcompose.sdk import Component, Config, Out, capabilities, component
from rbxcompose.testing.golden import Golden
from tests.checks import strangers


@component("toy_heartbeat")
class Heartbeat(Component[Config]):
    """Sends ten times per second."""

    rate = 10.0
    beat = Out(Empty, "beat", qos="command")


FOLDER = Path(__file__).parent / "golden"


@pytest.mark.timeout(200)
def test_what_a_check_says_is_its_golden_text(
    golden: Golden, monkeypatch: pytest.MonkeyPatch, subtests: pytest.Subtests
) -> None:
    monkeypatch.chdir(FOLDER)
    for code in sorted(check.code for check in all_checks()):
        with subtests.test(code):
            robot = Path(f"{code}.yaml")
            real = "# check: --real" in robot.read_text(encoding="utf-8")
            out = compile_robot(str(robot), real=real, environment={}, tries_profiles=True)
            assert {finding.code for finding in out.report} == {code}
            golden.check(f"{code}.txt", render_text(out.report, out.sources))


def test_what_rules_of_domains_are_about_is_any_robot_or_a_capability() -> None:
    known = {EVERY_ROBOT, *(name for name, cls in vars(capabilities).items() if isinstance(cls, type))}
    domains = filter(None, {domain_of(module) for module in PLUGINS.shipped.values()})
    named = {name for domain in domains for name in getattr(package_of(domain), "RULES_ABOUT", ())}
    assert named
    assert named <= known


def test_the_types_of_others_are_known() -> None:
    assert strangers.Surveyor.type_name == "toy_surveyor"


def test_every_golden_robot_belongs_to_a_check() -> None:
    assert {path.stem for path in FOLDER.glob("*.*")} == {check.code for check in all_checks()}
