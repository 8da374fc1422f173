"""What the pages show is so: manifests compile or have the mistake that is told, commands parse, code runs."""

from __future__ import annotations

import shlex
from itertools import filterfalse
from pathlib import Path

import pytest

from rbxcompose.base.findings import Severity
from rbxcompose.commands.verbs import load, parser_of, verbs
from rbxcompose.tools.parameters.changes import assignments
from tests.docs.examples import ROOT, Block, checked, page_blocks
from tests.loops import for_all
from tests.soak import rare


def compiled_elsewhere(block: Block) -> bool:
    """Tell whether a block is the example of a type of component, which the conformance suite compiles."""
    return block.page == "components.md"


MANIFESTS = page_blocks("yaml")


@pytest.mark.parametrize(
    "block", [*filterfalse(compiled_elsewhere, MANIFESTS), *rare(*filter(compiled_elsewhere, MANIFESTS))], ids=str
)
def test_a_manifest_compiles_or_has_the_mistake_that_is_told(block: Block, tmp_path: Path) -> None:
    found = checked(block, tmp_path)
    errors = {finding.code for finding in found.compilation.report if finding.severity is Severity.ERROR}
    if block.wrong:
        assert set(found.codes) == {block.wrong}, found.text
    else:
        assert errors == set(), found.text  # a fragment is no whole robot, and may leave something unused


def commands(block: Block) -> list[list[str]]:
    lines = (shlex.split(line, comments=True) for line in block.text.splitlines())
    return [words[1:] for words in lines if words and Path(words[0]).name == "rbxcompose"]


@for_all("block", page_blocks("sh"))
def test_a_command_parses(block: Block) -> None:
    for verb, *words in commands(block):
        assert verb in verbs()
        arguments = parser_of(verb, load(verb)).parse_args(words)
        assert (verb, *words[:1]) != ("param", "set") or assignments(arguments.words)


def test_the_pages_show_commands() -> None:
    assert len([words for block in page_blocks("sh") for words in commands(block)]) > 10


@for_all("block", page_blocks("python"))
def test_code_is_python(block: Block) -> None:
    compile(block.text, str(block), "exec")


def test_no_page_leads_to_a_page_that_is_not_there() -> None:
    pages = [*(ROOT / "docs").glob("*.md"), *(ROOT / "docs/reference").glob("*.md")]
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *pages):
        for target in links(page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def links(text: str) -> list[str]:
    targets = (piece.partition(")")[0].partition("#")[0] for piece in text.split("](")[1:])
    return [target for target in targets if target and "://" not in target]
