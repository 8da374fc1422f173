"""The page for who adds a component shows files of a package that a test installs and runs."""

from __future__ import annotations

from rbxcompose import sdk
from rbxcompose.sdk import capabilities
from tests.conftest import ROOT
from tests.docs.examples import blocks_of

TEXT = (ROOT / "docs/sdk.md").read_text(encoding="utf-8")
HOME = ROOT / "tests/third_party"


def test_each_block_is_the_file_that_it_names() -> None:
    named = [block for block in blocks_of(TEXT, "sdk.md") if len(block.words) > 1]
    assert len(named) == 10
    for block in named:
        folder = HOME if block.language == "yaml" else HOME / "rbx_lamp"
        assert block.text == (folder / block.words[1]).read_text(encoding="utf-8"), str(block)


def test_it_leads_to_all_that_the_sdk_has() -> None:
    assert "(reference/sdk.md)" in TEXT


def test_authors_import_every_capability_from_the_sdk() -> None:
    kinds = {name for name, kind in vars(capabilities).items() if isinstance(kind, type)}
    wanted = {name for name in kinds if issubclass(getattr(capabilities, name), capabilities.Capability)}
    assert wanted - {*sdk.__all__} == set()
