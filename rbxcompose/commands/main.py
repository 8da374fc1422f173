"""The command `rbxcompose`: finds the verb's file and runs it. Each file in a folder `commands` of a room is one verb.

A verb's module has `add_arguments(parser)` and `run(arguments) -> exit code`; the first line of its docstring is its
help. Only the verb in use is imported, and for help only what help needs.
"""

import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any, NoReturn

import rbxcompose
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.garbage_collection import collect_rarely
from rbxcompose.commands.verbs import about, in_groups, load, module_of, parser_of, starts_robots, verbs

USAGE, INTERRUPTED = 2, 130  # as in `console`, which takes longer to import
NO_READER = 141  # exit code, as that of other programs whose reader has gone
_ABOUT = "Docker Compose for robots: YAML in, a checked and running robot out."


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code: 0 fine, 1 findings, 2 wrong usage, 3 and 4 of `up`, 130 interrupted.

    It is 141 if nobody reads what it writes, whatever that is.
    """
    if arguments is None:
        _ready_streams()
        signal.signal(signal.SIGINT, _interrupted)
        collect_rarely()
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words or words[0] in ("-h", "--help", "help"):
        sys.stdout.write(_help())
        return 0 if words else USAGE
    if words[0] == "--version":
        sys.stdout.write(f"rbxcompose {rbxcompose.__version__}\n")
        return 0
    if words[0] == "__complete":  # the query of the scripts of `completion`
        return int(import_module(module_of("completion")).complete(words[1:]))
    if words[0] not in verbs():
        from rbxcompose.base.findings import suggest

        hint = suggest(words[0], verbs(), "commands")
        sys.stderr.write(f"rbxcompose: there is no command {words[0]!r}; {hint}\n")
        return USAGE
    return _run(words[0], words[1:])


def _ready_streams() -> None:
    """Let all that is written be taken: nowhere if a stream is closed, escaped if its encoding lacks a character."""
    for name in ("stdout", "stderr"):
        if (stream := getattr(sys, name)) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))
        else:
            stream.reconfigure(errors="backslashreplace")


def _interrupted(number: int, frame: object) -> NoReturn:
    # Immediately and silently, even in the middle of an import; `up` itself notifies its robot.
    os._exit(INTERRUPTED)


def _run(name: str, words: Sequence[str]) -> int:
    if starts_robots(name):
        from rbxcompose.runtime.folder import mark_start

        mark_start()
    _import_pydantic()
    from rbxcompose.commands.console import NotDoneError, ReportedError, UnwritableError, answered, misused, refuse

    try:
        verb = load(name)
        with answered(in_json="--json" in words):
            try:
                arguments = parser_of(name, verb).parse_args(words)
                if (where := getattr(verb, "ON_SYSTEM", "")) and (system := _system_of(arguments, where)):
                    from rbxcompose.commands.hosts import forward  # only needed for systems

                    return forward(verb, system, where, [name, *words], arguments)
                return verb.run(arguments)
            except NotDoneError as error:
                return refuse(error.finding)
            except ReportedError as error:
                return error.exit_code
    except (BrokenPipeError, UnwritableError) as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # so that the flush at exit has somewhere to go
        if isinstance(error, BrokenPipeError):
            return NO_READER
        return misused(name, f"the output cannot be written: {error.strerror}")


def _import_pydantic() -> None:
    """Import pydantic in half the time, which is longer than Python's start.

    It does not search all packages for plugins, nor import what would. Its dataclasses are made as ours. The typed
    dictionaries of its core are annotations only, so a dictionary does.
    """
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    loader: Any = ModuleType("pydantic.plugin._loader")
    loader.get_plugins = tuple
    sys.modules.setdefault(loader.__name__, loader)
    with _replaced("dataclasses", dataclass=dataclass):
        with _replaced("typing", TypedDict=_Plain), _replaced("typing_extensions", TypedDict=_Plain):
            import_module("pydantic_core.core_schema")
        import_module("pydantic.fields")
        import_module("pydantic.main")


class _Plain(dict[str, Any]):
    def __init_subclass__(cls, total: bool = True) -> None:
        """Take the option of a typed dictionary."""


@contextmanager
def _replaced(module: str, **others: Any) -> Iterator[None]:
    """Have a module lend names to others for a while."""
    there = vars(import_module(module))
    own = {name: there[name] for name in others}
    there.update(others)
    try:
        yield
    finally:
        there.update(own)


def _system_of(arguments: Any, where: str) -> str:
    """Return the argument that names a system, or a robot of one; empty if there is none."""
    from rbxcompose.commands.options import EACH, system_and_robot

    written = arguments.robot if "robot" in arguments else None
    if not written and where == EACH:
        written = arguments.path if "path" in arguments else next(iter(vars(arguments).get("names", ())), None)
    return written if written and system_and_robot(written) else ""


def _help() -> str:
    width = max(map(len, verbs()))
    lines = ["usage: rbxcompose COMMAND ...  (COMMAND --help says more)", "", _ABOUT]
    for heading, names in in_groups().items():
        lines += ["", f"{heading}:", *(f"  {name:<{width}}  {about(name)}" for name in names)]
    return "\n".join(lines) + "\n"
