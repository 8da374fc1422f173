"""Tests of missions with texts that are not saved: `python -m rbxcompose.tools.mission_editor.unsaved_tests`.

It takes the paths of tests and the `unsaved` texts by path in JSON from its input, and writes the report of
`rbxcompose test --coverage --json`. What tests cover is kept for the page only if nothing is unsaved.
"""

from __future__ import annotations

import json
import os
import sys
import time
from contextlib import suppress
from pathlib import Path

from rbxcompose.missions.view.tested import keep_tested
from rbxcompose.tools.commands.test import outcome_of
from rbxcompose.tools.mission_tests.coverage import Coverage
from rbxcompose.tools.mission_tests.reader import TrialReader
from rbxcompose.tools.mission_tests.report import as_json


def main() -> int:
    """Run the tests."""
    given, out = json.load(sys.stdin), sys.stdout
    sys.stdout = sys.stderr  # whatever a component prints is no report
    unsaved = {Path(path): text for path, text in given["unsaved"].items()}
    reading, coverage = TrialReader(os.environ, unsaved=unsaved), Coverage()
    written = [one for file in given["files"] for one in reading.every(Path(file))]
    outcomes = [outcome_of(one, reading, coverage, time.perf_counter()) for one in written]
    if not unsaved:
        for robot, missions in coverage.by_robot(time.time()).items():
            with suppress(OSError):  # such as on a machine that is read only: it is shown here all the same
                keep_tested(robot, missions)
    out.write(json.dumps(as_json(outcomes, coverage)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
