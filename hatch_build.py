"""A step of the build of wheels: the stubs of message classes, which are not committed."""

from __future__ import annotations

import sys
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class StubsHook(BuildHookInterface[Any]):
    """Writes the stubs and adds them to the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Do so before the files are collected."""
        sys.path.insert(0, self.root)
        from rbxcompose.msgs.generate import main

        main()
        build_data["artifacts"].append("/rbxcompose/msgs/*.pyi")
