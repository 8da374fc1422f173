"""The site of the documentation: its links lead somewhere, its menu has every page, and it builds without a warning."""

from __future__ import annotations

import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

import pytest

from docs import site

PAGES = site.pages()
_CODE = re.compile(r"^```.*?^```$|`[^`\n]*`", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\]\(([^)\s]+)\)")


def anchors(text: str) -> Iterator[str]:
    """Yield the anchors of headings, as GitHub makes them."""
    seen = Counter[str]()
    for heading in re.findall(r"^#+ +(.*)$", re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S), re.M):
        words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        slug = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        yield f"{slug}-{seen[slug]}" if seen[slug] else slug
        seen[slug] += 1


def test_every_link_leads_to_a_page_and_a_heading() -> None:
    headings = {name: set(anchors(text)) for name, text in PAGES.items()}
    pictures = {file.name for file in site.DOCS.iterdir() if file.suffix in site.PICTURES}
    dead = []
    for name, text in PAGES.items():
        for link in _LINK.findall(_CODE.sub("``", text)):
            target, _, anchor = link.partition("#")
            if "://" in target or target in pictures:
                continue
            parts: list[str] = []
            for part in (PurePosixPath(name).parent / target).parts if target else PurePosixPath(name).parts:
                parts = parts[:-1] if part == ".." else [*parts, part]
            page = "/".join(parts)
            if page not in headings or (anchor and anchor not in headings[page]):
                dead.append(f"{name}: {link}")
    assert dead == []


def test_the_menu_has_each_page_once() -> None:
    entries = [page for to in site.MENU.values() for page in ([to] if isinstance(to, str) else to.values())]
    assert sorted(entries) == sorted(page for page in PAGES if not re.fullmatch(r"findings/RBX\d+\.md", page))


def test_fences_keep_their_file_and_their_mistake() -> None:
    text = "Steps:\n- one\n- two\n```yaml robot wrong RBX1003\n- a\n```\n| a |\n```yaml robots/a/robot.yaml\n```\n"
    assert site.rendered_alike(text) == (
        'Steps:\n\n- one\n- two\n```yaml title="wrong: RBX1003"\n- a\n```\n\n| a |\n'
        '```yaml title="robots/a/robot.yaml"\n```\n'
    )


@pytest.mark.soak
@pytest.mark.timeout(600)
def test_it_builds_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("zensical")
    site.write(tmp_path / "site")
    words = [sys.executable, "-m", "zensical", "build", "--strict", "--config-file"]
    built = subprocess.run([*words, str(tmp_path / "site/zensical.toml")], capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stdout + built.stderr
    assert (tmp_path / "site/html/findings/RBX1001.html").exists()
