"""Compiles robots, each in a process of its own that has little memory and time; run as a program.

It reads lines of JSON, `{"path", "environment"}`, and answers each with a line: codes, those without a place, seconds
of processor time and the exit code.
"""

from __future__ import annotations

import gc
import json
import os
import resource
import signal
import sys
import time
from pathlib import Path

from rbxcompose.commands.finding_pages import all_kinds
from rbxcompose.commands.formats import renderer
from rbxcompose.compiler.compile import compile_robot

MEMORY = 200_000_000  # bytes of address space beyond what the process has at its start
PATIENCE = 20  # [s] of processor time after which it is ended
FORMATS = ("text", "json")


def main() -> None:
    """Answer each line."""
    all_kinds()  # imports what declares them, which is most of the compiler
    for name in FORMATS:
        renderer(name)
    compile_robot("rbx:robots/turtlebot/robot.yaml", environment={})
    gc.freeze()
    for line in sys.stdin:
        order = json.loads(line)
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            with open(writing, "w", encoding="utf-8") as pipe:
                pipe.write(json.dumps(compiled(order["path"], order["environment"])))
            os._exit(0)
        os.close(writing)
        with open(reading, encoding="utf-8") as pipe:
            told = pipe.read()
        _, status = os.waitpid(child, 0)
        ended = {"exit": os.waitstatus_to_exitcode(status)}
        sys.stdout.write(json.dumps((json.loads(told) if told else {}) | ended) + "\n")
        sys.stdout.flush()


def compiled(path: str, environment: dict[str, str]) -> dict[str, object]:
    """Compile a robot within the limits and tell what came of it."""
    signal.signal(signal.SIGXCPU, signal.SIG_DFL)
    started = time.process_time()
    resource.setrlimit(resource.RLIMIT_CPU, (int(started) + PATIENCE, int(started) + PATIENCE + 1))
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    out = compile_robot(path, environment=environment, tries_profiles=True)
    written = [renderer(name)(out.report, out.sources, False) for name in FORMATS]
    findings = list(out.report)
    return {
        "codes": sorted({finding.code for finding in findings}),
        "nowhere": sorted({finding.code for finding in findings if finding.span is None}),
        "controls": sorted({character for text in written for character in text if character in CONTROLS}),
        "seconds": time.process_time() - started,
    }


CONTROLS = {chr(code) for code in (*range(9), *range(11, 32), *range(127, 160), 0x202E, 0x2066)}

if __name__ == "__main__":
    main()
