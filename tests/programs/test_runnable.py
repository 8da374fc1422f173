"""What `up` finds before anything starts: programs that this machine cannot run, each at its line."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.domains.programs.runnable import ask_for_real, program_findings
from rbxcompose.testing.manifests import check_text
from tests.loops import for_all
from tests.programs.foreign import robot


def findings(there: Path, /, **config: Any) -> list[tuple[str, str, int]]:
    """Return the words, the help and the line of each finding; the path of the folder is left out."""
    checked = check_text(robot("one", components={"p": {"type": "program", **config}}), there)
    made = checked.compilation.robot
    assert made is not None, checked.text
    found = list(program_findings(made, {"PATH": "/usr/bin:/bin"}, ask_for_real))
    assert {one.code for one in found} <= {"RBX9427"}
    texts = [(one.message.replace(f"{there}/", ""), one.help.replace(f"{there}/", "")) for one in found]
    return [(*text, one.span.line if one.span else 0) for text, one in zip(texts, found, strict=True)]


def executable(file: Path, text: str = "#!/bin/sh\n", mode: int = 0o755) -> None:
    file.parent.mkdir(exist_ok=True)
    file.write_text(text, encoding="latin-1")
    file.chmod(mode)


@pytest.mark.parametrize("command", [["sh", "-c", "x"], ["./build/driver"], ["/bin/sh"]])
def test_a_program_that_is_there_is_fine(tmp_path: Path, command: list[str]) -> None:
    executable(tmp_path / "build/driver")
    assert findings(tmp_path, command=command) == []


def test_a_path_is_one_from_the_folder(tmp_path: Path) -> None:
    executable(tmp_path / "build/driver")
    assert findings(tmp_path, command=["./driver"], folder="build") == []
    ((words, _, line),) = findings(tmp_path, command=["./driver"])
    assert (words, line) == ("'p' cannot be started: there is no file driver", 8)


def test_a_folder_that_is_not_there_is_told_at_its_own_line(tmp_path: Path) -> None:
    assert findings(tmp_path, command=["sh"], folder="bild") == [
        ("'p' cannot be started: there is no folder bild", "", 9)
    ]


def test_a_file_that_may_not_be_run_is_told_with_what_makes_it_so(tmp_path: Path) -> None:
    executable(tmp_path / "driver", mode=0o644)
    assert findings(tmp_path, command=["./driver"]) == [
        ("'p' cannot be started: driver is not executable", "chmod +x driver", 8)
    ]


NO_LINE = "driver: the first line of a script names what runs it: '#!/bin/sh'"
CUT_OFF = "driver is cut off: it begins as a binary, and ends within its header"
OWN = Path("/proc/self/exe").read_bytes()[:20].decode("latin-1")
CR_LF = "the lines of driver end with CR LF; Linux needs LF alone"


@for_all(
    "text, why",
    [
        ("#!/opt/no/python3 -u\n", "driver is to be run by /opt/no/python3, which is not there"),
        ("#! \t/bin/sh\t-e \n", ""),
        ("#!/bin/sh\r\ntrue\r\n", CR_LF),
        ("#!/usr/bin/env sh\r\ntrue\r\n", CR_LF),
        ("#!/bin/sh -e\n\r\n", ""),
        ("", NO_LINE),
        ("#!\ntrue\n", NO_LINE),
        ("echo hello\n", NO_LINE),
        ("\x7fELF\2\1\1\0", CUT_OFF),
        ("\x7fELF", CUT_OFF),
        (OWN, ""),
        (OWN[:18] + chr(ord(OWN[18]) ^ 1) + OWN[19:], "driver is built for another kind of processor"),
        ("\x7fELF\1" + OWN[5:18] + chr(ord(OWN[18]) ^ 1) + OWN[19:], ""),
    ],
)
def test_a_script_needs_what_runs_it(tmp_path: Path, text: str, why: str) -> None:
    executable(tmp_path / "driver", text)
    assert [words for words, _, _ in findings(tmp_path, command=["./driver"])] == (
        [f"'p' cannot be started: {why}"] if why else []
    )


def test_a_name_is_looked_for_in_the_path_that_the_program_gets(tmp_path: Path) -> None:
    executable(tmp_path / "build/driver")
    ((words, _, _),) = findings(tmp_path, command=["driver"])
    assert words == "'p' cannot be started: there is no executable 'driver' in PATH"
    assert findings(tmp_path, command=["driver"], environment={"PATH": str(tmp_path / "build")}) == []


def test_a_command_that_fails_says_why_in_one_line(tmp_path: Path) -> None:
    executable(tmp_path / "engine", "#!/bin/sh\necho first >&2; echo the reason >&2; exit 2\n")
    assert ask_for_real([str(tmp_path / "engine")]) == "the reason"
    executable(tmp_path / "engine", "#!/bin/sh\nexit 2\n")
    assert ask_for_real([str(tmp_path / "engine")]) == "it ended with status 2"
    assert ask_for_real([os.devnull]) == "Permission denied"
    assert ask_for_real(["true"]) == ""
