"""The tests of the page's own language, which need no browser, pass."""

from __future__ import annotations

import pytest

from tests.console.browser import console


@pytest.mark.timeout(100)
def test_the_logic_of_the_page() -> None:
    try:
        console.build()
    except console.CannotBuildError as error:
        pytest.skip(str(error))
    console.npm("test")
