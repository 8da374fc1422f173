"""The settings for editors other than VS Code: they can be read, and the command in them starts the server."""

from __future__ import annotations

import json
import re
import shlex
import tomllib
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import pytest

from rbxcompose.commands.main import main as command
from tests.conftest import ROOT

FOLDER = ROOT / "editors"
PAGE = (ROOT / "docs/editors.md").read_text("utf-8")


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


@pytest.mark.parametrize("words", sorted(COMMANDS), ids=" ".join)
def test_the_command_in_them_starts_the_server(words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """What it serves is tried in whole sessions, of a client of ours and of VS Code."""
    program, *more = words
    assert program == "rbxcompose"
    started = mock.Mock()
    monkeypatch.setattr("rbxcompose.tools.lsp.server.make_server", started)
    assert command(more) == 0
    started.return_value.start_io.assert_called_once_with()
