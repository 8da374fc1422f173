"""A robot whose folder cannot be used is not started, and that is told as a finding."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from tests.runtime.real_robot import ROOT, TOY


def test_a_robot_without_a_place_for_its_state_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path / "file"), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
    words = [*TOY, "--name", f"homeless_{os.getpid()}"]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=15.0, cwd=ROOT)
    assert (done.returncode, "RBX9006" in done.stderr, "Not a directory" in done.stderr) == (1, True, True), done
