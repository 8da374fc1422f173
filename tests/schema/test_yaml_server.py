"""What the YAML server of VS Code and others proposes and shows by the schemas."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT
from tests.loops import for_all
from tests.lsp.client import Client

SERVER = shutil.which("yaml-language-server")
BATTERY = "components:\n  battery:\n    type: battery_sim\n"
NESTED = "components:\n      battery:\n        type: battery_sim\n"

pytestmark = pytest.mark.skipif(
    SERVER is None, reason="needs yaml-language-server: npm install -g yaml-language-server"
)


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with Client(tmp_path_factory.mktemp("editor"), [str(SERVER), "--stdio"]) as made:
        yield made


def asked(client: Client, what: str, kind: str, text: str) -> Any:
    """Return the answer for the position that is marked by a bar."""
    schema = ROOT / "schemas" / f"{kind.lower()}.schema.json"
    whole = f"# yaml-language-server: $schema={schema}\nrbx: 1\nkind: {kind}\nname: shown\n{text}"
    before, _, after = whole.partition("|")
    uri = Path(f"/shown/{client.number}.yaml").as_uri()
    document = {"uri": uri, "languageId": "yaml", "version": 1, "text": before + after}
    client.tell("textDocument/didOpen", textDocument=document)
    position = {"line": before.count("\n"), "character": len(before.rpartition("\n")[2])}
    return client.ask(f"textDocument/{what}", textDocument={"uri": uri}, position=position)


@for_all(
    "kind, text, label, written",
    [
        ("Robot", "components:\n  battery:\n    type: |\n", "battery_sim", "battery_sim"),
        ("Robot", f"{BATTERY}    |\n", "warn", "warn: "),
        ("Robot", f"{BATTERY}    |\n", "process", "process: "),
        ("Robot", f"include: {{a: {{part: a.yaml}}}}\n{BATTERY}    |\n", "runtime", "runtime: "),
        ("Robot", f"profiles:\n  tired:\n    {NESTED}        |\n", "runtime", "runtime: "),
        ("Overlay", f"{BATTERY}    |\n", "warn", "warn: "),
        ("Part", f"{BATTERY}    |\n", "initial", "initial: "),
        ("Mission", "do:\n  - |\n", "wait", "wait: ${1:5 s}"),
        ("Mission", "do:\n  - wait: 5 s\n    |\n", "timeout", "timeout: ${1:5 s}"),
    ],
)
def test_it_proposes(kind: str, text: str, label: str, written: str, client: Client) -> None:
    items = {item["label"]: item for item in asked(client, "completion", kind, text)["items"]}
    assert items[label]["insertText"] == written
    assert items[label]["documentation"]


@pytest.mark.parametrize(
    ("kind", "text", "shown"),
    [
        ("Robot", f"{BATTERY}    run|time: 1 h\n", "Time from full to empty."),
        ("Robot", "components:\n  bat|tery:\n    type: battery_sim\n    runtime: 1 h\n", "drains evenly"),
        ("Overlay", f"{BATTERY}    run|time: 1 h\n", "Time from full to empty."),
        ("Mission", "do:\n  - wait: 5 s\n    time|out: 6 s\n", "Fail when the node takes longer"),
        ("Mission", "do:\n  - go|_to: dock\n", "Drives to poses"),
    ],
)
def test_it_shows(kind: str, text: str, shown: str, client: Client) -> None:
    assert shown in asked(client, "hover", kind, text)["contents"]["value"]
