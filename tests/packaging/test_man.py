"""The manual page: it has every command and option, and what renders it has nothing to say against it."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from docs.generating.commands import parsers
from docs.generating.man import PAGE, text, whole_page
from tests.packaging.builds import ROOT

FILE = ROOT / "docs" / PAGE


def program(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"there is no {name} here")
    return found


def test_it_is_not_out_of_date() -> None:
    assert FILE.read_text(encoding="utf-8") == whole_page(), "run `make docs`"


def test_every_command_has_its_place() -> None:
    lines = whole_page().splitlines()
    assert [parser.prog for parser in parsers() if f'.SS "{text(parser.prog)}"' not in lines] == []


@pytest.mark.parametrize(
    ("words", "roff"),
    [
        (".SH no request", "\\&.SH no request"),
        ("'quoted", "\\(aqquoted"),
        ("a `--flag` of C:\\n", "a \\fB\\-\\-flag\\fR of C:\\en"),
        ("12 °C", "12 \\[u00B0]C"),
    ],
)
def test_words_stay_words(words: str, roff: str) -> None:
    assert text(words) == roff


def test_groff_renders_it_without_a_warning() -> None:
    done = subprocess.run(
        [program("groff"), "-man", "-Tutf8", "-P-cbou", "-ww", str(FILE)], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    for words in ("EXIT STATUS", "rbxcompose up", "--set"):
        assert words in done.stdout


def test_mandoc_finds_nothing_but_style() -> None:
    done = subprocess.run([program("mandoc"), "-T", "lint", str(FILE)], capture_output=True, text=True, check=False)
    levels = ("WARNING", "ERROR", "UNSUPP", "BADARG", "SYSERR")
    told = [line for line in (done.stdout + done.stderr).splitlines() if any(f"{level}:" in line for level in levels)]
    assert [line for line in told if "missing date" not in line] == []


def test_man_knows_the_page() -> None:
    done = subprocess.run([program("man"), "-l", str(FILE)], capture_output=True, text=True, check=True)
    assert "RBXCOMPOSE(1)" in done.stdout
