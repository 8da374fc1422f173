"""The start of a command."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measuring import BARE, COMMAND, Row, Samples, in_turns, program
from tests.conftest import ROOT
from tests.lsp.client import Client

MEASURES = ("rbxcompose/commands", "rbxcompose/compiler", "rbxcompose/tools")
EDITORS = 10  # that start the language server, one after the other


def served() -> tuple[Samples, Samples]:
    """Return the times until the language server answers `initialize`, and until it has looked at a robot [s]."""
    ready, looked = [], []
    with TemporaryDirectory() as folder:
        path = Path(folder).resolve() / "robots/turtlebot/robot.yaml"
        shutil.copytree(ROOT / "robots/turtlebot", path.parent)
        shutil.copytree(ROOT / "missions", Path(folder, "missions"))
        document = {"uri": path.as_uri(), "languageId": "yaml", "version": 1, "text": path.read_text("utf-8")}
        for _ in range(EDITORS):
            start = time.perf_counter()
            with Client(Path(folder)) as client:
                ready.append(time.perf_counter() - start)
                client.tell("textDocument/didOpen", textDocument=document)
                client.diagnostics(path.as_uri())
                looked.append(time.perf_counter() - start)
    return Samples(tuple(ready)), Samples(tuple(looked))


def rows() -> list[Row]:
    """Return the time until help is there, until robots are checked, and until an editor is answered."""
    shown, checked, armed, bare = in_turns(
        program([*COMMAND, "--help"]),
        program([*COMMAND, "check", "robots/turtlebot"]),
        program([*COMMAND, "check", "robots/pi_robot"]),
        program(BARE),
        rounds=15,
        clock=time.perf_counter,
    )
    ready, looked = served()
    return [
        Row(
            name="`--help`",
            unit="ms",
            how="from start to exit, beside `python -c pass`",
            ours=shown.median * 1e3,
            p99=shown.p99 * 1e3,
            peer=bare.median * 1e3,
            against="python -c pass",
            most_ratio=5,
        ),
        Row(
            name="`check robots/turtlebot`",
            unit="ms",
            how="from start to exit",
            ours=checked.median * 1e3,
            p99=checked.p99 * 1e3,
            peer=bare.median * 1e3,
            against="python -c pass",
            most_ratio=10,
        ),
        Row(
            name="`check robots/pi_robot`",
            unit="ms",
            how="from start to exit; a robot with an arm, and its profiles",
            ours=armed.median * 1e3,
            p99=armed.p99 * 1e3,
            peer=bare.median * 1e3,
            against="python -c pass",
            most_ratio=25,
        ),
        Row(
            name="`lsp`: start",
            unit="ms",
            how="until `initialize` is answered",
            ours=ready.median * 1e3,
            p99=ready.p99 * 1e3,
            most=1000,
        ),
        Row(
            name="`lsp`: first findings",
            unit="ms",
            how="from its start, of `robots/turtlebot`",
            ours=looked.median * 1e3,
            p99=looked.p99 * 1e3,
        ),
    ]
