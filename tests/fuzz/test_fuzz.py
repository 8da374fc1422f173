"""Inputs that a fuzzer has found, replayed; under `--soak` it looks for more, if it is installed (extra `fuzz`)."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.targets import TARGETS
from tests.loops import for_all
from tests.soak import Soak

ROOT = Path(__file__).parents[2]
SEEDS = Path(__file__).parent / "seeds"
SECONDS = 60


@for_all("seed", sorted(SEEDS.rglob("*.*")))
def test_a_seed_raises_nothing(seed: Path) -> None:
    TARGETS[seed.parent.name](seed.read_bytes())


@pytest.mark.timeout(0)
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.soak
def test_the_fuzzer_finds_nothing(target: str, soak: Soak, tmp_path: Path) -> None:
    if importlib.util.find_spec("atheris") is None:
        pytest.skip("needs the extra 'fuzz'")
    command = [sys.executable, "-m", "tests.fuzz.run", target, str(SECONDS), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, errors="replace")
    crashes = [path for kind in ("crash", "timeout", "oom") for path in tmp_path.glob(f"{kind}-*")]
    for crash in crashes:
        shutil.copy(crash, SEEDS / target / f"{crash.name[:20]}.bin")
    runs = re.search(r"number_of_executed_units:\s*(\d+)", done.stderr)
    kept = len(list(tmp_path.iterdir())) - len(crashes)
    soak.tell(f"fuzzing: {target}", int(runs[1]) if runs else 0, len(crashes), f"{kept:,} inputs reached something new")
    assert done.returncode == 0, done.stderr[-3000:]
    assert not crashes
