"""A step of the build of wheels: what is not committed, the stubs of message classes and the console's page."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class GeneratedFilesHook(BuildHookInterface[Any]):
    """Writes the stubs and the page and adds them to the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Do so before the files are collected."""
        sys.path.insert(0, self.root)
        from rbxcompose.msgs.generate import main

        main()
        build_data["artifacts"].append("/rbxcompose/msgs/*.pyi")
        if version != "editable":
            self._build_page()
            build_data["artifacts"].append("/rbxcompose/domains/console/static/**")

    def _build_page(self) -> None:
        console = runpy.run_path(str(Path(self.root, "console", "build.py")))
        try:
            console["build"]()
        except console["CannotBuildError"] as error:
            self.app.display_warning(f"The wheel has no console: {error}")
