"""The settings for editors other than VS Code: they can be read, and the command in them starts the server."""

from __future__ import annotations

import json
import re
import shlex
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.lsp.client import Client

FOLDER = ROOT / "editors"
PAGE = (ROOT / "docs/editors.md").read_text("utf-8")
START = {"line": 0, "character": 0}


def neovim(text: str) -> list[str]:
    """Return the command of a Lua table without expressions."""
    (words,) = re.findall(r"\bcmd = \{(.*?)\}", text)
    assert re.fullmatch(r"return \{\n(  \w+ = \{ (\"[\w.]+\"(, )?)+ \},\n)+\}\n", text)
    return re.findall(r'"(.*?)"', words)


def helix(text: str) -> list[str]:
    settings = tomllib.loads(text)
    (language,) = settings["language"]
    server = settings["language-server"][language["language-servers"][0]]
    return [server["command"], *server["args"]]


def zed(text: str) -> list[str]:
    binary = json.loads(text)["lsp"]["yaml-language-server"]["binary"]
    return [binary["path"], *binary["arguments"]]


def jetbrains(text: str) -> list[str]:
    template = json.loads(text)
    assert template["fileTypeMappings"][0]["languageId"] == "yaml"
    return shlex.split(template["programArgs"]["default"])


SETTINGS: dict[str, Callable[[str], list[str]]] = {
    "neovim/lsp/rbxcompose.lua": neovim,
    "helix/languages.toml": helix,
    "zed/settings.json": zed,
    "jetbrains/rbxcompose/template.json": jetbrains,
}


def test_no_settings_are_forgotten() -> None:
    others = (folder for folder in FOLDER.iterdir() if folder.name != "vscode")
    files = (path for folder in others for path in folder.rglob("*") if path.is_file())
    assert {path.relative_to(FOLDER).as_posix() for path in files} == set(SETTINGS)


@pytest.mark.parametrize("name", SETTINGS)
def test_the_page_shows_them(name: str) -> None:
    language = {".lua": "lua", ".toml": "toml", ".json": "json"}[Path(name).suffix]
    assert f"```{language}\n{(FOLDER / name).read_text('utf-8')}```" in PAGE
    assert f"editors/{name.removesuffix('/template.json')}`" in PAGE


COMMANDS = {tuple(read((FOLDER / name).read_text("utf-8"))) for name, read in SETTINGS.items()}


@pytest.mark.parametrize("command", sorted(COMMANDS), ids=" ".join)
def test_the_command_in_them_starts_the_server(command: tuple[str, ...], tmp_path: Path) -> None:
    program, *words = command
    assert program == "rbxcompose"
    with Client(tmp_path, [sys.executable, "-m", program, *words]) as client:
        assert client.ask("textDocument/hover", textDocument={"uri": "untitled:1"}, position=START) is None
    assert client.process.returncode == 0
