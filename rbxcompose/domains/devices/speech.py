"""Programs that speak: which of them is here, and one of them while it speaks. Words go to their standard input."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from typing import Literal

from rbxcompose.base.printable import plain

SpeechProgram = Literal["auto", "espeak-ng", "piper", "log"]
PER_WORD = 0.4  # [s] per word of unhurried speech
LONGEST = 2000  # characters of what is said at once
_RATE = "22050"  # [Hz] of the samples that piper writes with most of its voices
MODEL = ".onnx"
_REASON = 200  # characters of what a program complains of

Pipeline = Sequence[Sequence[str]]
"""Commands, each a list of words, of which each reads what the one before it writes."""


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
