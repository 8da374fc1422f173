"""A client checks, explains, tests and tries what is in a project, and can do nothing else."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.commands.main import main as command
from rbxcompose.domains.console.access import Role
from rbxcompose.tools.commands import mcp
from rbxcompose.tools.mcp.server import MOST_CHARACTERS
from tests.conftest import ROOT
from tests.forked import Forked
from tests.loops import for_all
from tests.mcp.tool_client import ToolClient, connected, served
from tests.patrol_project import MISSION, ROBOT, TEST, changed, write_project

WRONG = "robots/wrong/robot.yaml"
VIEWS = {"check", "explain", "why", "plan", "test", "dry_run", "state", "story"}
OPERATES = {"mission_run", "mission_pause", "mission_resume", "mission_cancel", "stop", "release"}


def tree(folder: Path) -> dict[str, str]:
    """Return all that is in a folder, with hashes of files."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "folder"
        for path in sorted(folder.rglob("*"))
    }


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("mcp")


@pytest.fixture(scope="module")
def project(base: Path) -> Path:
    """A project with a robot that is fine and one with a mistake, and links to what is beside it."""
    folder = base / "project"
    write_project(folder)
    (folder / WRONG).parent.mkdir()
    (folder / WRONG).write_text(changed(folder, ROBOT, "reach: 20 cm", "rech: 20 cm")[ROBOT], encoding="utf-8")
    write_project(base / "other")
    (folder / "passwd.yaml").symlink_to("/etc/passwd")
    (folder / "away").symlink_to(base / "other")
    (folder / "linked/robots").mkdir(parents=True)
    (folder / "linked/robots/one.yaml").symlink_to(base / "other" / ROBOT)
    (folder / "linked/missions").mkdir()
    (folder / "linked/missions/twice.test.yaml").symlink_to(base / "other" / TEST)
    return folder


@pytest.fixture(scope="module")
def environment(base: Path) -> dict[str, str]:
    (base / "run").mkdir(mode=0o700)
    return {"XDG_STATE_HOME": str(base / "state"), "XDG_RUNTIME_DIR": str(base / "run")}


@pytest.fixture(scope="module")
def client(project: Path, base: Path, environment: dict[str, str]) -> Iterator[ToolClient]:
    """A client; after all tests, nothing has changed in the project, and each call is in the log."""
    before = tree(project)
    with connected(project, environment) as made:
        yield made
    assert tree(project) == before
    assert [path.name for path in (base / "state/rbxcompose").iterdir()] == ["mcp.jsonl"]
    assert sorted(call["tool"] for call in logged(base)) == sorted(made.called)


def logged(base: Path, state: str = "state") -> list[dict[str, Any]]:
    lines = (base / state / "rbxcompose/mcp.jsonl").read_text(encoding="utf-8").splitlines()
    return [json.loads(line) for line in lines]


def test_a_mistake_is_found_explained_and_mended_in_an_unsaved_text(client: ToolClient, project: Path) -> None:
    found = client.told("check", paths=[WRONG])
    assert (found["is_fine"], found["errors"]) == (False, len(found["findings"]))
    finding = found["findings"][0]
    place = {key: finding[key] for key in ("code", "severity", "file", "help")}
    assert place == {"code": "RBX1001", "severity": "error", "file": WRONG, "help": "did you mean 'reach'?"}
    edit = finding["fix"]["edits"][0]
    assert (edit["line"], edit["column"]) == (finding["line"], finding["column"])
    assert "Every map has a fixed set of keys" in client.told("explain", code=finding["code"])["text"]
    mended = changed(project, WRONG, edit["old"], edit["text"])
    assert client.told("check", paths=[WRONG], unsaved=mended)["is_fine"]
    assert "did you mean 'reach'?" in client.refusal("plan", robot=WRONG)


def test_values_are_those_of_the_unsaved_texts(client: ToolClient, project: Path) -> None:
    slower = changed(project, ROBOT, "45 s", "50 s")
    why = client.told("why", value="battery.runtime", robot="robots/turtlebot", unsaved=slower)
    assert (why["value"], why["layers"][0]["file"]) == ("50 s", ROBOT)


def test_missions_are_tested_and_tried_with_unsaved_texts(client: ToolClient, project: Path) -> None:
    told = client.told("test")
    assert (told["passed"], told["failed"]) == (1, 0)
    four = changed(project, MISSION, "default: 2", "default: 4")
    told = client.told("test", paths=[TEST], unsaved=four)
    assert (told["failed"], told["tests"][0]["trace"][0]["text"]) == (1, "go_to corner_1")
    tried = client.told("dry_run", mission="patrol", robot=ROBOT, unsaved=four)
    assert (tried["outcome"], tried["story"][0]["text"]) == ("success", "1.1.1 Go to the corner: go_to corner_1")
    assert tried["time"] > 80.0


@pytest.mark.soak  # as `plan` tells what is wrong
def test_a_mission_that_is_not_there_is_not_tried(client: ToolClient) -> None:
    assert "did you mean 'patrol'?" in client.refusal("dry_run", mission="patrl", robot=ROBOT)


@for_all(
    "path, told",
    [
        ("/etc/passwd", "'/etc/passwd' is outside the project"),
        ("../other/robots/turtlebot", "'../other/robots/turtlebot' is outside the project"),
        ("robots/../../other", "is outside the project"),
        ("passwd.yaml", "'passwd.yaml' leads through a link out of the project"),
        ("away/robots/turtlebot", "leads through a link out of the project"),
        ("rbx:../../etc/passwd", "is outside the library"),
        ("nowhere.yaml", "'nowhere.yaml' does not exist"),
        ("a\0b", "is not a path"),
    ],
)
def test_what_is_outside_the_project_is_refused(client: ToolClient, path: str, told: str) -> None:
    assert told in client.refusal("plan", robot=path)
    if not path.startswith("rbx:"):
        assert told in client.refusal("check", paths=[path])
        assert told in client.refusal("test", paths=[path])
        assert told in client.refusal("check", unsaved={path: ""})


def test_what_a_folder_or_a_text_names_outside_is_refused(client: ToolClient, project: Path) -> None:
    assert "other/robots/turtlebot/robot.yaml' is outside" in client.refusal("check", paths=["linked"])
    assert "other/missions/tests/twice.test.yaml' is outside" in client.refusal("test", paths=["linked"])
    reads = changed(project, ROBOT, "../../missions/patrol.yaml", "../../passwd.yaml")
    told = client.told("check", paths=[ROBOT], unsaved=reads)
    assert [finding["code"] for finding in told["findings"]] == ["RBX1306"]


@for_all(
    "tool, given, told",
    [
        ("check", {"path": "x"}, "path: "),
        ("check", {"paths": 3}, "paths: "),
        ("check", {"paths": ["--fix"]}, "'--fix' does not exist"),
        ("check", {"profiles": ["--fix"]}, "profiles.0: "),
        ("explain", {}, "code: "),
        ("explain", {"code": "RBX0"}, "there is no code"),
        ("why", {"value": "--help"}, "value: "),
        ("why", {"value": "/etc/passwd"}, "value: "),
        ("dry_run", {"mission": "patrol"}, "several robots"),
        ("story", {"lines": 10**9}, "lines: "),
        ("state", {"robot": "systems/x.yaml"}, "robot: "),
        ("state", {}, "no robot is up"),
        ("nothing", {}, "there is no tool 'nothing'"),
    ],
)
def test_wrong_arguments_are_told(client: ToolClient, tool: str, given: dict[str, Any], told: str) -> None:
    assert told in client.refusal(tool, **given)


def test_who_may_only_look_neither_sees_nor_reaches_what_operates(client: ToolClient) -> None:
    assert set(client.tools()) == VIEWS
    for tool in OPERATES:
        assert f"'{tool}' needs the role 'operate'" in client.refusal(tool)


def test_each_tool_describes_its_arguments(client: ToolClient) -> None:
    for schema in client.tools().values():
        assert all(field["description"] for field in schema["properties"].values())


def test_the_language_the_findings_and_the_manifests_are_resources(client: ToolClient, project: Path) -> None:
    assert {"rbxcompose://language", f"rbxcompose://project/{ROBOT}"} <= set(client.resources())
    assert client.read("rbxcompose://language").startswith("# ")
    assert client.read("rbxcompose://findings/RBX1001").startswith("# RBX1001: Unknown key")
    assert client.read(f"rbxcompose://project/{ROBOT}") == (project / ROBOT).read_text(encoding="utf-8")
    for uri in ("rbxcompose://findings/../language", "rbxcompose://project/passwd.yaml", "file:///etc/passwd"):
        assert client.read(uri) == f"there is no resource '{uri}'"


@pytest.mark.soak  # how is tested without a server
def test_an_answer_is_limited_and_says_what_is_left_out(client: ToolClient, project: Path) -> None:
    wrong = "".join(f"wrong_{number}_{'x' * 100}: 1\n" for number in range(300))
    told = client.told("check", paths=[ROBOT], unsaved=changed(project, ROBOT, "start: patrol\n", wrong))
    assert len(json.dumps(told, ensure_ascii=False)) <= MOST_CHARACTERS
    shown, whole = len(told["findings"]), told["errors"]
    assert f"findings: {whole - shown} of {whole} items" in told["left_out"]


@pytest.mark.soak  # what waits for what is tested without a server
def test_many_calls_at_once_are_all_answered(client: ToolClient) -> None:
    assert client.at_once(3, "explain", code="RBX1001") == [False] * 3


def test_a_server_of_its_own_runs_verbs_in_processes_and_ends_and_logs_what_its_client_cancels(
    project: Path, environment: dict[str, str], tmp_path: Path
) -> None:
    before = tree(project)
    with served(project, {**environment, "XDG_STATE_HOME": str(tmp_path)}) as client:
        assert set(client.tools()) == VIEWS
        assert "timed out" in client.gives_up("plan", robot=ROBOT)
        [finding] = client.told("check", paths=[WRONG], unsaved={})["findings"]
        assert finding["help"] == "did you mean 'reach'?"
        assert "is outside the project" in client.refusal("check", paths=["/etc/passwd"])
    assert tree(project) == before
    told = [(call["tool"], call["result"].partition(":")[0]) for call in logged(tmp_path, "")]
    assert told == [("plan", "was cancelled"), ("check", "ok"), ("check", "refused")]


@pytest.mark.parametrize(("words", "role"), [([], Role.VIEW), (["--operate"], Role.OPERATE)])
def test_who_starts_it_says_whether_a_client_may_operate(
    words: list[str], role: Role, project: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rbxcompose.tools.mcp import server

    given: list[Role] = []

    async def serve(role: Role, deadline: float, log: object) -> None:
        given.append(role)

    monkeypatch.setattr(server, "serve", serve)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert command(["mcp", str(project), *words]) == 0
    assert given == [role]


def test_a_call_is_logged_without_the_texts(client: ToolClient, project: Path, base: Path) -> None:
    text = (project / ROBOT).read_text(encoding="utf-8")
    client.told("check", paths=[ROBOT], unsaved={ROBOT: text})
    client.refusal("check", paths=["/etc/passwd"])
    *_, fine, refused = logged(base)
    assert (fine["tool"], fine["result"], fine["project"]) == ("check", "ok", str(project))
    assert fine["arguments"] == {"paths": f'["{ROBOT}"]', "unsaved": {ROBOT: f"{len(text):,} characters"}}
    assert fine["time"].endswith("+00:00")
    assert refused["result"].startswith("refused: '/etc/passwd' is outside the project")
    assert (base / "state/rbxcompose/mcp.jsonl").stat().st_mode & 0o077 == 0


def test_whatever_comes_in_and_however_long_it_takes_the_server_goes_on_and_only_the_protocol_goes_out(
    project: Path, environment: dict[str, str], tmp_path: Path
) -> None:
    begin = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "a\nb", "version": "1"}}
    requests = [
        ("initialize", begin),
        ("tools/call", {"name": 3}),
        ("tools/call", {"name": "stop\nx"}),
        ("tools/call", {"name": "check"}),
        ("tools/list", {}),
    ]
    lines = ["nonsense", "[1, 2]", json.dumps({"jsonrpc": "2.0", "method": "notifications/initialized"})]
    for number, (method, given) in enumerate(requests):
        lines.append(json.dumps({"jsonrpc": "2.0", "id": number, "method": method, "params": given}))
    words = [sys.executable, "-m", "rbxcompose", "mcp", str(project), "--deadline", "10 ms"]
    whole = {**os.environ, "PYTHONPATH": str(ROOT), **environment, "XDG_STATE_HOME": str(tmp_path)}
    with Forked(
        words, env=whole, cwd="/", stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdin
        assert process.stdout
        process.stdin.write("".join(f"{line}\n" for line in lines))
        process.stdin.flush()
        answers: dict[int, Any] = {}
        while len(answers) < len(requests):
            answer = json.loads(process.stdout.readline())
            answers[answer["id"]] = answer
        process.stdin.close()
        assert process.stdout.read() == ""
        assert process.wait(10.0) == 0
    assert answers[0]["result"]["serverInfo"]["name"] == "rbxcompose"
    assert "error" in answers[1]
    assert answers[2]["result"]["isError"]
    late = answers[3]["result"]["structuredContent"]["error"]
    assert late == "it took more than 0.01 s, and was ended"
    assert {tool["name"] for tool in answers[4]["result"]["tools"]} == VIEWS
    audited = (tmp_path / "rbxcompose/mcp.jsonl").read_text(encoding="utf-8").splitlines()
    assert {json.loads(line)["client"] for line in audited} == {"mcp, a\\nb"}


def test_a_folder_that_is_no_project_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["mcp", str(tmp_path)]) == 2
    assert "is no project: it has neither 'robots/' nor 'missions/' nor 'robot.yaml'" in capsys.readouterr().err


def test_without_a_place_for_its_log_it_does_not_serve(
    project: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rbxcompose").write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert command(["mcp", str(project)]) == 2
    assert "calls cannot be logged" in capsys.readouterr().err


def test_without_its_package_the_command_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mcp, "find_spec", lambda name: None)
    assert command(["mcp"]) == 1
    said = capsys.readouterr().err
    assert "error[RBX9010]" in said
    assert "pip install 'rbxcompose[mcp]'" in said
