"""The pages of findings and the generated ones are those of the code as it stands."""

from __future__ import annotations

import inspect
from functools import cache

import pytest

from docs import generate
from docs.generating import components, families
from docs.generating.families import next_code
from rbxcompose.base.expressions.types import TYPES
from rbxcompose.base.findings import KINDS, OUR_CODES, kind
from rbxcompose.commands.finding_pages import FAMILIES, all_kinds, declared, family_of, page_folder
from rbxcompose.compiler.check_runner import all_checks
from rbxcompose.manifest.registry import sections
from rbxcompose.manifest.section import ROBOT
from rbxcompose.missions.analysis.examined import mission_checks
from rbxcompose.sdk import Component, Config, component
from tests.project.package import modules

pages = cache(generate.pages)


def test_every_page_is_there_and_none_is_out_of_date() -> None:
    assert generate.written() == pages(), "run `make docs`"


def test_every_page_says_more_than_its_title() -> None:
    short = [name for name, text in pages().items() if len(text.splitlines()) < 3]
    assert short == []


def test_every_section_has_an_example() -> None:
    assert [section.name for section in sections(ROBOT) if not section.example] == []


@component("toy_made")
class Made(Component[Config]):
    """Toy.

    Example:
        one: {type: toy_made}
    """

    made_by = "A section runs it."


def test_a_type_that_a_section_makes_shows_one_entry_too(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "A section runs it." in components.of_type("toy_made")
    shown = inspect.cleandoc(Made.__doc__ or "")
    for wrong in ("Toy.", f"{shown}\n    two: {{type: toy_made}}", "Toy.\n\nExample:\n    one:"):
        monkeypatch.setattr(Made, "__doc__", wrong)
        with pytest.raises(ValueError, match="the type 'toy_made' needs one 'Example:' with one entry"):
            components.of_type("toy_made")


def test_every_type_has_its_row() -> None:
    page = pages()["reference/expressions.md"]
    assert [name for name in (*TYPES, "choice") if f"| `{name}` |" not in page] == []


def test_every_code_belongs_to_a_family() -> None:
    assert [code for code, kind in all_kinds().items() if family_of(kind) == "other"] == []


def test_the_page_of_every_kind_is_a_file_and_no_declaration_has_prose() -> None:
    kinds = {code: one for code, one in all_kinds().items() if code.startswith(OUR_CODES)}
    assert {page.stem for page in page_folder().glob("RBX*.md")} == kinds.keys()
    assert [code for code, one in kinds.items() if one.doc] == []
    docstrings = {check.code: check.find.__doc__ for check in all_checks()}
    docstrings |= {check.code: check.find.__doc__ for check in mission_checks()}
    assert [code for code in docstrings.keys() & kinds if len((docstrings[code] or "").splitlines()) != 1] == []


def test_a_code_is_declared_once_by_a_module_that_may_be_imported_again() -> None:
    codes = [code for _, code in declared()]
    assert sorted(codes) == sorted(set(codes))
    with pytest.raises(ValueError, match="two kinds of finding have the code RBX1001"):
        kind("RBX1001")
    for _ in range(2):
        exec("kind('TOY01', doc='A toy')", {"kind": kind, "__name__": "toy"})
    del KINDS["TOY01"]


def test_the_table_of_families_counts_every_kind_and_the_next_code_is_free() -> None:
    assert {code for _, code in declared()} == {code for code in all_kinds() if code.startswith(OUR_CODES)}
    assert {next_code(family) for family in FAMILIES}.isdisjoint(all_kinds())


def test_a_family_whose_last_code_is_taken_is_full(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        families, "declared", lambda: iter([("here", "RBX2203"), ("here", "RBX2299"), ("here", "RBX2398")])
    )
    families.main()
    assert {"RBX22 is full:  servos", "RBX2399  arms", "RBX3001  wiring"} <= set(capsys.readouterr().out.splitlines())


def test_no_kind_is_left_out_by_looking_for_declarations() -> None:
    assert modules()  # whatever they declare
    assert {code for _, code in declared()} == {code for code in KINDS if code.startswith(OUR_CODES)}
