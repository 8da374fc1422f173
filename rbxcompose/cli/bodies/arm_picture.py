"""Writing pictures of arms."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rbxcompose.atomic_files import replace_file
from rbxcompose.body.extra import MissingLibraryError
from rbxcompose.cli.output.console import misused, refuse


def write_picture(verb: str, file: Path, draw: Callable[[], bytes]) -> int:
    """Draw a picture into a file; return the exit code."""
    try:
        replace_file(file.resolve(), draw())
    except MissingLibraryError as error:
        return refuse(error.finding)
    except ValueError as error:
        return misused(verb, str(error))
    except OSError as error:
        return misused(verb, f"'{file}' cannot be written: {error.strerror}")
    return 0
