"""The pictures of screens in the documentation are what the commands show."""

from __future__ import annotations

from xml.etree import ElementTree

from docs import draw_screens


def test_the_pictures_are_those_that_are_drawn_now() -> None:
    for name, picture in draw_screens.pictures().items():
        ElementTree.fromstring(picture)
        assert (draw_screens.DOCS / name).read_text(encoding="utf-8") == picture, "run `make docs`"
