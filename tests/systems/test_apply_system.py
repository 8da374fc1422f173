"""`apply SYSTEM`: nothing changes where one host refuses, and what has changed is taken back where one fails."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.commands.hosts import Remote, remember
from rbxcompose.compiler.systems.model import System
from rbxcompose.manifest.system_file import HostModel
from rbxcompose.testing.golden import Golden
from rbxcompose.tools import system_runs

_HOST = """
import json, pathlib, sys
folder, host, refuses, fails, changes = sys.argv[1:6]
words = sys.argv[6:]
with open(pathlib.Path(folder, "log"), "a") as log:
    log.write(f"{host} {next(word for word in words if word in ('--dry-run', '--yes', '--undo'))}\\n")
if "--undo" in words:
    print(json.dumps({"robot": "r", "answer": "as before"}))
    raise SystemExit(0)
fate = "restarted" if changes == "yes" else "kept"
part = {"name": "base", "type": "t", "process": "p", "fate": fate, "reasons": []}
why = "it moves" if refuses == "yes" else ""
found = {"robot": "r", "components": [part], "generation": 3, "why_not": why, "shares_change": False}
found["said"] = ["links: none -> mtls"]
print(json.dumps(found))
if fails == "yes" and "--yes" in words:
    print("error[RBX9004]: 'r' refuses: only in part")
    print("1 error")
    raise SystemExit(1)
raise SystemExit(bool(why))
"""


class _Host(Remote):
    """A host whose rbxcompose is a script that answers as told."""

    def __init__(self, folder: Path, name: str, *, refuses: bool = False, fails: bool = False, changes: bool = True):
        super().__init__(name, HostModel())
        self.script = [str(folder), name, *("yes" if flag else "no" for flag in (refuses, fails, changes))]

    def rbxcompose(self, words: Sequence[str], *, folder: str = "", has_terminal: bool = False) -> list[str]:
        return [sys.executable, "-c", _HOST, *self.script, *words]


def applied(folder: Path, monkeypatch: pytest.MonkeyPatch, hosts: Sequence[_Host], **options: Any) -> tuple[int, str]:
    """Return the exit code of `apply SYSTEM --yes` on these hosts, and what each was asked."""
    shares = {(host.name, "r"): host for host in hosts}
    system = System(Path("s.yaml"), "s", hosts={host.name: host.model for host in hosts})
    monkeypatch.setattr(system_runs, "compiled_for", lambda path, arguments, verb: system)
    monkeypatch.setattr("rbxcompose.commands.hosts.require_reachable", lambda system: None)
    monkeypatch.setattr("rbxcompose.commands.hosts.shares_of", lambda system, config: shares)
    monkeypatch.setattr(system_runs, "bundle_of", lambda system: argparse.Namespace(system="s.yaml"))
    given = {"undo": None, "host": None, "robot": None, "partial": False, "json": False, "dry_run": False}
    given |= {"yes": True, "real": False, "ssh_config": None, **options}
    code = system_runs.apply_system("s.yaml", argparse.Namespace(**given))
    log = folder / "log"
    return code, " ".join(log.read_text(encoding="utf-8").split()) if log.exists() else ""


def test_all_are_asked_and_only_those_with_changes_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, log = applied(tmp_path, monkeypatch, [_Host(tmp_path, "a"), _Host(tmp_path, "b", changes=False)])
    assert code == 0
    assert log.count("--dry-run") == 2
    assert log.endswith("a --yes")
    out = capsys.readouterr().out
    assert "b | r: 1 kept\nb | links: none -> mtls\n" in out, "components that stay as they are have no lines"


@pytest.mark.parametrize("partial", [False, True])
def test_nothing_changes_where_one_refuses_unless_in_part(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    golden: Golden,
    *,
    partial: bool,
) -> None:
    hosts = [_Host(tmp_path, "a"), _Host(tmp_path, "b", refuses=True)]
    code, log = applied(tmp_path, monkeypatch, hosts, partial=partial)
    assert code == 1
    assert log.count("--yes") == partial
    assert "b --yes" not in log
    out, error = capsys.readouterr()
    golden.check("RBX6128.txt", error)
    assert bool(out) is partial, "what did not change is not shown as if it had"


@pytest.mark.parametrize("partial", [False, True])
def test_those_before_one_that_fails_are_taken_back_unless_in_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *, partial: bool
) -> None:
    hosts = [_Host(tmp_path, "a"), _Host(tmp_path, "b", fails=True), _Host(tmp_path, "c")]
    code, log = applied(tmp_path, monkeypatch, hosts, partial=partial)
    assert code == 1
    after = log[log.index("a --yes") :]
    assert after == ("a --yes b --yes c --yes" if partial else "a --yes b --yes b --undo a --undo")
    assert "only in part" in capsys.readouterr().err


def test_json_is_one_document(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    applied(tmp_path, monkeypatch, [_Host(tmp_path, "a")], json=True)
    (host,) = json.loads(capsys.readouterr().out)["hosts"]
    assert (host["host"], host["answer"]["generation"]) == ("a", 3)


@pytest.mark.parametrize("is_up", [True, False])
def test_what_the_system_no_longer_has_is_named_while_it_may_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *, is_up: bool
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    remember("s.yaml", {("tablet", "r"): Remote("tablet", HostModel())})
    script = [sys.executable, "-c", "import sys; sys.exit(0)" if is_up else "print('error[RBX9002]'); exit(1)"]
    monkeypatch.setattr(Remote, "rbxcompose", lambda self, words, **options: script)
    assert applied(tmp_path, monkeypatch, [_Host(tmp_path, "a")])[0] == 0
    assert ("'tablet' may still run 'r'" in capsys.readouterr().err) is is_up
