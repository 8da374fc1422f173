"""numpy is imported when it is first used, and not to check a robot that has arms, servos and a scene."""

from __future__ import annotations

import subprocess
import sys

import numpy
import pytest

from rbxcompose.base.arrays import np
from tests.conftest import ROOT

SCRIPT = """
import sys
from rbxcompose.commands.main import main
assert main(["check", "robots/pi_robot"]) == 0
sys.exit("numpy" in sys.modules)
"""


def test_it_is_numpy() -> None:
    assert all(getattr(np, name) is getattr(numpy, name) for name in numpy.__all__ if not name.startswith("__"))
    with pytest.raises(AttributeError, match="no_such_function"):
        getattr(np, "no_such_function")  # noqa: B009 - which no type checker would take


def test_to_check_a_robot_imports_no_numpy() -> None:
    subprocess.run([sys.executable, "-c", SCRIPT], cwd=ROOT, check=True, capture_output=True)
