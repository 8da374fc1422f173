"""`rbxcompose tags print`: what it writes is found again, as large as it was asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rbxcompose.commands.main import main
from rbxcompose.domains.vision.commands.tags import DPI, INCH
from rbxcompose.domains.vision.tags import TagFinder

pytest.importorskip("cv2", reason="OpenCV is not installed")
pictures = pytest.importorskip("PIL.Image", reason="pillow is not installed")


def test_a_page_has_the_tags_true_to_size(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "page.png"
    assert main(["tags", "print", "0-2", "7", "--size", "6 cm", "-o", str(out)]) == 0
    assert "measure a black square" in capsys.readouterr().out
    page = pictures.open(out)
    assert page.info["dpi"] == pytest.approx((DPI, DPI), abs=0.1)
    found = TagFinder().find(np.asarray(page.convert("L")))
    assert [tag.number for tag in found] == [0, 1, 2, 7]
    for tag in found:
        sides = np.linalg.norm(tag.corners - np.roll(tag.corners, 1, 0), axis=1) / DPI * INCH
        assert sides == pytest.approx([0.06] * 4, abs=3e-4)


def test_a_pdf_has_as_many_pages_as_it_needs(tmp_path: Path) -> None:
    out = tmp_path / "tags.pdf"
    assert main(["tags", "print", "0-8", "--size", "8 cm", "-o", str(out)]) == 0
    written = out.read_bytes()
    assert written.startswith(b"%PDF")
    assert b"/Count 3" in written


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["0-9", "-o", "tags.png"], "a .png has one page"),
        (["0", "--size", "25 cm"], "needs a paper of 32.25 cm at least"),
        (["600"], "tag36h11 has the tags 0 to 586, and no 600"),
        (["0", "-o", "tags.doc"], ".pdf or .png"),
    ],
)
def test_what_cannot_be_printed_is_told(
    words: list[str], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["tags", "print", *words]) == 2
    assert told in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "told"), [(["9-3"], "no range such as 0-5"), (["0", "--family", "tag36h12"], "did you mean 'tag36h11'?")]
)
def test_words_that_are_no_tags_are_told(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["tags", "print", *words])
    assert told in capsys.readouterr().err


def test_a_library_that_is_missing_is_told_with_its_extra(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("rbxcompose.domains.body.meshes.find_spec", lambda name: None if name == "cv2" else name)
    assert main(["tags", "print", "0"]) == 1
    assert "pip install 'rbxcompose[vision]'" in capsys.readouterr().err
