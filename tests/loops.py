"""One test for many values: a promise that holds for all of them is stated, collected and reported once."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import Any

import pytest


def for_all(names: str, values: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Run a test once for each value of a parameter, or of several that a comma divides.

    Each failure names its value. A value has a folder of its own and sees neither what was printed nor what was
    patched for others; all other fixtures are shared.
    """
    parameters = names.replace(" ", "").split(",")
    tried = list(values)

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        signature = inspect.signature(test)
        others = [parameter for parameter in signature.parameters.values() if parameter.name not in parameters]

        @wraps(test)
        def run(**fixtures: Any) -> None:
            failures: list[Exception] = []
            for number, value in enumerate(tried):
                given = dict(zip(parameters, value, strict=True)) if len(parameters) > 1 else {names: value}
                try:
                    with pytest.MonkeyPatch.context() as patch:
                        test(**_own(fixtures, number, patch), **given)
                except Exception as error:
                    error.add_note(f"{names}: {value!r:.500}")
                    failures.append(error)
            if failures:
                raise failures[0] if len(failures) == 1 else ExceptionGroup(f"{len(failures)} values fail", failures)

        run.__signature__ = signature.replace(parameters=others)  # type: ignore[attr-defined]
        return run

    return decorate


def _own(fixtures: dict[str, Any], number: int, patch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return the fixtures of a value."""
    own = dict(fixtures)
    if "monkeypatch" in own:
        own["monkeypatch"] = patch
    if "tmp_path" in own:
        own["tmp_path"] = Path(own["tmp_path"], str(number))
        own["tmp_path"].mkdir()
    if "capsys" in own:
        own["capsys"].readouterr()
    return own
