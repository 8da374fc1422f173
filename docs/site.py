"""Gathers the pages for the site that `make site` builds: README, docs/ and what stands beside them, as one folder.

The generator, Zensical, reads Python-Markdown: of the words that tests read behind the language of a fence, a file and
the code of a mistake become its title, and a list or a table has an empty line before it. The menu below names each
page that is no finding.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

DOCS = Path(__file__).parent
ROOT = DOCS.parent
OUT = ROOT / "build" / "site"
BESIDE = {"README.md": "index.md"} | {name: name for name in ("CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")}
PICTURES = (".svg", ".png")

MENU: Mapping[str, str | Mapping[str, str]] = {
    "rbxcompose": "index.md",
    "Learn": {
        "Your first robot": "tutorial.md",
        "Your first mission": "missions.md",
        "Cheat sheet": "cheat_sheet.md",
        "Coming from ROS 2, ESPHome ...": "coming_from.md",
        "How to": "how_to.md",
        "Robots of a book": "book.md",
    },
    "Robots": {
        "Bodies": "body.md",
        "Servos": "servos.md",
        "Arms": "arms.md",
        "Worlds and navigation": "navigation.md",
        "Seeing": "seeing.md",
        "Several hosts": "systems.md",
        "ROS 2": "interop.md",
        "Programs of others": "programs.md",
        "Small machines": "small_machines.md",
    },
    "Tools": {
        "Seeing a robot": "inspection.md",
        "The console": "console.md",
        "Editors": "editors.md",
        "Continuous integration": "ci.md",
        "Components of your own": "sdk.md",
    },
    "Reference": {
        "The language": "language.md",
        "Robot": "reference/robot.md",
        "Components": "reference/components.md",
        "Controllers": "reference/controllers.md",
        "Missions": "reference/missions.md",
        "Expressions": "reference/expressions.md",
        "Commands": "reference/commands.md",
        "SDK": "reference/sdk.md",
        "Findings": "findings/README.md",
    },
    "Project": {
        "Changelog": "CHANGELOG.md",
        "Security": "SECURITY.md",
        "Contributing": "CONTRIBUTING.md",
        "Architecture": "architecture.md",
        "Dependencies": "dependencies.md",
        "Benchmarks": "benchmarks.md",
        "Footprint": "footprint.md",
        "Misconfigurations": "misconfig.md",
        "Robots tried": "robots_tried.md",
        "Quality": "quality.md",
    },
}

SETTINGS = """\
[project]
site_name = "rbxcompose"
site_description = "Docker Compose for robots: YAML in, a checked and running robot out."
docs_dir = "pages"
site_dir = "html"
use_directory_urls = false
nav = {menu}

[project.theme]
font = false  # nothing is fetched from elsewhere
features = ["content.code.copy", "navigation.footer", "navigation.sections", "navigation.top", "search.highlight"]

[[project.theme.palette]]
media = "(prefers-color-scheme: light)"
scheme = "default"
toggle.icon = "lucide/sun"
toggle.name = "Dark"

[[project.theme.palette]]
media = "(prefers-color-scheme: dark)"
scheme = "slate"
toggle.icon = "lucide/moon"
toggle.name = "Light"

[project.markdown_extensions]
attr_list = {{}}
sane_lists = {{}}
tables = {{}}
toc.permalink = true
toc.slugify = {{ object = "pymdownx.slugs.slugify", kwds = {{ case = "lower" }} }}
pymdownx.highlight.pygments_lang_class = true
pymdownx.superfences = {{}}
"""
_FENCE = re.compile(r"^( *```)(\w*)(.*)$")
_LIST = re.compile(r"^ *(?:[-*]|\d+\.) ")


def pages() -> dict[str, str]:
    """Return the path on the site -> Markdown of all pages, in the words of GitHub."""
    found = {to: _at_the_top((ROOT / name).read_text(encoding="utf-8")) for name, to in BESIDE.items()}
    for page in sorted(DOCS.rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        for name, to in BESIDE.items():
            text = re.sub(rf"\]\(\.\./{name}(?=[)#])", f"]({to}", text) if page.parent == DOCS else text
        found[page.relative_to(DOCS).as_posix()] = text
    return found


def _at_the_top(text: str) -> str:
    """Return a page of the root folder as it stands beside the pages of docs/."""
    return re.sub(r"\]\(README\.md(?=[)#])", "](index.md", text.replace("](docs/", "]("))


def rendered_alike(text: str) -> str:
    """Return a page's Markdown for Python-Markdown."""
    return "".join(f"{line}\n" for line in _lines(text))


def _lines(text: str) -> Iterator[str]:
    is_code, before = False, ""
    for line in text.splitlines():
        if fence := _FENCE.match(line):
            is_code = not is_code
            line = f"{fence[1]}{fence[2]}{_title(fence[3].split())}"
        elif not is_code:
            is_item = _LIST.match(line) and not _LIST.match(before) and not before.startswith(" ")
            if before.strip() and (is_item or (line.startswith("|") and not before.startswith("|"))):
                yield ""
        yield line
        before = line


def _title(words: list[str]) -> str:
    """Return the title of a fence as an attribute, after the words behind its language."""
    parts = [word for word in words if "/" in word]
    parts += [f"wrong: {words[words.index('wrong') + 1]}"] if "wrong" in words else []
    return f' title="{", ".join(parts)}"' if parts else ""


def settings() -> str:
    """Return the settings of the generator."""
    menu = ", ".join(f"{{ {json.dumps(title)} = {_entry(to)} }}" for title, to in MENU.items())
    return SETTINGS.format(menu=f"[{menu}]")


def _entry(to: str | Mapping[str, str]) -> str:
    if isinstance(to, str):
        return json.dumps(to)
    return f"[{', '.join(f'{{ {json.dumps(title)} = {json.dumps(page)} }}' for title, page in to.items())}]"


def write(out: Path) -> None:
    """Write the pages, the pictures and the settings to a folder, which is emptied before."""
    shutil.rmtree(out, ignore_errors=True)
    for name, text in pages().items():
        file = out / "pages" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(rendered_alike(text), encoding="utf-8")
    for picture in DOCS.iterdir():
        if picture.suffix in PICTURES:
            shutil.copy(picture, out / "pages")
    (out / "zensical.toml").write_text(settings(), encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else OUT)
