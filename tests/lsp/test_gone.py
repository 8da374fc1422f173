"""Questions about files that are gone, closed, renamed or no text are answered with nothing, and all others as ever."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.lsp.client import Client

ROBOT = "robots/turtlebot/robot.yaml"
MISSION = "missions/patrol.yaml"
AT = {"line": 0, "character": 1}
RANGE = {"start": AT, "end": AT}


def opened(client: Client, path: Path, text: str | None = None) -> None:
    written = path.read_text("utf-8") if text is None else text
    document = {"uri": path.as_uri(), "languageId": "yaml", "version": 1, "text": written}
    client.tell("textDocument/didOpen", textDocument=document)


def answers(client: Client, uri: str, at: dict[str, int] = AT) -> list[Any]:
    """Ask all that can be asked of a document, and return the answers."""
    spot = {"textDocument": {"uri": uri}, "position": at}
    return [
        client.ask("textDocument/completion", **spot)["items"],
        client.ask("textDocument/definition", **spot),
        client.ask("textDocument/hover", **spot),
        client.ask("textDocument/documentSymbol", textDocument={"uri": uri}),
        client.ask("textDocument/references", **spot, context={"includeDeclaration": True}),
        client.ask("textDocument/codeAction", textDocument={"uri": uri}, range=RANGE, context={"diagnostics": []}),
    ]


NOTHING: list[Any] = [[], None, None, [], [], []]


def test_of_a_file_that_never_was_nothing_is_known(client: Client, project: Path) -> None:
    for uri in ((project / "none.yaml").as_uri(), project.as_uri(), "untitled:1", "git:/a?b", "file:///a%00b", ""):
        assert answers(client, uri) == NOTHING, uri
        spot = {"textDocument": {"uri": uri}, "position": AT}
        assert client.ask("textDocument/prepareRename", **spot) is None
        assert client.ask("textDocument/rename", **spot, newName="other") is None
        client.tell("textDocument/didSave", textDocument={"uri": uri})
        client.tell("textDocument/didClose", textDocument={"uri": uri})


def test_of_a_file_that_is_no_text_nothing_is_known(client: Client, project: Path) -> None:
    (project / "picture.yaml").write_bytes(b"\x89PNG\xff\xfe")
    assert answers(client, (project / "picture.yaml").as_uri()) == NOTHING


@pytest.mark.parametrize("name", [ROBOT, MISSION])
def test_a_file_that_is_deleted_while_it_is_open_keeps_its_answers_until_it_is_closed(
    name: str, client: Client, project: Path
) -> None:
    path = project / name
    opened(client, path)
    assert client.diagnostics(path.as_uri()) == []
    path.unlink()
    client.tell("textDocument/didSave", textDocument={"uri": path.as_uri()})
    client.diagnostics(path.as_uri())
    assert client.ask("textDocument/documentSymbol", textDocument={"uri": path.as_uri()})
    client.tell("textDocument/didClose", textDocument={"uri": path.as_uri()})
    assert client.diagnostics(path.as_uri()) == []
    assert answers(client, path.as_uri()) == NOTHING


def test_a_file_that_is_renamed_is_known_by_its_new_name(client: Client, project: Path) -> None:
    path, new = project / ROBOT, project / "robots/turtlebot/other.yaml"
    wrong = path.read_text("utf-8").replace("runtime: 45", "runtme: 45")
    opened(client, path, wrong)
    assert [found["code"] for found in client.diagnostics(path.as_uri())] == ["RBX1001"]
    path.rename(new)
    client.tell("textDocument/didClose", textDocument={"uri": path.as_uri()})
    assert client.diagnostics(path.as_uri()) == []
    opened(client, new, wrong)
    assert [found["code"] for found in client.diagnostics(new.as_uri())] == ["RBX1001"]
    assert answers(client, path.as_uri()) == NOTHING
    assert client.ask("textDocument/documentSymbol", textDocument={"uri": new.as_uri()})


def test_a_project_that_is_moved_while_it_is_open_is_known_where_it_is(client: Client, project: Path) -> None:
    path = project / MISSION
    text = path.read_text("utf-8")
    opened(client, path, text)
    assert client.diagnostics(path.as_uri()) == []
    new = project.rename(project.with_name("moved")) / MISSION
    answers(client, path.as_uri())
    client.tell("textDocument/didClose", textDocument={"uri": path.as_uri()})
    opened(client, new, text.replace("go_to: dock", "go_to: dok"))
    (finding,) = client.diagnostics(new.as_uri())
    assert "no place 'dok'" in finding["message"]
    assert answers(client, path.as_uri()) == NOTHING


def test_a_change_of_a_document_that_is_not_open_changes_nothing(client: Client, project: Path) -> None:
    path = project / ROBOT
    changed = {"textDocument": {"uri": path.as_uri(), "version": 2}, "contentChanges": [{"range": RANGE, "text": "x"}]}
    client.tell("textDocument/didChange", **changed)
    assert client.ask("textDocument/documentSymbol", textDocument={"uri": path.as_uri()})


def test_a_position_beyond_the_text_has_no_name(client: Client, project: Path) -> None:
    path = project / ROBOT
    opened(client, path)
    for at in ({"line": 9999, "character": 0}, {"line": 2, "character": 9999}):
        spot = {"textDocument": {"uri": path.as_uri()}, "position": at}
        assert client.ask("textDocument/definition", **spot) is None
        client.ask("textDocument/completion", **spot)
        client.ask("textDocument/hover", **spot)
        client.ask("textDocument/references", **spot, context={"includeDeclaration": True})
