"""Compiling a robot takes no more work per part when it has more of them; counted, not timed."""

from __future__ import annotations

from cProfile import Profile
from pathlib import Path

import pytest

from benchmarks.generate import robot, write
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.model.robot import PortEnd

HEAD = "rbx: 1\nkind: Robot\nname: many\ncomponents:\n  base: {type: diff_drive_sim}\nmuxes:\n"
MUX = "  m{}: {{inputs: {{a: {{priority: 1, timeout: 1 s}}}}}}\n"


def looks(count: int, folder: Path, monkeypatch: pytest.MonkeyPatch) -> int:
    """Return how often the type of an end of a wire is looked at while a robot of so many muxes is compiled."""
    path = folder / "robot.yaml"
    path.write_text(HEAD + "".join(map(MUX.format, range(count))))
    looked: list[str] = []

    def counted(end: PortEnd) -> str:
        looked.append(end.name)
        return end.port.interface.TYPE if end.port.interface else ""

    with monkeypatch.context() as patch:
        patch.setattr(PortEnd, "type_name", property(counted))
        compile_robot(str(path), environment={})
    return len(looked)


def test_twice_the_muxes_are_twice_the_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert looks(60, tmp_path, monkeypatch) <= 2 * looks(30, tmp_path, monkeypatch)


def calls(components: int, folder: Path) -> int:
    """Return how often any function is called while a robot of so many components is compiled."""
    path = write(robot(components), folder)
    with Profile() as profile:
        out = compile_robot(str(path), environment={})
    assert out.plan is not None
    return sum(entry.callcount for entry in profile.getstats())


def test_four_times_the_components_are_four_times_the_calls(tmp_path: Path) -> None:
    calls(1, tmp_path)  # imports what all of them use
    assert calls(200, tmp_path) <= 4.5 * calls(50, tmp_path)
