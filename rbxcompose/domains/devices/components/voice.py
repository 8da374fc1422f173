"""A voice that people hear, by programs that speak: words go to their standard input."""

from __future__ import annotations

import math
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from typing import Literal

from pydantic import ValidationInfo, field_validator

from rbxcompose import sdk
from rbxcompose.base.config import bundle_path, in_folder
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain
from rbxcompose.msgs.rbxcompose_msgs import Say

SpeechProgram = Literal["auto", "espeak-ng", "piper", "log"]
PER_WORD = 0.4  # [s] per word of unhurried speech
LONGEST = 2000  # characters of what is said at once
_RATE = "22050"  # [Hz] of the samples that piper writes with most of its voices
MODEL = ".onnx"
_REASON = 200  # characters of what a program complains of

Pipeline = Sequence[Sequence[str]]
"""Commands, each a list of words, of which each reads what the one before it writes."""
_SLOWEST = 3.0  # times the usual duration, and as many seconds, after which a program is taken for stuck
SaidGoal = sdk.ServedGoal[Say.Goal, Say.Result, Say.Feedback]


def duration_of(words: str) -> float:
    """Return how long it takes to say words [s]."""
    return PER_WORD * len(words.split())


def pipeline_of(
    engine: SpeechProgram, voice: str, find: Callable[[str], str | None] = shutil.which
) -> tuple[Pipeline, str]:
    """Return the commands that speak with a voice, and why there are none."""
    has_model = voice.endswith(MODEL)
    if engine == "log":
        return (), ""
    if engine == "piper" and not has_model:
        return (), f"piper needs the file of a voice that ends in {MODEL}, not '{plain(voice)}'"
    if engine == "piper" or (engine == "auto" and has_model):
        if missing := [name for name in ("piper", "aplay") if find(name) is None]:
            return (), f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} not installed"
        spoken = ["piper", "--model", voice, "--output-raw"]
        return (spoken, ["aplay", "-q", "-r", _RATE, "-f", "S16_LE", "-c", "1", "-t", "raw", "-"]), ""
    if find("espeak-ng") is None:
        return (), "espeak-ng is not installed"
    return (["espeak-ng", *(["-v", voice] if voice and not has_model else []), "--stdin"],), ""


class Utterance:
    """Words that are being said.

    Raises:
        OSError: when made, if a program cannot be started.
    """

    def __init__(self, pipeline: Pipeline, words: str) -> None:
        self.processes: list[subprocess.Popen[bytes]] = []
        self._names = [command[0] for command in pipeline]
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 - it is closed when this ends
        before: int = subprocess.PIPE
        try:
            for number, command in enumerate(pipeline):
                is_last = number == len(pipeline) - 1
                process = subprocess.Popen(
                    command,
                    stdin=before,
                    stdout=subprocess.DEVNULL if is_last else subprocess.PIPE,
                    stderr=self._complaints,
                )
                if self.processes and (taken := self.processes[-1].stdout) is not None:
                    taken.close()  # the next program has it now
                self.processes.append(process)
                before = process.stdout.fileno() if process.stdout is not None else subprocess.DEVNULL
            self._say(words)
        except OSError:
            self.stop()
            raise

    def _say(self, words: str) -> None:
        pipe = self.processes[0].stdin
        if pipe is not None:
            with pipe:
                pipe.write(words[:LONGEST].encode() + b"\n")

    def end(self) -> str | None:
        """Return None while it speaks, then why it failed; nothing if it has not."""
        codes = [process.poll() for process in self.processes]
        if any(code is None for code in codes):
            return None
        failed = [(name, code) for name, code in zip(self._names, codes, strict=True) if code]
        reason = ""
        if failed and not self._complaints.closed:
            self._complaints.seek(0)
            said = plain(self._complaints.read(_REASON).decode(errors="replace").strip())
            name, code = failed[0]
            reason = f"{name} has failed: {said or f'code {code}'}"
        self._complaints.close()
        return reason

    def stop(self) -> None:
        """Be silent at once."""
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.wait()
            if process.stdout is not None:
                process.stdout.close()
        self._complaints.close()


class VoiceConfig(sdk.Config):
    """What speaks, and how."""

    engine: SpeechProgram = "auto"
    """The program that speaks: `auto` is piper if `voice` is a file, else espeak-ng. With `log` nobody hears it."""
    voice: str = "en"
    """A voice of espeak-ng, such as `en` or `de+f3`, or the file of one of piper, which ends in `.onnx`: relative to
    the manifest's file."""

    @field_validator("voice", mode="before")
    @classmethod
    def _is_a_local_file(cls, given: object, info: ValidationInfo) -> object:
        if not isinstance(given, str) or not given.endswith(MODEL):
            return given
        voice = bundle_path(str(in_folder(given, info)), info)
        bundle_path(f"{voice}.json", info)  # piper reads it, too
        return voice


@sdk.component("voice")
class Voice(sdk.Component[VoiceConfig]):
    """Says what missions `say`, so that people hear it: by espeak-ng or piper, if they are installed.

    Without them, without a loudspeaker, and where time is not real, words are logged and take the time of speaking.

    Example:
        voice: {type: voice, voice: en}
    """

    rate = 20.0
    steps_for_goals = True
    say = sdk.ServesAction(Say, "say", claims="voice", pausable=True)

    def configure(self) -> None:
        """Look which program is here."""
        self.pipeline, self.trouble = pipeline_of(self.config.engine, self.config.voice)
        self.goal: object = None  # what is being said
        self.utterance: Utterance | None = None
        self.at_end.callback(self.be_silent)
        self.until = -math.inf  # [s] of robot time, until which words take time, or a program may speak

    def activate(self) -> None:
        """Tell whether anybody will hear it."""
        self.report()

    def accept_say(self, goal: Say.Goal) -> str:
        """Refuse what nobody would listen to."""
        return "" if len(goal.words) <= LONGEST else f"that is longer than {LONGEST} characters"

    def step(self, dt: float) -> None:
        """Speak on."""
        goal = self.say.current
        if goal is None or goal.cancel_requested or goal.is_paused:
            self.be_silent()
            if goal is not None and goal.cancel_requested:
                goal.canceled()
            return
        if goal is not self.goal:
            self.begin(goal)
        if self.utterance is None:
            if self.now >= self.until - 1e-6:
                self.end(goal)
            return
        reason = self.utterance.end()
        if reason is None and self.now > self.until:
            reason = "the program that speaks is stuck"
        if reason is not None:
            self.trouble = reason
            self.report()
            self.end(goal)

    def begin(self, goal: SaidGoal) -> None:
        """Begin to say the words of a goal, from the first one."""
        self.be_silent()
        self.goal = goal
        words = plain(goal.request.words, LONGEST)
        usual = duration_of(words)
        self.until = self.now + usual
        if not self.pipeline or not self.context.clock.is_real or not words.strip():
            self.info(f"says: {words}")
            return
        try:
            self.utterance = Utterance(self.pipeline, words)
            self.until = self.now + _SLOWEST * usual + _SLOWEST
        except OSError as error:
            self.trouble = str(error)
            self.report()

    def end(self, goal: SaidGoal) -> None:
        """End a goal: whoever could not hear it can read it in the log."""
        if self.trouble and self.utterance is not None:
            self.info(f"says: {plain(goal.request.words, LONGEST)}")
        self.be_silent()
        goal.succeeded(Say.Result(message=self.trouble))

    def be_silent(self) -> None:
        """Say nothing any more."""
        if self.utterance is not None:
            self.utterance.stop()
        self.utterance = self.goal = None

    def report(self) -> None:
        """Report whether it is heard."""
        if self.trouble:
            self.status(Level.WARN, f"nobody hears it: {self.trouble}")
        else:
            self.status(Level.OK, f"speaks by {self.pipeline[0][0]}" if self.pipeline else "words are logged")
