"""Profiles that are tried in several processes, and what is found in them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from tests.conftest import ROOT

PROFILES = """
profiles:
  bare: {components: {go_to: null}}
  bare_too: {components: {go_to: null}}
  tired: {components: {battery: {warn: 2}}}
  tired_too: {components: {battery: {warn: 3}}}
  fine: {components: {battery: {warn: 40 %}}}
  lost: {missions: {other: other.yaml}}
  misspelt: {components: {battery: {wran: 40 %}}}
"""
OTHER = "rbx: 1\nkind: Mission\nname: other\ndo:\n  - go_to: nowhere\n"
SCRIPT = """
import os, pickle, sys
from rbxcompose.compiler.compile import compile_robot

def seen(processes):
    out = compile_robot(sys.argv[1], environment={}, processes=processes)
    return [repr(one) for one in out.report], sorted(out.sources), out.needed

once, forked = seen(1), os.fork
pids = []
os.fork = lambda: pids.append(forked()) or pids[-1]
for processes in (2, 3, 20):
    assert seen(processes) == once, processes
assert len(pids) == 1 + 2 + 6, pids
pickle.dumps = lambda found: 1 / 0  # so that no other process answers
assert seen(3) == once
print(len(once[0]))
"""


def test_several_processes_find_in_profiles_what_one_does_and_one_does_it_where_they_fail(tmp_path: Path) -> None:
    text = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")
    text = re.sub(r"\nprofiles:\n(  .*\n|\n)+", "", text)
    path = tmp_path / "robot.yaml"
    path.write_text(text.replace("../../missions", str(ROOT / "missions")) + PROFILES, encoding="utf-8")
    (tmp_path / "other.yaml").write_text(OTHER, encoding="utf-8")
    words = [sys.executable, "-c", SCRIPT, str(path)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.stderr == ""
    assert int(done.stdout) >= 5
