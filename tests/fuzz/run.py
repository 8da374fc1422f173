"""Fuzzes one target with atheris, guided by coverage: `python -m tests.fuzz.run TARGET SECONDS FOLDER`.

New inputs go into FOLDER, the seeds stay as they are; one that raises is written down there as `crash-...`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import atheris

SEEDS = Path(__file__).parent / "seeds"
LONGEST = 4000  # bytes of an input


def main(target: str, seconds: str, folder: str) -> None:
    """Run the fuzzer; it ends the process."""
    with atheris.instrument_imports(include=["rbxcompose", "tests"]):
        from tests.fuzz.targets import TARGETS
    options = [f"-max_total_time={seconds}", f"-max_len={LONGEST}", "-timeout=10", "-rss_limit_mb=1000", "-verbosity=0"]
    where = [f"-artifact_prefix={folder}/", "-print_final_stats=1", folder, str(SEEDS / target)]
    atheris.Setup([sys.argv[0], *options, *where], TARGETS[target])
    atheris.Fuzz()


if __name__ == "__main__":
    main(*sys.argv[1:4])
