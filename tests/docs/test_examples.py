"""What the pages show is so: manifests compile or have the mistake that is told, commands parse, code runs."""

from __future__ import annotations

import importlib.util
import shlex
import sys
from pathlib import Path

import pytest

from rbxcompose.base.findings import Severity
from rbxcompose.commands.verbs import load, parser_of, verbs
from rbxcompose.missions.program.registry import forget
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.sdk import registry
from rbxcompose.testing.bench import Bench, instance
from tests.docs.examples import ROOT, Block, checked, page_blocks
from tests.missions.simulated import simulate


@pytest.mark.parametrize("block", page_blocks("yaml"), ids=str)
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


@pytest.mark.parametrize("block", page_blocks("sh"), ids=str)
def test_a_command_parses(block: Block) -> None:
    for verb, *words in commands(block):
        assert verb in verbs()
        parser_of(verb, load(verb)).parse_args(words)


def test_the_pages_show_commands() -> None:
    assert len([words for block in page_blocks("sh") for words in commands(block)]) > 10


@pytest.mark.parametrize("block", page_blocks("python"), ids=str)
def test_code_is_python(block: Block) -> None:
    compile(block.text, str(block), "exec")


def run_block(title: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Import the block of the contributing page in which a class of this name stands."""
    blocks = [block for block in page_blocks("python") if block.page == "CONTRIBUTING.md"]
    [block] = [block for block in blocks if f"class {title}(" in block.text]
    name = title.lower()
    file = tmp_path / f"{name}.py"
    file.write_text(block.text, encoding="utf-8")
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)


def test_the_component_of_the_contributing_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_TYPES", {})  # who follows the page has a type of this name
    run_block("Thermometer", tmp_path, monkeypatch)
    bench = Bench(instance("thermometer", "thermometer", {"offset": 0.5}))
    corrected = bench.collect("temperature", Float32)
    bench.publish("raw_temperature", Float32(data=20.0))
    assert [message.data for message in corrected] == [20.5]


def test_the_kind_of_node_of_the_contributing_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_block("BeepStep", tmp_path, monkeypatch)
    try:
        simulated = simulate("do: [{beep: loud}, {beep: soft}]")
        assert simulated.advance(1) == "success"
        assert simulated.told == ["0 BEEP", "0 beep", "0 mission test: success"]
    finally:
        forget("beep")


def test_no_page_leads_to_a_page_that_is_not_there() -> None:
    pages = [*(ROOT / "docs").glob("*.md"), *(ROOT / "docs/reference").glob("*.md")]
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *pages):
        for target in links(page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def links(text: str) -> list[str]:
    targets = (piece.partition(")")[0].partition("#")[0] for piece in text.split("](")[1:])
    return [target for target in targets if target and "://" not in target]
