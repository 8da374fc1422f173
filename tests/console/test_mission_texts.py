"""Texts of missions through the gateway: who may ask for what, and a process that fails."""

from __future__ import annotations

import asyncio
import sys
from typing import Any

import pytest

from rbxcompose.domains.console.access import EDITS, OperationTarget, Role, needed
from rbxcompose.domains.console.editor_process import MOST_WAITING, EditorProcess
from rbxcompose.domains.console.protocol import EditMission
from rbxcompose.tools.mission_editor.editor import REQUESTS
from rbxcompose.tools.robot_editor.editor import LIVE_REQUESTS, ROBOT_REQUESTS
from tests.console.clients import Room

READ = {"mission": "patrol"}
SAVE = {"mission": "patrol", "text": "x", "hash": "h"}
ECHO = 'import sys\nfor line in sys.stdin: print(\'{"answer": \' + line.strip() + \', "refused": ""}\', flush=True)'
DIES = "import sys; sys.stdin.readline()"
SLEEPS = "import time; time.sleep(60)"


def test_a_request_about_a_text_is_passed_on_and_its_answer_comes_back() -> None:
    room = Room()
    client = room.client()
    assert client.does("call_service", service="/console/mission/read", args=READ) == []
    (asked,) = room.asked()
    assert isinstance(asked, EditMission)
    assert asked.request == {"do": "read", "mission": "patrol"}
    room.bridge.robot_answered(asked.number, {"text": "x"})
    (answer,) = client.gets()
    assert answer["values"] == {"success": True, "message": "", "answer": {"text": "x"}}


def test_the_gateway_passes_on_all_that_the_editor_answers_each_with_a_role_of_its_own() -> None:
    assert {name for name in EDITS if name.startswith("mission/")} == {f"mission/{name}" for name in REQUESTS}
    roles = {name: needed(OperationTarget("call_service", f"/console/mission/{name}"), {}) for name in REQUESTS}
    assert {name for name, role in roles.items() if role is Role.CONFIGURE} == {"new", "save", "test_new"}
    assert {name for name, role in roles.items() if role is Role.OPERATE} == {"test", "try"}


def test_who_looks_may_read_and_only_who_configures_may_save() -> None:
    room = Room()
    for role in (Role.VIEW, Role.OPERATE):
        client = room.client(role)
        assert client.does("call_service", service="/console/mission/look", args=SAVE) == []
        assert "needs the role 'configure'" in client.calls("/console/mission/save", SAVE)
    assert room.client().does("call_service", service="/console/mission/save", args=SAVE) == []


@pytest.mark.parametrize(
    ("service", "given", "done"),
    [
        ("/console/mission/save", SAVE, "saves the mission patrol"),
        ("/console/save", {}, "saves all changed parameters"),
        ("/console/save", {"names": ["battery", "base.max_speed"]}, "saves battery, base.max_speed"),
    ],
)
def test_who_saved_what_is_in_the_log_and_shown_to_others_and_nothing_of_dry_runs(
    service: str, given: dict[str, Any], done: str
) -> None:
    room = Room()
    client, other = room.client(who="10.0.0.7"), room.client(Role.VIEW)
    assert other.does("subscribe", topic="/console/windows/changes") == []
    for args, refusal in (({**given, "dry_run": True}, ""), (given, "it was changed meanwhile")):
        client.does("call_service", service=service, args=args)
        room.bridge.robot_answered(room.asked()[-1].number, None, refusal)  # type: ignore[attr-defined]
        assert not room.bridge.notes
        assert other.gets() == []
    client.does("call_service", service=service, args=given)
    client.leaves()
    room.bridge.robot_answered(room.asked()[-1].number, {})  # type: ignore[attr-defined]
    assert list(room.bridge.notes) == [f"10.0.0.7 (configure): {done}"]
    assert other.gets()[0]["msg"] == {"answer": 1}


def test_who_makes_a_mission_is_in_the_log_whatever_else_is_asked() -> None:
    room = Room()
    args = {"mission": "patrol", "template": "empty", "dry_run": True}
    room.client(who="10.0.0.7").does("call_service", service="/console/mission/new", args=args)
    room.bridge.robot_answered(room.asked()[-1].number, {})  # type: ignore[attr-defined]
    assert room.bridge.notes[-1] == "10.0.0.7 (configure): makes the mission patrol"


@pytest.mark.parametrize("where", ["text", "mission"])
@pytest.mark.parametrize("service", ["look", "edit", "save"])
def test_a_text_that_no_file_can_hold_is_refused_at_the_door(service: str, where: str) -> None:
    room = Room()
    args = {**SAVE, "operation": {"text": "x"}} | {where: "a\ud800"}
    assert "half of a pair of surrogates" in room.client().calls(f"/console/mission/{service}", args)
    args = {**SAVE, "operation": {"op": "insert", "\udfff": [{"yaml": "\ud800"}]}}
    assert "half of a pair of surrogates" in room.client().calls(f"/console/mission/{service}", args)
    assert room.asked() == []


@pytest.mark.parametrize("args", [None, {}, {"mission": 7}, {"mission": "patrol", "text": ["x"], "hash": "h"}, [1, 2]])
def test_a_request_without_its_arguments_is_refused(args: Any) -> None:
    room = Room()
    assert "is missing" in room.client().calls("/console/mission/save", args)
    assert room.asked() == []


def exchange(code: str, *requests: dict[str, Any]) -> list[tuple[Any, str]]:
    async def ask() -> list[tuple[Any, str]]:
        process = EditorProcess("robot", (sys.executable, "-c", code), patience=2.0)
        try:
            return await asyncio.gather(*(process.ask(request) for request in requests))
        finally:
            process.close()

    return asyncio.run(ask())


def test_one_process_answers_all_each_what_it_asked() -> None:
    requests = [{"number": number} for number in range(5)]
    assert exchange(ECHO, *requests) == [(request, "") for request in requests]


@pytest.mark.parametrize("code", [DIES, SLEEPS])
def test_a_process_that_fails_is_told_and_started_again(code: str) -> None:
    (first, second) = exchange(code, {}, {})
    assert first == second == (None, "the editor did not answer, and starts again: what runs is unharmed")


def test_too_many_at_once_are_refused() -> None:
    answers = exchange(ECHO, *[{}] * (MOST_WAITING + 3))
    assert [refused for _, refused in answers].count("the editor is busy: try again") == 3


MOVED = {"subject": "places", "changes": [{"op": "remove", "path": ["places", "dock"]}], "hashes": {}}


def test_what_the_robot_is_is_edited_by_the_same_process() -> None:
    room = Room()
    client = room.client(who="10.0.0.7")
    known = {*LIVE_REQUESTS, *(f"robot/{name}" for name in ROBOT_REQUESTS)}
    assert {name for name in EDITS if name.startswith("robot/")} == known
    assert client.does("call_service", service="/console/robot/look", args=MOVED) == []
    (asked,) = room.asked()
    assert isinstance(asked, EditMission)
    assert asked.request == {"do": "robot/look", **MOVED}
    client.does("call_service", service="/console/robot/save", args={**MOVED, "dry_run": True})
    assert not any("saves" in note for note in room.bridge.notes)
    client.does("call_service", service="/console/robot/save", args=MOVED)
    room.bridge.robot_answered(room.asked()[-1].number, {})  # type: ignore[attr-defined]
    assert room.bridge.notes[-1] == "10.0.0.7 (configure): saves places of the robot"


def test_the_robot_that_runs_is_changed_by_who_configures_and_that_is_noted() -> None:
    room = Room()
    client = room.client(who="10.0.0.7")
    assert client.does("call_service", service="/console/robot/compare", args={}) == []
    for name, note in (("apply", "changes the robot to what its files say"), ("revert", "takes back a change of")):
        assert "needs the role 'configure'" in room.client(Role.OPERATE).calls(
            f"/console/robot/{name}", {"generation": 0}
        )
        for refusal in ("the robot has changed meanwhile", ""):
            client.does("call_service", service=f"/console/robot/{name}", args={"generation": 0})
            room.bridge.robot_answered(room.requests[-1].number, {}, refusal)  # type: ignore[attr-defined]
            assert any(note in one for one in room.bridge.notes) == (not refusal)
    asked = [one.request["do"] for one in room.asked() if isinstance(one, EditMission)]
    assert asked == ["robot/compare", *["robot/apply"] * 2, *["robot/revert"] * 2]


def test_only_who_configures_may_change_what_the_robot_is() -> None:
    room = Room()
    for role in (Role.VIEW, Role.OPERATE):
        client = room.client(role)
        assert client.does("call_service", service="/console/robot/look", args=MOVED) == []
        assert "needs the role 'configure'" in client.calls("/console/robot/save", MOVED)


@pytest.mark.parametrize("args", [None, {}, {"subject": 7, "changes": [], "hashes": {}}, {"subject": "places"}])
def test_changes_without_what_they_need_are_refused(args: Any) -> None:
    room = Room()
    assert "is missing" in room.client().calls("/console/robot/save", args)
    assert room.asked() == []
