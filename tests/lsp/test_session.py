"""A whole session of an editor with the real server, over stdin and stdout.

Questions about files that are gone, closed, renamed or no text are answered with nothing, and all others as ever.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT
from tests.lsp.client import Client
from tests.soak import Soak, rare

ROBOT = "robots/turtlebot/robot.yaml"
MISSION = "missions/patrol.yaml"
AT = {"line": 0, "character": 1}
RANGE = {"start": AT, "end": AT}
NOTHING: list[Any] = [[], None, None, [], [], []]


def opened(client: Client, path: Path, text: str | None = None) -> dict[str, str]:
    document = {"uri": path.as_uri(), "languageId": "yaml", "version": 1, "text": text or path.read_text("utf-8")}
    client.tell("textDocument/didOpen", textDocument=document)
    return {"uri": path.as_uri()}


def place(text: str, word: str, offset: int = 0) -> dict[str, int]:
    """Return the position of a word in UTF-16 units."""
    before = text[: text.index(word) + offset]
    line = before.rpartition("\n")[2]
    return {"line": before.count("\n"), "character": len(line.encode("utf-16-le")) // 2}


def change(text: str, old: str, new: str) -> dict[str, Any]:
    return {"range": {"start": place(text, old), "end": place(text, old, len(old))}, "text": new}


def test_an_editor_opens_a_robot_types_completes_jumps_hovers_and_leaves(client: Client, project: Path) -> None:
    path = project / "robots/turtlebot/robot.yaml"
    text = path.read_text("utf-8")
    document = opened(client, path)
    assert client.diagnostics(path.as_uri()) == []

    versioned = {**document, "version": 2}
    client.tell(
        "textDocument/didChange", textDocument=versioned, contentChanges=[change(text, "runtime: 45", "runtme: 45")]
    )
    (finding,) = client.diagnostics(path.as_uri())
    assert finding["code"] == "RBX1001"
    assert finding["message"] == "unknown key 'runtme' in component 'battery'\ndid you mean 'runtime'?"
    assert finding["range"]["start"] == place(text, "runtime: 45")

    (action,) = client.ask(
        "textDocument/codeAction", textDocument=document, range=finding["range"], context={"diagnostics": [finding]}
    )
    ((edit,),) = action["edit"]["changes"].values()
    typed = text.replace("runtime: 45", "runtme: 45")
    lines = typed.split("\n")
    line, start, end = (
        edit["range"]["start"]["line"],
        *(edit["range"][name]["character"] for name in ("start", "end")),
    )
    lines[line] = lines[line][:start] + edit["newText"] + lines[line][end:]
    assert "\n".join(lines) == text

    found = client.ask("textDocument/completion", textDocument=document, position=place(typed, "dock: dock", 6))
    assert "corner_1" in [item["label"] for item in found["items"]]
    target = client.ask("textDocument/definition", textDocument=document, position=place(typed, "dock: dock", 7))
    assert target["uri"] == path.as_uri()
    assert target["range"]["start"] == place(typed, "dock: {x")
    shown = client.ask("textDocument/hover", textDocument=document, position=place(typed, "max_speed: 0.5", 2))
    assert "Largest speed, forwards and backwards." in shown["contents"]["value"]


def test_a_mistake_in_a_mission_is_told_where_it_was_made_although_the_robot_is_not_open(
    client: Client, project: Path
) -> None:
    path = project / "missions/patrol.yaml"
    text = path.read_text("utf-8")
    document = opened(client, path, text.replace("go_to: dock", "go_to: dok"))
    (finding,) = client.diagnostics(path.as_uri())
    assert "no place 'dok'" in finding["message"]
    target = client.ask("textDocument/definition", textDocument=document, position=place(text, "$battery", 3))
    assert target["uri"] == (project / "robots/turtlebot/robot.yaml").as_uri()
    client.tell("textDocument/didClose", textDocument=document)
    assert client.diagnostics(path.as_uri()) == []  # what was saved is right


def test_files_that_change_on_disk_are_checked_again_with_the_robots_that_are_known(
    client: Client, project: Path
) -> None:
    robot, mission = project / ROBOT, project / MISSION
    text = mission.read_text("utf-8")
    opened(client, robot)
    assert client.diagnostics(robot.as_uri()) == []

    def found(sort: int) -> list[str]:
        client.tell("workspace/didChangeWatchedFiles", changes=[{"uri": mission.as_uri(), "type": sort}])
        return [finding["code"] for path in (mission, robot) for finding in client.diagnostics(path.as_uri())]

    mission.write_text(text.replace("go_to: dock", "go_to: dok"), "utf-8")
    assert found(2) == ["RBX4103"]
    mission.unlink()
    assert found(3) == ["RBX1301"]
    mission.write_text(text, "utf-8")
    assert found(1) == []


def test_the_editor_is_asked_for_news_of_what_robots_are_made_of(client: Client) -> None:
    client.ask("textDocument/hover", textDocument={"uri": ROOT.as_uri()}, position=AT)  # the question comes before
    (wanted,) = [one for question in client.questions for one in question["params"].get("registrations", ())]
    assert wanted["method"] == "workspace/didChangeWatchedFiles"
    patterns = [watcher["globPattern"] for watcher in wanted["registerOptions"]["watchers"]]
    assert {"**/*.yaml", "**/*.yml", "**/*.urdf", "**/*.xacro", "**/*.msg", "**/*.pgm"} <= set(patterns)


def test_a_name_is_found_and_renamed_in_the_texts_of_the_editor_and_in_files_that_are_not_open(
    client: Client, project: Path
) -> None:
    path, mission = project / "robots/turtlebot/robot.yaml", project / "missions/patrol.yaml"
    text = path.read_text("utf-8").replace("colour: yellow}", 'colour: "🟡"}  # dock')
    document = opened(client, path, text)
    spot = {"textDocument": document, "position": place(text, "dock: {x", 1)}

    (args, *_, profiles) = client.ask("textDocument/documentSymbol", textDocument=document)
    assert (args["name"], profiles["name"]) == ("args", "profiles")
    assert args["children"][0]["selectionRange"]["start"] == place(text, "speed:")

    found = client.ask("textDocument/references", **spot, context={"includeDeclaration": True})
    assert [entry["uri"] for entry in found].count(mission.as_uri()) == 1
    assert [entry["range"]["start"] for entry in found if entry["uri"] == path.as_uri()] == [
        place(text, "dock: {x"),
        place(text, "dock: dock", 6),
    ]
    asked = client.ask("textDocument/prepareRename", **spot)
    assert asked["placeholder"] == "dock"
    assert asked["range"] == {"start": place(text, "dock: {x"), "end": place(text, "dock: {x", 4)}

    made = client.ask("textDocument/rename", **spot, newName="home")
    assert [entry["newText"] for entry in made["changes"][path.as_uri()]] == ["home", "home"]
    assert mission.as_uri() in made["changes"]

    assert "taken" in client.refusal("textDocument/rename", **spot, newName="corner_1")
    skill = {"textDocument": document, "position": place(text, "type: charger", 8)}
    assert "no name of this project" in client.refusal("textDocument/prepareRename", **skill)


def test_columns_count_in_utf_16_units(client: Client, project: Path) -> None:
    path = project / "robots/turtlebot/robot.yaml"
    text = path.read_text("utf-8").replace("colour: yellow}", 'colour: "🟡🟡", heigt: 3 m}')
    document = opened(client, path, text)
    (finding,) = client.diagnostics(path.as_uri())
    assert finding["range"]["start"] == place(text, "heigt")
    assert finding["range"]["end"] == place(text, "heigt", 5)
    found = client.ask("textDocument/completion", textDocument=document, position=place(text, "heigt", 2))
    assert [item["label"] for item in found["items"]] == []  # all four keys are there


def test_yaml_that_is_none_of_ours_is_left_alone(client: Client, project: Path) -> None:
    path = project / "compose.yaml"
    document = opened(client, path, "services:\n  web: [\n")
    found = client.ask("textDocument/completion", textDocument=document, position={"line": 1, "character": 2})
    assert found["items"] == []
    assert [message for message in client.told if message["params"].get("uri") == path.as_uri()] == []


def test_while_one_types_each_question_is_answered_and_at_rest_the_findings_are_of_the_newest_text(
    client: Client, project: Path, soak: Soak
) -> None:
    path = project / "robots/turtlebot/robot.yaml"
    batteries = "".join(f"  b{n}: {{type: battery_sim, runtime: 45 s}}\n" for n in range(soak.examples(30, 100)))
    text = path.read_text("utf-8").replace("components:\n", f"components:\n{batteries}", 1)
    document = opened(client, path, text)
    client.diagnostics(path.as_uri())
    for strokes in range(1, soak.examples(5, 9)):
        typed = "# x\n" * strokes + text.replace("runtime: 45 s                     #", "runtme: 45 s #", 1)
        changed = {"textDocument": {**document, "version": strokes + 1}, "contentChanges": [{"text": typed}]}
        client.tell("textDocument/didChange", **changed)
        shown = client.ask("textDocument/hover", textDocument=document, position=place(typed, "max_speed: 0.5", 2))
        assert "Largest speed" in shown["contents"]["value"]
    wanted = place(typed, "runtme")
    while not any(entry["range"]["start"] == wanted for entry in client.diagnostics(path.as_uri())):
        pass  # a slow machine may have come to compile an older one
    assert client.ask("textDocument/hover", textDocument=document, position=place(typed, "name: turtle", 2))
    told = [entry["params"] for entry in client.told if entry["method"] == "textDocument/publishDiagnostics"]
    assert [entry for entry in told if entry["uri"] == path.as_uri()] == []


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


@pytest.mark.parametrize("name", [ROBOT, *rare(MISSION)])
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


@pytest.mark.soak  # as a file that is renamed
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
