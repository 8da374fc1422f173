"""What is told is always of the newest texts; what was compiled last answers meanwhile."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.findings import Finding
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.tools.lsp.project import FoundByFile, Newest, OutdatedError, Project

TEXT = "rbx: 1\nkind: Robot\nname: one\ncomponents:\n  battery:\n    type: battery_sim\n    runtime: 45 s\n"
WRONG = TEXT + "    wran: 50 %\n"


class Editor:
    """A project of one robot whose compilations wait for leave, and what was told of it."""

    loop: asyncio.AbstractEventLoop
    news: asyncio.Event

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.path = folder / "robot.yaml"
        self.path.write_text(TEXT, encoding="utf-8")
        self.begun: list[str] = []
        self.leave = threading.Semaphore(0)
        self.told: list[list[Finding]] = []

        def waits(*args: Any, unsaved: dict[Path, str], **options: Any) -> Any:
            self.begun.append(unsaved.get(self.path, "saved"))
            self.loop.call_soon_threadsafe(self.news.set)
            assert self.leave.acquire(timeout=10.0)
            return compile_robot(*args, unsaved=unsaved, **options)

        monkeypatch.setattr("rbxcompose.tools.lsp.project.compile_robot", waits)

    def tell(self, found: FoundByFile) -> None:
        self.told.append(found[self.path])
        self.news.set()

    async def until(self, is_so: Callable[[], bool]) -> None:
        async with asyncio.timeout(10.0):
            while not is_so():
                await self.news.wait()
                self.news.clear()

    def run(self, session: Callable[[Newest], Awaitable[None]]) -> None:
        async def whole() -> None:
            self.loop, self.news = asyncio.get_running_loop(), asyncio.Event()
            newest = Newest(Project({}), self.tell)
            try:
                await session(newest)
            finally:
                self.leave.release(100)
                newest.close()

        asyncio.run(whole())


@pytest.fixture
def editor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Editor:
    return Editor(tmp_path, monkeypatch)


def test_what_was_compiled_last_answers_while_the_next_is_being_compiled(editor: Editor) -> None:
    async def session(newest: Newest) -> None:
        newest.change(editor.path, TEXT)
        editor.leave.release()
        await editor.until(lambda: len(editor.told) == 1)
        newest.change(editor.path, WRONG)
        await editor.until(lambda: len(editor.begun) == 2)
        robot = newest.project.robot_of(editor.path)
        assert robot is not None
        assert not newest.is_compiled(editor.path, WRONG)
        assert newest.project.text(editor.path) == TEXT
        editor.leave.release()
        await editor.until(lambda: len(editor.told) == 2)
        assert newest.is_compiled(editor.path, WRONG)

    editor.run(session)
    assert [[finding.code for finding in found] for found in editor.told] == [[], ["RBX1001"]]


def test_a_text_that_is_outdated_when_it_is_compiled_is_never_told_of(editor: Editor) -> None:
    async def session(newest: Newest) -> None:
        newest.change(editor.path, WRONG)
        await editor.until(lambda: len(editor.begun) == 1)
        newest.change(editor.path, TEXT + "#")
        newest.change(editor.path, TEXT)
        editor.leave.release(2)
        await editor.until(lambda: len(editor.told) == 1)

    editor.run(session)
    assert editor.begun == [WRONG, TEXT]
    assert editor.told == [[]]


def test_an_outdated_project_ends_before_the_next_robot(editor: Editor) -> None:
    project = Project({}).copy(lambda: True)
    with pytest.raises(OutdatedError):
        project.change_all({editor.path: TEXT})
    assert editor.begun == []


def test_many_key_strokes_are_compiled_once(editor: Editor) -> None:
    async def session(newest: Newest) -> None:
        for count in range(50):
            newest.change(editor.path, TEXT + "\n" * count, pause=0.01)
        editor.leave.release()
        await editor.until(lambda: len(editor.told) == 1)

    editor.run(session)
    assert editor.begun == [TEXT + "\n" * 49]


def test_a_file_that_is_closed_counts_as_it_is_saved(editor: Editor) -> None:
    async def session(newest: Newest) -> None:
        newest.change(editor.path, WRONG)
        assert newest.has(editor.path)
        newest.change(editor.path, None)
        assert not newest.has(editor.path)
        editor.leave.release()
        await editor.until(lambda: len(editor.told) == 1)

    editor.run(session)
    assert editor.begun == ["saved"]
    assert editor.told == [[]]
