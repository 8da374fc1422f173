"""The pages of the kinds of findings: what a code means, why it matters, a bad and a good example."""

import importlib
import re
from collections.abc import Iterator
from pathlib import Path

import rbxcompose
from rbxcompose.base.findings import KINDS, FindingKind
from rbxcompose.base.plugins import load_all_foreign
from rbxcompose.manifest.files import library_root

FAMILIES = {
    "10": "keys and values",
    "11": "YAML",
    "12": "filling in",
    "13": "files and composition",
    "20": "body",
    "22": "servos",
    "23": "arms",
    "30": "wiring",
    "31": "muxes",
    "35": "rates and units",
    "36": "worlds and navigation",
    "37": "seeing",
    "38": "policies",
    "41": "missions",
    "42": "tests of missions",
    "50": "diagnostics",
    "60": "process groups",
    "61": "systems of several hosts",
    "70": "overlays and settings",
    "80": "simulated and real",
    "90": "commands and running robots",
    "91": "new manifests",
    "92": "recordings",
    "93": "plug-ins of other packages",
    "94": "this machine, and what runs on it",
    "96": "the console in a browser",
}
"""Meaning of the first two digits of a code."""

_DECLARED = re.compile(r"\(\s*\"(RBX\d{4})\"")  # what is called with a code first: `kind`, `check`, `mission_check`
_HEAD = re.compile(r"\A# \w+: (.*)\n(\n\*.*\*\n)?")  # title and, if it is there already, the line of facts
_BLOCK = re.compile(r"^```\w*\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def declared() -> Iterator[tuple[str, str]]:
    """Yield the kinds of findings of this project, as its texts declare them: module and code."""
    [home] = map(Path, rbxcompose.__path__)
    for path in sorted(home.rglob("*.py")):
        if codes := _DECLARED.findall(path.read_text(encoding="utf-8")):
            module = ".".join((home.name, *path.relative_to(home).with_suffix("").parts)).removesuffix(".__init__")
            yield from ((module, code) for code in codes)


def kind_of(code: str) -> FindingKind | None:
    """Return a kind of finding of this project, None if it has none of this code: imports what declares it alone."""
    if module := next((module for module, known in declared() if known == code), None):
        importlib.import_module(module)
    return KINDS.get(code)


def all_kinds() -> dict[str, FindingKind]:
    """Import every module that declares a kind of finding, including those of plug-ins, and return all by code."""
    for module in dict.fromkeys(module for module, _ in declared()):
        importlib.import_module(module)
    load_all_foreign()
    return dict(sorted(KINDS.items()))


def page_of(kind: FindingKind) -> tuple[str, str]:
    """Return title and body of a kind's page, from its file or, for a kind of another package, from its docstring.

    Raises:
        NotDoneError: if nobody has written the file yet
    """
    file = page_folder() / f"{kind.code}.md"
    if not kind.doc and not file.is_file():
        from rbxcompose.commands.console import NotDoneError  # with the reader, which pages do without
        from rbxcompose.manifest.reader import UNREADABLE

        raise NotDoneError(UNREADABLE.at(None, f"{kind.code} has no page: there is no file '{file}'", help="write it"))
    text = kind.doc or _HEAD.sub(r"\1\n", file.read_text(encoding="utf-8"))
    title, _, body = text.strip().partition("\n")
    return title, body.strip()


def page_folder() -> Path:
    """Return the folder of the pages of this project's kinds."""
    return library_root() / "docs" / "findings"


def title_of(kind: FindingKind) -> str:
    """Return the title of a kind's page."""
    return page_of(kind)[0].rstrip(".")


def body_of(kind: FindingKind) -> str:
    """Return a kind's page without its title."""
    return page_of(kind)[1]


def family_of(kind: FindingKind) -> str:
    """Return the topic of the kinds that share the first two digits."""
    return FAMILIES.get(kind.code.removeprefix("RBX")[:2], "other")


def facts_of(kind: FindingKind) -> str:
    """Return a summary of a kind in one line: "error; keys and values; fix: automatic"."""
    fix = ["fix: automatic ('check --fix')"] if kind.is_fixable else []
    return "; ".join([kind.severity.value, family_of(kind), *fix])


def markdown_of(kind: FindingKind) -> str:
    """Return a kind's page for the documentation."""
    body = re.sub(r"\n{3,}", "\n\n", body_of(kind))
    return f"# {kind.code}: {title_of(kind)}\n\n*{facts_of(kind)}*\n\n{body}\n"


def text_of(kind: FindingKind) -> str:
    """Return a kind's page for a terminal: examples are indented instead of fenced."""
    body = _BLOCK.sub(lambda block: re.sub(r"^(?=.)", "    ", block[1], flags=re.MULTILINE).rstrip(), body_of(kind))
    return f"{kind.code}: {title_of(kind)}\n({facts_of(kind)})\n\n{body}\n"
