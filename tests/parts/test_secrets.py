"""Secrets: who may read them, where they may stand, and that nothing ever shows them."""

from __future__ import annotations

import json
import logging
import pickle
from pathlib import Path

import pytest

from rbxcompose.base.config import Secret
from rbxcompose.commands.formats import format_names
from rbxcompose.commands.main import main
from rbxcompose.compiler.composition.dump import dump_robot
from rbxcompose.msgs.std_msgs import String
from rbxcompose.sdk import Component, Config, Out, component, registry
from rbxcompose.testing.bench import run_robot
from tests.parts.project import Project

PLANTED = "correct-horse-battery"
ROBOT = 'components:\n  cloud: {type: cloud, token: "${secret.token}"}\n'
TOUR = "rbx: 1\nkind: Mission\nname: tour\ndo:\n  wait: 1 s\n"


class CloudConfig(Config):
    """Who we are."""

    token: Secret
    """What the cloud asks for."""
    name: str = ""
    """How the cloud calls us."""


@pytest.fixture(autouse=True)
def _cloud(monkeypatch: pytest.MonkeyPatch) -> None:
    registry.usable_names()  # types that are imported later would be forgotten together with this one
    monkeypatch.setattr(registry, "_TYPES", dict(registry._TYPES))

    @component("cloud")
    class Cloud(Component[CloudConfig]):
        """Speaks with the cloud."""

        said = Out(String, "said")

        def activate(self) -> None:
            self.info(f"{self.config} {self.config.token} {self.config.token!r}")
            self.said(String(data=str(len(self.config.token.reveal()))))


def plant(project: Project, mode: int = 0o600, text: str = PLANTED + "\n") -> Path:
    path = project.folder / "secrets/token"
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    path.chmod(mode)
    return path


def token(project: Project, name: str = "cloud") -> str:
    config = project.manifest.components[name].config
    assert isinstance(config, CloudConfig)
    return config.token.reveal()


def test_a_secret_is_the_text_of_its_file(project: Project) -> None:
    plant(project)
    project.check(ROBOT)
    assert token(project) == PLANTED


def test_the_environment_comes_before_the_file(project: Project) -> None:
    project.check(ROBOT, environment={"RBX_SECRET_TOKEN": "other"})
    assert token(project) == "other"


def test_a_secret_reaches_a_part_through_its_argument(project: Project) -> None:
    plant(project)
    part = 'args: {token: {type: text}}\ncomponents:\n  link: {type: cloud, token: "${args.token}"}\n'
    robot = 'include:\n  net: {part: ../../parts/net.yaml, with: {token: "${secret.token}"}}\n'
    project.check(robot, {"net": part})
    assert token(project, "net_link") == PLANTED


@pytest.mark.parametrize(
    ("mode", "message"),
    [
        (0o640, "others may read the secret in 'secrets/token'"),
        (0o604, "others may read"),
        (None, "the secret 'token'"),
    ],
)
def test_a_secret_that_is_missing_or_open_is_a_finding(project: Project, mode: int | None, message: str) -> None:
    if mode is not None:
        plant(project, mode)
    project.check(ROBOT)
    (finding,) = project.findings
    assert (finding.code, finding.message.startswith(message)) == ("RBX1207", True)
    assert str(finding.span) == "robots/one/robot.yaml:5:32"


def test_a_link_and_a_folder_are_no_secrets(project: Project) -> None:
    path = plant(project)
    path.symlink_to(path.rename(path.with_name("other")))
    project.check(ROBOT)
    assert [finding.code for finding in project.findings] == ["RBX1207"]
    path.unlink()
    path.mkdir()
    project.check(ROBOT)
    assert [finding.code for finding in project.findings] == ["RBX1207"]


TEXT_ARGUMENT = 'args: {t: {type: text, default: "${secret.token}"}}\n'
WRONG = [
    ('about: "speaks with ${secret.token}"\n', "RBX1208"),
    ("about: ${secret.token}\n", "RBX1208"),
    ("about: ${env.RBX_SECRET_TOKEN}\n", "RBX1208"),
    ('components:\n  cloud: {type: cloud, token: "x${secret.token}"}\n', "RBX1208"),
    ("components:\n  cloud: {type: cloud, token: abc}\n", "RBX1004"),
    (ROBOT.replace("}\n", ', name: "${secret.token}"}\n'), "RBX1003"),
    (TEXT_ARGUMENT + 'about: "a ${args.t}"\n', "RBX1208"),
    (TEXT_ARGUMENT + 'about: "${args.t == args.t}"\n', "RBX1208"),
    ('args: {t: {type: count, default: "${secret.token}"}}\n', "RBX1003"),
    ('missions: {tour: {file: ../../tour.yaml, with: {text: "${secret.token}"}}}\n', "RBX1208"),
    ("missions: {tour: ../../leak.yaml}\n", "RBX1208"),
    ('places: {dock: {x: "${secret.token}", y: 0 m}}\n', "RBX1003"),
    ('bus: {domain: "${secret.token}", namespace: "${secret.token}"}\n', "RBX1003"),
    ('start: "${secret.token}"\n', "RBX1003"),
    ('values: {a: "${secret.token}"}\n', "RBX1003"),
    ('components:\n  cloud: {type: cloud, token: "${secret.token}", process: "${secret.token}"}\n', "RBX1003"),
]


@pytest.mark.parametrize(("robot", "code"), WRONG, ids=[case[0][:50] for case in WRONG])
def test_a_secret_stands_nowhere_else_and_no_output_shows_it(
    project: Project, robot: str, code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    plant(project)
    header = "rbx: 1\nkind: Mission\nname: tour\n"
    files = {
        "tour.yaml": header + "inputs: {text: {type: text}}\ndo:\n  log: $text\n",
        "leak.yaml": header + 'do:\n  log: "${secret.token}"\n',
    }
    project.check(robot, files=files)
    assert code in [finding.code for finding in project.findings], project.text
    shown = project.text + dump_robot(project.manifest)
    for form in format_names():
        main(["check", "robots/one", "--format", form])
        told = capsys.readouterr()
        shown += told.out + told.err
    assert PLANTED not in shown


def test_a_robot_that_runs_shows_it_nowhere(project: Project, caplog: pytest.LogCaptureFixture) -> None:
    plant(project)
    caplog.set_level(logging.DEBUG)
    out = project.check(ROBOT + "missions: {tour: ../../tour.yaml}\nstart: tour\n", files={"tour.yaml": TOUR})
    ran = run_robot(out.plan)
    assert ran.outcome == "success"
    assert "***" in ran.log
    config = project.manifest.components["cloud"].config
    assert config
    shown = [repr(out), str(out.plan), ran.log, caplog.text, config.model_dump_json(), repr(config.model_dump())]
    shown += [repr(project.manifest), dump_robot(project.manifest), json.dumps(config.model_json_schema())]
    assert [text for text in shown if PLANTED in text] == []


def test_a_dump_with_a_secret_is_the_same_robot_when_it_is_read_again(project: Project) -> None:
    plant(project)
    project.check(ROBOT)
    text = dump_robot(project.manifest)
    assert "token: ${secret.token}\n" in text
    project.check(text.split("name: one\n", 1)[1])
    assert token(project) == PLANTED


def test_a_secret_says_three_stars_and_keeps_its_text_between_processes() -> None:
    secret = Secret(PLANTED, "token")
    assert (str(secret), repr(secret), f"{secret}") == ("***", "***", "***")
    assert pickle.loads(pickle.dumps(secret)) == secret
