"""The command `lsp` where its extra is not installed."""

from __future__ import annotations

import pytest

from rbxcompose.commands.main import main as command
from rbxcompose.tools.commands import lsp


def test_without_its_package_the_command_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(lsp, "find_spec", lambda name: None)
    assert command(["lsp"]) == 1
    said = capsys.readouterr().err
    assert "error[RBX9010]" in said
    assert "pip install 'rbxcompose[lsp]'" in said
