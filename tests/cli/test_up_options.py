from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime.folder import ChosenLayers, RunOptions
from rbxcompose.runtime.supervision import launch
from rbxcompose.runtime.supervision.conductor import INTERRUPTED
from rbxcompose.testing import instance
from rbxcompose.tools.commands import up
from rbxcompose.tools.run_view import run_plan
from tests.conftest import ROOT


def parse(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    up.add_arguments(parser)
    return parser.parse_args(["robot.yaml", *words])


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("1x", RunOptions()),
        ("1", RunOptions()),
        ("20x", RunOptions(is_stepped=True, rate=20.0)),
        ("0.5x", RunOptions(is_stepped=True, rate=0.5)),
        ("max", RunOptions(is_stepped=True)),
    ],
)
def test_rates(text: str, options: RunOptions) -> None:
    assert parse("--rate", text).rate == options


@pytest.mark.parametrize("text", ["fast", "0", "-1x", "nan", "inf", "x"])
def test_a_rate_that_is_none_is_wrong_usage(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as raised:
        parse(f"--rate={text}")
    assert raised.value.code == 2
    assert "write '20x', '1x' or 'max'" in capsys.readouterr().err


@pytest.mark.parametrize(("text", "seconds"), [("30s", 30.0), ("2 min", 120.0), ("500 ms", 0.5), ("10", 10.0)])
def test_durations(text: str, seconds: float) -> None:
    assert parse("--for", text).duration == pytest.approx(seconds)


@pytest.mark.parametrize("text", ["3 m", "0 s", "-1 s", "soon"])
def test_a_duration_that_is_none_is_wrong_usage(text: str) -> None:
    with pytest.raises(SystemExit) as raised:
        parse(f"--for={text}")
    assert raised.value.code == 2


def test_real_devices_keep_their_own_time(capsys: pytest.CaptureFixture[str]) -> None:
    assert up.run(parse("--real", "--rate", "max")) == 2
    assert "--rate" in capsys.readouterr().err


def test_a_run_in_real_time_is_not_recorded_by_up_whether_of_a_robot_or_a_system(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for path in ("robots/turtlebot/robot.yaml", "systems/two_house_robots.yaml"):
        assert up.run(parse_robot(str(ROOT / path), "--record", "new.mcap", "--for", "1s")) == 2
        assert "--record needs --rate" in capsys.readouterr().err


def test_profiles_and_values_come_in_their_order() -> None:
    arguments = parse("--profile", "a", "--set", "x.y=1", "--profile", "b", "--set", "z=2", "-d")
    assert (arguments.profile, arguments.sets, arguments.detach) == (["a", "b"], ["x.y=1", "z=2"], True)


def test_without_a_mission_it_is_as_if_start_were_empty() -> None:
    assert parse("--set", "a.b=1", "--no-mission").sets == ["a.b=1", "start=null"]
    assert parse().sets == []


IDLE = "rbx: 1\nkind: Robot\nname: idle\ncomponents:\n  base:\n    type: diff_drive_sim\n"


def test_a_run_that_would_never_end_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = tmp_path / "robot.yaml"
    robot.write_text(
        "rbx: 1\nkind: Robot\nname: idle\ncomponents:\n  base:\n    type: diff_drive_sim\n", encoding="utf-8"
    )
    assert up.run(parse_robot(str(robot), "--rate", "max")) == 2
    assert "give --for" in capsys.readouterr().err


def parse_robot(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    up.add_arguments(parser)
    return parser.parse_args(words)


@pytest.mark.parametrize(("words", "named"), [(["-d"], "without -d"), (["--rate", "max"], "without --rate")])
def test_files_are_watched_in_the_foreground_and_in_real_time_only(
    words: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert up.run(parse("--watch", *words)) == 2
    assert named in capsys.readouterr().err


class Ended:
    """A robot that went down before it was up."""

    def wait_for_report(self, seconds: float) -> launch.LaunchReport:
        return launch.RunEnded(0, "asked to go down", 0.2)

    def wait(self) -> int:
        return 0


WIRED = """\
rbx: 1
kind: Robot
name: wired
components:
  base: {type: serial_base, port: /dev/board, ticks_per_metre: 4000, wheel_distance: 20 cm}
"""


def test_a_type_that_is_a_real_device_keeps_its_own_time_without_real_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = tmp_path / "robot.yaml"
    robot.write_text(WIRED, encoding="utf-8")
    assert up.run(parse_robot(str(robot), "--rate", "max", "--for", "1s")) == 2
    assert "'base' uses a real device, which keeps real time, so --rate" in capsys.readouterr().err


@pytest.mark.parametrize("real", [False, True])
def test_real_devices_without_real_are_named_before_the_start(
    *, real: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(launch, "start_supervisor", lambda *given: Ended())
    settings = {"port": "/dev/board", "ticks_per_metre": 4000, "wheel_distance": "20 cm"}
    plan = Plan("one", "one.yaml", (instance("base", "serial_base", settings),))
    assert run_plan(plan, RunOptions(layers=ChosenLayers(real=real))) == 0
    words = "note: without --real, too, these use real devices: 'base' (/dev/board)\n"
    assert capsys.readouterr().err == ("" if real else words)


@pytest.mark.parametrize(("is_detached", "exit_code"), [(True, INTERRUPTED), (False, 0)])
def test_who_waits_for_a_robot_to_be_up_learns_that_it_went_down_instead(
    is_detached: bool, exit_code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(launch, "start_supervisor", lambda *given: Ended())
    assert run_plan(Plan("one", "one.yaml", ()), RunOptions(is_detached=is_detached)) == exit_code
