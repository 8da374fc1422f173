"""A voice: what missions say is heard if a program that speaks is here, and can be read in the log if not."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.domains.devices.components.voice import Utterance, Voice, pipeline_of
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus
from rbxcompose.msgs.rbxcompose_msgs import Say
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk import Ended, Outcome, SentGoal
from rbxcompose.testing import Bench, instance
from rbxcompose.testing.manifests import check_text

WORDS = '-x $(touch boo); `id` "lunch" isn\'t ready'
ROBOT = "rbx: 1\nkind: Robot\nname: talker\n{}missions:\n  talk: talk.yaml\nstart: talk\n"
MISSION = "rbx: 1\nkind: Mission\nname: talk\ndo:\n  - say: Lunch is ready\n"


class LikeReal(SteppedClock):
    """A clock that is stepped, while programs run as they do in real time."""

    is_real = True


class Talker:
    """A voice on the bench, and a client of its action."""

    def __init__(self, *, is_real: bool = True, **config: object) -> None:
        self.bench = Bench(instance("voice", "voice", config), clock=LikeReal() if is_real else SteppedClock())
        self.ended: list[Ended[Say.Result]] = []
        self.client = self.bench.bus.action_client("bench", "/say", Say)
        self.statuses: list[DiagnosticStatus] = self.bench.statuses("voice")
        self.bench.advance(1.1)

    def say(self, words: str) -> SentGoal:
        sent = self.client(Say.Goal(words=words), self.ended.append)
        self.bench.advance(0.1)
        return sent

    @property
    def utterance(self) -> Utterance | None:
        found = self.bench.component("voice")
        assert isinstance(found, Voice)
        return found.utterance

    @property
    def processes(self) -> list[subprocess.Popen[bytes]]:
        found = self.utterance
        assert found is not None
        return found.processes

    def hear(self) -> None:
        """Wait until the program has spoken, unless it was so quick that nothing is left of it."""
        for process in self.processes if self.utterance is not None else ():
            process.wait(timeout=10)
        self.bench.advance(0.2)

    @property
    def outcomes(self) -> list[Outcome]:
        return [end.outcome for end in self.ended]


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder whose programs are found first."""
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    return tmp_path


def install(folder: Path, name: str, script: str) -> Path:
    """Install a program, which may write to the file that is returned."""
    program, heard = folder / name, folder / f"{name}.heard"
    program.write_text(f"#!/bin/sh\n{script.format(heard=heard)}\n")
    program.chmod(0o755)
    return heard


def test_words_reach_the_program_as_they_are_and_no_shell_sees_them(programs: Path) -> None:
    heard = install(programs, "espeak-ng", 'echo "$@" > {heard}; cat >> {heard}')
    talker = Talker(voice="de")
    talker.say(WORDS)
    talker.hear()
    assert heard.read_text() == f"-v de --stdin\n{WORDS}\n"
    assert talker.outcomes == [Outcome.SUCCEEDED]
    assert not (programs / "boo").exists()


def test_piper_speaks_into_a_player(programs: Path) -> None:
    install(programs, "piper", 'printf "%s " "$@"; cat')
    heard = install(programs, "aplay", "cat > {heard}")
    talker = Talker(voice="/voices/amy.onnx")
    talker.say("hello")
    talker.hear()
    assert heard.read_text() == "--model /voices/amy.onnx --output-raw hello\n"


def test_a_program_that_fails_is_reported_and_the_words_are_logged(programs: Path) -> None:
    install(programs, "espeak-ng", "cat > /dev/null; echo no sound card >&2; exit 1")
    talker = Talker()
    talker.say("lunch is ready")
    talker.hear()
    talker.bench.advance(1.0)
    assert talker.outcomes == [Outcome.SUCCEEDED]
    assert talker.statuses[-1].message == "nobody hears it: espeak-ng has failed: no sound card"
    assert any("says: lunch is ready" in text for text in talker.bench.texts())


def test_a_program_that_is_stuck_is_ended(programs: Path) -> None:
    install(programs, "espeak-ng", "exec tail -f /dev/null")
    talker = Talker()
    talker.say("lunch is ready")
    (process,) = talker.processes
    talker.bench.advance(10.0)
    assert process.returncode is not None
    assert talker.outcomes == [Outcome.SUCCEEDED]
    assert talker.ended[0].result is not None
    assert talker.ended[0].result.message == "the program that speaks is stuck"


def test_a_cancelled_goal_is_silent_at_once(programs: Path) -> None:
    install(programs, "espeak-ng", "exec tail -f /dev/null")
    talker = Talker()
    sent = talker.say("a very long story")
    (process,) = talker.processes
    sent.cancel()
    talker.bench.advance(0.2)
    assert process.returncode is not None
    assert talker.outcomes == [Outcome.CANCELED]


def test_after_a_pause_the_words_are_said_from_the_first(programs: Path) -> None:
    install(programs, "espeak-ng", "exec tail -f /dev/null")
    talker = Talker()
    talker.say("lunch is ready")
    pause = talker.bench.bus.client("bench", "/say/pause", SetBool)
    pause(SetBool.Request(data=True), lambda _: None)
    talker.bench.advance(20.0)
    assert talker.utterance is None
    assert talker.outcomes == []
    pause(SetBool.Request(data=False), lambda _: None)
    talker.bench.advance(0.2)
    assert talker.processes
    talker.bench.host.shutdown()


@pytest.mark.parametrize("is_real", [True, False], ids=["without a program", "on a stepped clock"])
def test_without_a_voice_words_are_logged_and_take_their_time(is_real: bool) -> None:
    talker = Talker(is_real=is_real, engine="log")
    talker.say("lunch is ready")
    talker.bench.advance(1.0)
    assert talker.outcomes == []
    talker.bench.advance(0.3)
    assert talker.outcomes == [Outcome.SUCCEEDED]
    assert any("says: lunch is ready" in text for text in talker.bench.texts())


@pytest.mark.parametrize(
    ("engine", "voice", "there", "expected"),
    [
        ("auto", "en", ["espeak-ng"], ""),
        ("auto", "en", [], "espeak-ng is not installed"),
        ("auto", "x.onnx", ["espeak-ng"], "piper and aplay are not installed"),
        ("piper", "en", ["piper", "aplay"], "piper needs the file of a voice that ends in .onnx, not 'en'"),
        ("log", "en", ["espeak-ng"], ""),
    ],
)
def test_what_is_missing_is_told(engine: str, voice: str, there: list[str], expected: str) -> None:
    _, trouble = pipeline_of(engine, voice, lambda name: name if name in there else None)  # type: ignore[arg-type]
    assert trouble == expected


@pytest.mark.parametrize("voice", ["", "components:\n  voice: {type: voice}\n"], ids=["without", "with"])
def test_missions_say_words_with_and_without_a_voice(voice: str, tmp_path: Path) -> None:
    checked = check_text(ROBOT.format(voice), tmp_path, others={"talk.yaml": MISSION})
    assert checked.codes == []
    robot = checked.compilation.robot
    assert robot is not None
    assert robot.skills["say"].skill.claims == "voice"
    assert bool(robot.skills["say"].topic) is bool(voice)
