"""Compiles the newest texts in a thread of its own, while the editor gets answers from the last compilation."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rbxcompose.lsp.project import FoundByFile, OutdatedError, Project
from rbxcompose.schema.documents import MAKERS, installed_schema

PAUSE = 0.1  # [s] without a keystroke before robots are compiled again


class Newest:
    """The project as last compiled, and the texts that have changed since.

    A thread works on a copy of the project, which replaces the project when it is done. A text that arrives meanwhile
    makes the copy outdated: it stops at the next robot, and the work starts again with all texts. So what is `told`
    always comes from the newest texts. All methods belong to the thread of the event loop.
    """

    def __init__(self, project: Project, told: Callable[[FoundByFile], None]) -> None:
        self.project = project
        self._told = told
        self._waiting: dict[Path, str | None] = {}
        self._number = 0  # count of changes so far
        self._due = 0.0  # in loop time
        self._task: asyncio.Task[None] | None = None
        self._thread = ThreadPoolExecutor(1, "compile")

    def prepare(self) -> None:
        """Load what the first answer needs, in the thread."""
        for kind in MAKERS:
            self._thread.submit(installed_schema, kind)

    def has(self, path: Path) -> bool:
        """Return whether the editor's text of a file replaces the saved one."""
        return self._waiting.get(path) is not None or (path in self.project.unsaved and path not in self._waiting)

    def text(self, path: Path) -> str:
        """Return the newest text of a file."""
        return waiting if (waiting := self._waiting.get(path)) is not None else self.project.text(path)

    @property
    def unsaved(self) -> dict[Path, str]:
        """Return the newest texts that are in the editor only."""
        there = {**self.project.unsaved, **self._waiting}
        return {path: text for path, text in there.items() if text is not None}

    def is_compiled(self, path: Path, text: str) -> bool:
        """Return whether the project was compiled with this text of a file."""
        return not self._waiting and self.project.text(path) == text

    def change(self, path: Path, text: str | None, pause: float = 0.0) -> None:
        """Take a new text (None: the saved one counts again) and compile it after a pause [s]."""
        self._waiting[path] = text
        self._number += 1
        loop = asyncio.get_running_loop()
        self._due = loop.time() + pause
        if self._task is None or self._task.done():
            self._task = loop.create_task(self._work())

    def close(self) -> None:
        """Stop the thread; its current work becomes outdated."""
        self._number += 1
        self._waiting.clear()
        self._thread.shutdown(wait=False, cancel_futures=True)

    async def _work(self) -> None:
        loop = asyncio.get_running_loop()
        while self._waiting:
            if (pause := self._due - loop.time()) > 0:
                await asyncio.sleep(pause)
                continue
            number, texts = self._number, dict(self._waiting)
            project = self._copy(number)
            try:
                found = await loop.run_in_executor(self._thread, project.change_all, texts)
            except OutdatedError:
                continue
            if number == self._number:
                self.project = project
                self._waiting.clear()
                self._told(found)

    def _copy(self, number: int) -> Project:
        """Return a copy of the project that becomes outdated with the first change after `number`."""
        return self.project.copy(lambda: number != self._number)
