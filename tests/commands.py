"""Commands of rbxcompose in the test's own process, as a process of their own would run them, but at once."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from subprocess import CompletedProcess
from unittest import mock

from rbxcompose.commands.main import main

SEVERAL = """\
import json, sys
from rbxcompose.commands.main import main
for words in json.loads(sys.argv[1]):
    try:
        main(words)
    except SystemExit:
        pass  # after help
    print(end="\\f", flush=True)
"""
"""Runs commands one after the other in one process, for packages that ours has not; what each says ends with `\\f`."""


def command(*words: str, environment: Mapping[str, str], folder: Path) -> CompletedProcess[str]:
    """Run a command in a folder; return its exit code and what it prints."""
    out, err = io.StringIO(), io.StringIO()
    with mock.patch.dict(os.environ, environment), chdir(folder), redirect_stdout(out), redirect_stderr(err):
        try:
            code = main(words)
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
    return CompletedProcess(words, code, out.getvalue(), err.getvalue())
