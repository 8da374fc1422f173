"""Everything that writes files, each with what must hold when a call of the system has failed.

A writer is prepared in an empty folder, writes, and is judged: nothing is torn, nothing old is lost, and it was told.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from rbxcompose.base.clock import SteppedClock
from rbxcompose.base.files import replace_file
from rbxcompose.base.levels import Level
from rbxcompose.commands import main as command
from rbxcompose.commands.new_files import write_new
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime.folder import ComponentState, RobotFolder, RobotState
from rbxcompose.runtime.log import NAME, PREVIOUS, LogFile, Record, start_new
from rbxcompose.runtime.process_group.group import Taping
from rbxcompose.runtime.processes import Process, boot_id
from rbxcompose.runtime.recording.files import recover_all
from rbxcompose.runtime.recording.reader import RecordingReader
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic
from rbxcompose.runtime.supervision.supervisor import Supervisor
from rbxcompose.sdk.ports import Qos
from rbxcompose.tools.commands.check import fix
from tests.runtime.real_robot import read_log

OLD, NEW = b"old: 1\n" * 3000, b"new: 2\n" * 4000
MESSAGES = 12
TOPIC = RecordedTopic("/level", "std_msgs/msg/Float32", "RIHS01_0", Qos.STATE, "float32 data\n")


@dataclass
class Run:
    """One try of a writer: its folder, what it told, and what it left in `made` for its judge."""

    folder: Path
    told: list[str] = field(default_factory=list)
    made: dict[str, Any] = field(default_factory=dict)

    @property
    def names(self) -> set[str]:
        """Return the names in the folder."""
        return {path.name for path in self.folder.rglob("*")}


@dataclass(frozen=True)
class Writer:
    """What writes; `judge` gets whether a call has failed, and raises if something does not hold."""

    prepare: Callable[[Run], object]
    act: Callable[[Run], object]
    judge: Callable[[Run, str], None]


# Whole files


def _replaced(run: Run, failed: str) -> None:
    """The file is the old or the new one; it is the old one only if that was told."""
    path: Path = run.made["path"]
    content = path.read_bytes()
    assert content in (run.made["old"], run.made["new"])
    assert run.told or content == run.made["new"]
    assert run.told or failed in ("", "write", "close")
    assert run.names == {path.name} or failed == "unlink"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def _prepare_file(run: Run) -> None:
    path = run.folder / "file.yaml"
    path.write_bytes(OLD)
    path.chmod(0o640)
    run.made = {"path": path, "old": OLD, "new": NEW}


def _replace(run: Run) -> None:
    try:
        replace_file(run.made["path"], NEW)
    except OSError as error:
        run.told.append(str(error))


ROBOT = "rbx: 1\nkind: Robot\nname: bot\ncomponents:\n  battery: {type: battery_sim, %s: 45 s}\n"


def _prepare_fix(run: Run) -> None:
    path = run.folder / "robot.yaml"
    run.made = {"path": path, "old": (ROBOT % "runtme").encode(), "new": (ROBOT % "runtime").encode()}
    path.write_bytes(run.made["old"])
    path.chmod(0o640)
    run.made["found"] = compile_robot(str(path), environment={})  # what is tried here is writing
    run.made["left"] = [run.made["found"]]


def _fix(run: Run) -> None:
    empty = Compilation()
    said: list[str] = []
    fix(lambda: run.made["left"].pop() if run.made["left"] else empty, said.append)
    run.told += [text for text in said if text.startswith("left")]


def _prepare_graph(run: Run) -> None:
    _prepare_file(run)
    (run.folder.parent / "robot.yaml").write_text(ROBOT % "runtime", encoding="utf-8")


# State


def _state(robot: str) -> RobotState:
    process = Process.of(os.getpid())
    state = ComponentState("base", "toy", "active", "robot", process.pid, 0)
    return RobotState(robot, "/robot.yaml", process, {"robot": process}, (state,), "tcp/x", boot_id())


def _prepare_state(run: Run) -> None:
    folder = RobotFolder(run.folder / "up" / "toys")
    folder.path.mkdir(parents=True)
    folder.write_state(_state("old"))
    run.made["folder"] = folder


def _write_state(run: Run) -> None:
    # The supervisor's own way to write it, without the processes that it would lead.
    supervisor = object.__new__(Supervisor)
    said = SimpleNamespace(_folder=run.made["folder"], state=lambda: _state("new"), _complained="")
    said.log = lambda level, text: run.told.append(f"{level.name}: {text}")
    supervisor.__dict__.update(vars(said))
    supervisor._write_state()


def _judge_state(run: Run, failed: str) -> None:
    folder: RobotFolder = run.made["folder"]
    state = folder.read_state()
    assert state is not None
    assert state.robot == "new" or (state.robot == "old" and run.told)
    assert all(text.startswith("WARN") for text in run.told)
    folder.write_state(_state("later"))  # what has failed once does not stand in the way
    assert folder.read_state() == _state("later")
    assert {path.name for path in folder.path.iterdir()} == {"state.json"} or failed == "unlink"


def _lock(run: Run) -> None:
    folder: RobotFolder = run.made["folder"]
    try:
        run.made["lock"] = folder.lock()
    except OSError as error:
        run.told.append(str(error))


def _judge_lock(run: Run, failed: str) -> None:
    assert ("lock" in run.made) is not bool(run.told)
    if "lock" not in run.made:
        _lock(run)
    assert run.made["folder"].lock() is None  # one holds it
    os.close(run.made["lock"])


# New files

FILES = {"robots/bot/robot.yaml": "a" * 5000, "missions/patrol.yaml": "b" * 20_000}


def _new(run: Run) -> None:
    finding = write_new(run.folder, FILES)
    run.told += [finding.code] if finding else []


def _judge_new(run: Run, failed: str) -> None:
    written = {name: (run.folder / name).read_text() for name in FILES if (run.folder / name).exists()}
    if failed == "unlink":
        assert set(written) <= set(FILES)  # one file of two may be left: taking it away is what has failed
    else:
        assert written == ({} if run.told else FILES)
    assert set(run.told) <= {"RBX9104"}
    hidden = {name for name in run.names if name.startswith(".")}
    assert not hidden or failed == "unlink"


# The log


def _prepare_log(run: Run) -> None:
    run.made["log"] = LogFile(run.folder / NAME, largest=900)


def _write_log(run: Run) -> None:
    for number in range(MESSAGES):
        run.made["log"].write(Record(number * 1.0, Level.OK, "toy", f"step {number}"))


def _judge_log(run: Run, failed: str) -> None:
    run.made["log"].write(Record(99.0, Level.OK, "toy", "the end"))
    run.made["log"].close()
    texts = [record.text for record in read_log(run.folder / NAME)]
    steps = [int(text.removeprefix("step ")) for text in texts if text.startswith("step")]
    assert steps == sorted(set(steps))
    assert texts[-1] == "the end"
    missing = set(range(min(steps), MESSAGES)) - set(steps)
    assert len(missing) <= 1
    assert not missing or "1 lines of the log could not be written" in texts


def _prepare_new_log(run: Run) -> None:
    (run.folder / NAME).write_text("the last run\n")


def _start_log(run: Run) -> None:
    try:
        start_new(run.folder).close()
    except OSError as error:
        run.told.append(str(error))


def _judge_new_log(run: Run, failed: str) -> None:
    kept = [path for path in (run.folder / NAME, run.folder / PREVIOUS) if path.exists()]
    assert any("the last run" in path.read_text() for path in kept)
    assert run.told or (run.folder / PREVIOUS).exists()


# Recordings


def _message(number: int) -> Recorded:
    return Recorded(TOPIC, number, number, number, bytes(8) + os.urandom(2000))


def _record(run: Run) -> None:
    taping = Taping(run.folder / "run.mcap", Plan("toys", "toys.yaml", ()), SteppedClock(), run.told.append)
    for number in range(MESSAGES):
        taping._add(_message(number))
        recorder = taping._recorder
        if recorder is not None and number % 10 == 9:
            taping._try(lambda recorder=recorder, number=number: recorder.keep(1e9 * (1 + number)))  # type: ignore[misc]
    taping.finish()


def _judge_recording(run: Run, failed: str) -> None:
    assert len(run.told) <= 1
    list(recover_all(run.folder))
    path = run.folder / "run.mcap"
    assert run.told or path.exists()
    if path.exists():
        with path.open("rb") as file:
            numbers = [message.sequence for message in RecordingReader(file).messages()]
        assert numbers == list(range(len(numbers)))
        assert run.told or len(numbers) == MESSAGES
    assert run.names <= {"run.mcap", "run.mcap.part"}


def _prepare_recovery(run: Run) -> None:
    _record(run)
    os.rename(run.folder / "run.mcap", run.folder / "run.mcap.part")


def _recover(run: Run) -> None:
    run.told += [one.problem for one in recover_all(run.folder) if one.problem]


def _judge_recovery(run: Run, failed: str) -> None:
    _judge_recording(run, failed)
    with (run.folder / "run.mcap").open("rb") as file:
        assert len(list(RecordingReader(file).messages())) == MESSAGES


# Pictures


def _graph(run: Run) -> None:
    robot = run.folder.parent / "robot.yaml"
    code = command.main(["graph", str(robot), "--out", str(run.made["path"])])
    run.told += [f"exit {code}"] if code else []


def _judge_graph(run: Run, failed: str) -> None:
    content = run.made["path"].read_bytes()
    assert content == OLD or content.startswith(b"flowchart")
    assert content != OLD or run.told
    assert run.names == {run.made["path"].name} or failed == "unlink"


def _nothing(run: Run) -> None:
    """Nothing is to be there before."""


WRITERS = {
    "a file that is replaced": Writer(_prepare_file, _replace, _replaced),
    "check --fix": Writer(_prepare_fix, _fix, _replaced),
    "state": Writer(_prepare_state, _write_state, _judge_state),
    "lock": Writer(_prepare_state, _lock, _judge_lock),
    "new": Writer(_nothing, _new, _judge_new),
    "log": Writer(_prepare_log, _write_log, _judge_log),
    "log of a new run": Writer(_prepare_new_log, _start_log, _judge_new_log),
    "recording": Writer(_nothing, _record, _judge_recording),
    "recovery of a recording": Writer(_prepare_recovery, _recover, _judge_recovery),
    "graph --out": Writer(_prepare_graph, _graph, _judge_graph),
}
