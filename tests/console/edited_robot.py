"""A robot on disk, and the real editor of it behind a gateway."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rbxcompose.base.requests import Refused
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.console.models import CandidateModels
from rbxcompose.tools.robot_editor.editor import ROBOT_REQUESTS, RobotEditor
from tests.console.fake_gateway import CONFIG, FakeGateway


class LiveText:
    """A robot that runs with a text, and what a page asks about it; `text` is what is saved."""

    def __init__(self, gateway: FakeGateway, text: Callable[[], str]) -> None:
        self.text, self.runs_with = text, text()
        self.why_not = ""  # why it cannot be changed now
        for name, what in (("compare", self.compare), ("apply", self.apply), ("revert", self.revert)):
            gateway.answers[f"/console/robot/{name}"] = what

    def compare(self, given: dict[str, Any]) -> dict[str, Any]:
        reasons = [{"key": "places.dock.x", "before": "0 m", "after": "0.5 m"}]
        mission = {"name": "mission", "fate": "changed live", "reasons": reasons}
        is_same = self.runs_with == self.text()
        answer = {
            "generation": 3,
            "is_empty": is_same,
            "why_not": "" if is_same else self.why_not,
            "components": [] if is_same else [mission],
            "said": [] if is_same else ["mission patrol goes on where it is"],
        }
        return {"success": True, "message": "", "answer": answer}

    def apply(self, given: dict[str, Any]) -> dict[str, Any]:
        assert given == {"generation": 3}
        self.before, self.runs_with = self.runs_with, self.text()
        return {"success": True, "message": "", "answer": {"text": "mission changed live", "generation": 3}}

    def revert(self, given: dict[str, Any]) -> dict[str, Any]:
        self.runs_with = self.before
        return {"success": True, "message": "", "answer": {"text": "mission changed live"}}


class EditedProject:
    """A project with a robot, which a page edits; `others` are further files by their names in it."""

    def __init__(self, gateway: FakeGateway, folder: Path, robot: str, others: dict[str, str]) -> None:
        self.gateway, self.folder, self.robot = gateway, folder, folder / "robots/fetcher/robot.yaml"
        for file, text in {"robots/fetcher/robot.yaml": robot, **others}.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_text(text, encoding="utf-8")
        self.editor = RobotEditor(self.compiled, self.robot)
        self.models = CandidateModels()
        self.loses_saves = False  # the connection breaks after a save was done
        gateway.config = {**CONFIG, **gateway.config, "role": "configure"}
        for name in ROBOT_REQUESTS:
            gateway.answers[f"/console/robot/{name}"] = self._answering(name)
        self.live = LiveText(gateway, self.text)

    def compiled(self, unsaved: Any) -> Any:
        return compile_robot(str(self.robot), environment=os.environ, unsaved=unsaved)

    def text(self, file: str = "robots/fetcher/robot.yaml") -> str:
        return (self.folder / file).read_text(encoding="utf-8")

    def _answering(self, name: str) -> Any:
        def answer(given: dict[str, Any]) -> dict[str, Any]:
            try:
                found = self.editor.answer({"do": f"robot/{name}", **given})
                if isinstance(found, dict) and "model" in found:
                    found["model"] = self.models.add(found["model"]["urdf"], found["model"]["meshes"])
                told = {"success": True, "message": "", "answer": found}
            except Refused as refusal:
                told = {"success": False, "message": str(refusal), "answer": None}
            if self.loses_saves and name == "save" and "dry_run" not in given:
                self.loses_saves = False
                self.gateway.drop()
            return told

        return answer
