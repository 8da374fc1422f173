"""Answers of people, and new files from them and from templates: all of them or none, never over an existing one."""

import json
import os
import re
import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import ExitStack, suppress
from io import TextIOWrapper
from pathlib import Path
from typing import TypeVar

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from rbxcompose.base.config import Place
from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.printable import FORBIDDEN, plain
from rbxcompose.base.units import ANGLE, LENGTH, UnitError, format_quantity, to_si
from rbxcompose.commands.console import NotDoneError, refuse
from rbxcompose.manifest.files import ROBOT_FILE, shown_name

LONGEST_NAME = 60  # characters
LONGEST_TEXT = 200
FARTHEST = 100.0  # [m] from the origin of `map`; a person should plan a longer tour

NAME = kind("RBX9102")
ANSWER = kind("RBX9103")

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_YAML_WORDS = frozenset({"true", "false", "null"})  # as YAML values these are not texts
EXISTS = kind("RBX9101")
NOT_WRITTEN = kind("RBX9104")
_PLAIN_TEXT = re.compile(r"[A-Za-z][A-Za-z0-9 ,.()/'-]*")


class AnswerError(NotDoneError):
    """Raised with the finding on an answer that cannot be used."""


def wrong_answer(message: str, help_text: str = "") -> AnswerError:
    """Return the error about an answer."""
    return AnswerError(ANSWER.at(None, message, help=help_text))


def read_name(text: str, what: str, taken: Collection[str] = ()) -> str:
    """Return a name for `what` ("the robot").

    Raises:
        AnswerError: if it is no valid name, or one of `taken`.
    """
    shown = plain(text, LONGEST_NAME)
    if not _NAME.fullmatch(text) or len(text) > LONGEST_NAME:
        raise AnswerError(NAME.at(None, f"'{shown}' cannot be the name of {what}", help=_better(text)))
    if text in _YAML_WORDS or text in taken:
        raise AnswerError(NAME.at(None, f"'{shown}' cannot be the name of {what}, it is taken", help="choose another"))
    return text


def _better(text: str) -> str:
    made = name_like(text)
    return f"did you mean '{made}'?" if made else "a name has lower-case letters, digits and underscores"


def name_like(text: str) -> str:
    """Return the name that is most like a text, empty if there is none."""
    return re.sub(r"[^a-z0-9]+", "_", text.lower()).lstrip("_0123456789").rstrip("_")[:LONGEST_NAME]


def read_text(text: str) -> str:
    """Return a sentence.

    Raises:
        AnswerError: if it is empty, longer than a line, or has characters that no manifest may have.
    """
    text = text.strip()
    if not text or len(text) > LONGEST_TEXT or FORBIDDEN.search(text) or set(text) & {"\t", "\n"}:
        why = f"a sentence on one line is needed, of at most {LONGEST_TEXT} characters"
        raise wrong_answer(f"'{plain(text, 40)}' cannot be used", why)
    return text


def read_yes(text: str) -> bool:
    """Return whether the answer is yes.

    Raises:
        AnswerError: if it is neither yes nor no.
    """
    word = text.strip().lower()
    if word and ("yes".startswith(word) or "no".startswith(word)):
        return word.startswith("y")
    raise wrong_answer(f"'{plain(text, 40)}' is neither yes nor no")


def read_place(text: str, taken: Collection[str] = ()) -> Place:
    """Return the place that is written as `NAME=X,Y` or `NAME=X,Y,HEADING`, such as `table=2 m,50 cm,90 deg`.

    Raises:
        AnswerError: if it has another form, if the name is one of `taken`, or if it is too far away.
    """
    name, equals, pose = text.partition("=")
    numbers = [number.strip() for number in pose.split(",")]
    if not equals or len(numbers) not in (2, 3):
        help_text = "write NAME=X,Y or NAME=X,Y,HEADING, such as 'table=2 m,50 cm,90 deg'"
        raise wrong_answer(f"'{plain(text, 40)}' is not a place", help_text)
    name = read_name(name.strip(), "a place", taken)
    try:
        x, y = to_si(numbers[0], LENGTH), to_si(numbers[1], LENGTH)
        heading = to_si(numbers[2], ANGLE) if len(numbers) > 2 else 0.0
    except UnitError as error:
        detail = f" ({error.detail})" if error.detail else ""
        raise wrong_answer(f"the place '{name}': a number {error.message}{detail}", error.help) from None
    if max(abs(x), abs(y)) > FARTHEST:
        help_text = f"use places within {FARTHEST:.0f} m, and move it in the file"
        raise wrong_answer(f"the place '{name}' is very far away", help_text)
    return Place(name, x, y, heading)


def taken(folder: Path, names: Iterable[str]) -> Finding | None:
    """Return the finding about the first of some paths below `folder` that exists, before work is spent on them."""
    return next((_exists(folder / name) for name in names if os.path.lexists(folder / name)), None)


def _exists(path: Path) -> Finding:
    message = f"'{plain(shown_name(path))}' already exists; nothing was written"
    return EXISTS.at(None, message, help="choose another name, or another folder with '--into'")


def robot_file(written: str) -> Path:
    """Return the file for a new robot: a path without an ending is that of its folder, as wherever a robot is named."""
    path = Path(written)
    return path if path.suffix and not path.is_dir() else path / ROBOT_FILE


def write_new(folder: Path, files: Mapping[str, str]) -> Finding | None:
    """Write texts by their paths below `folder`; if that fails, leave nothing behind and return the reason."""
    try:
        with ExitStack() as undo:
            waiting = [_prepare(folder / name, text, undo) for name, text in files.items()]
            for temporary, path in waiting:
                os.link(temporary, path)  # unlike a rename, it fails if the file exists
                undo.callback(path.unlink)
            undo.pop_all()
    except FileExistsError as error:
        return _exists(Path(error.filename2 or error.filename))
    except OSError as error:
        message = f"'{plain(str(error.filename or folder))}' cannot be written: {error.strerror}"
        return NOT_WRITTEN.at(None, message, help="nothing was written")
    for temporary, _ in waiting:
        with suppress(OSError):  # everything is written; one more name of it does no harm
            temporary.unlink()
    return None


def _prepare(path: Path, text: str, undo: ExitStack) -> tuple[Path, Path]:
    """Write the text to a temporary file beside its destination."""
    if os.path.lexists(path):
        raise FileExistsError(0, "", str(path))
    for folder in reversed([folder for folder in path.parents if not folder.exists()]):
        folder.mkdir(exist_ok=True)
        undo.callback(_remove_if_empty, folder)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    with temporary.open("x", encoding="utf-8", newline="\n") as file:
        undo.callback(temporary.unlink)
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    return temporary, path


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):  # somebody else has put a file into it
        folder.rmdir()


def render(template: str, **answers: object) -> str:
    """Return the text of a template of this package with the answers filled in.

    Raises:
        jinja2.UndefinedError: if the template names an answer that is not given.
    """
    return _ENVIRONMENT.get_template(template).render(answers)


def yaml_text(text: str) -> str:
    """Return a text as a YAML scalar of a Robot or Mission file: in quotes where needed, with dollars doubled."""
    text = text.replace("$", "$$")
    if _PLAIN_TEXT.fullmatch(text) and text.lower() not in _YAML_WORDS:
        return text
    return json.dumps(text, ensure_ascii=False)


def yaml_pose(place: Place) -> str:
    """Return a pose as written after the name of a place."""
    x, y = format_quantity(place.x, LENGTH), format_quantity(place.y, LENGTH)
    return f"{{x: {x}, y: {y}, heading: {format_quantity(place.heading, ANGLE)}}}"


def class_name(name: str) -> str:
    """Return a name in the style of Python classes."""
    return "".join(word.capitalize() for word in name.split("_"))


def _environment() -> Environment:
    made = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701 - it writes YAML and Python, which have no HTML to escape
    )
    made.filters |= {"yaml_text": yaml_text, "yaml_pose": yaml_pose, "class_name": class_name}
    return made


_ENVIRONMENT = _environment()


T = TypeVar("T")
Read = Callable[[str], T]


class CancelledError(Exception):
    """Raised when a person stops answering (Ctrl-D)."""


class Asker:
    """Asks, or takes given answers; `is_asking` is whether somebody is there to answer."""

    def __init__(self, *, is_asking: bool) -> None:
        self.is_asking = is_asking and sys.stdin.isatty()
        if self.is_asking and isinstance(sys.stdin, TextIOWrapper):
            sys.stdin.reconfigure(errors="replace")  # a key that sends invalid UTF-8 is a wrong letter, not an abort

    def ask(self, question: str, read: Read[T], default: str, *, given: str | None = None) -> T:
        """Return what `read` makes of the answer; report a refused answer and ask again.

        Raises:
            AnswerError: if `given`, or the default, is refused.
            CancelledError: if there is no answer.
        """
        if given is not None or not self.is_asking:
            return read(default if given is None else given)
        while True:
            try:
                return read(_line(f"{question} [{default}]: ") or default)
            except AnswerError as error:
                refuse(error.finding)

    def ask_several(self, question: str, read: Callable[[str, list[T]], T]) -> list[T]:
        """Return what `read` makes of each answer and those before it, until an empty one; none if nobody is there."""
        found: list[T] = []
        while self.is_asking and (text := _line(f"{question}: ")):
            try:
                found.append(read(text, found))
            except AnswerError as error:
                refuse(error.finding)
        return found


def _line(prompt: str) -> str:
    sys.stdout.write(prompt)
    sys.stdout.flush()
    text = sys.stdin.readline()
    if not text:
        sys.stdout.write("\n")
        raise CancelledError
    return text.strip()
