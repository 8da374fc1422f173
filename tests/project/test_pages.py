"""The generated pages are those of the code as it stands."""

from __future__ import annotations

import importlib.util
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def generated() -> dict[str, str]:
    spec = importlib.util.spec_from_file_location("generate_docs", DOCS / "generate.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    pages: dict[str, str] = module.pages()
    return pages


def test_every_code_has_its_page_and_no_page_is_out_of_date() -> None:
    made = generated()
    written = {page.name: page.read_text(encoding="utf-8") for page in (DOCS / "findings").glob("*.md")}
    assert written == made, "run `make docs`"


def test_every_page_says_more_than_its_title() -> None:
    short = [name for name, text in generated().items() if len(text.splitlines()) < 3]
    assert short == []
