"""What verbs about recordings share: opening them, recovering those that were cut short, counting what is in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from rbxcompose.base.files import NotRegularError, open_regular
from rbxcompose.base.findings import Finding, Report, Severity
from rbxcompose.base.printable import plain
from rbxcompose.commands.console import NotDoneError, table, write_report
from rbxcompose.commands.guest import NO_NAME
from rbxcompose.runtime.recording.files import recover_all
from rbxcompose.runtime.recording.reader import NotARecordingError, RecordingReader
from rbxcompose.runtime.recording.topics import RECOVERED, UNREADABLE, RecordedTopic, by_name


@contextmanager
def opened(path: Path) -> Iterator[RecordingReader]:
    """Open a recording.

    Raises:
        NotDoneError: if it is none.
    """
    try:
        with open_regular(path) as file:
            yield RecordingReader(file)
    except NotRegularError as error:
        raise NotDoneError(UNREADABLE.at(None, f"'{plain(str(path))}' is not a recording: it is not a file")) from error
    except OSError as error:
        reason = plain(error.strerror or str(error))
        raise NotDoneError(UNREADABLE.at(None, f"'{plain(str(path))}' cannot be read: {reason}")) from error
    except NotARecordingError as error:
        finding = UNREADABLE.at(None, f"'{plain(str(path))}' is not a recording: {error}")
        raise NotDoneError(finding) from error


def recover_in(folder: Path) -> None:
    """Recover the unfinished recordings of a folder and report them."""
    for one in recover_all(folder):
        if one.problem:
            warn(RECOVERED.at(None, f"'{plain(str(one.path))}' is unfinished and stays so: {plain(one.problem)}"))
        else:
            warn(
                RECOVERED.at(None, f"'{plain(str(one.path))}' was unfinished: {one.messages:,} messages are recovered")
            )


def warn(finding: Finding) -> None:
    """Report a finding that does not end the command."""
    write_report(Report([finding]), {})


def warn_of_unmatched(patterns: Iterable[str], names: Iterable[str]) -> None:
    """Warn of patterns that match no topic, and suggest which of these names was meant."""
    others = sorted({name.lstrip("/") for name in names})
    for pattern in patterns:
        words = f"no topic matches '{plain(pattern, 60)}'"
        finding = NO_NAME.misspelt(None, words, pattern.lstrip("/"), others, "topics")
        warn(replace(finding, severity=Severity.WARNING))


def sorted_counts(counts: Mapping[RecordedTopic, int]) -> list[tuple[RecordedTopic, int]]:
    """Return the topics by name and type, each with its number of messages."""
    return sorted(by_name(counts).items(), key=lambda item: (item[0].name, item[0].type))


def count_table(counts: Mapping[RecordedTopic, int]) -> str:
    """Return one line for each topic: name, type, class, number of messages."""
    counted = sorted_counts(counts)
    rows = [(topic.name, topic.type or "-", topic.qos.value, f"{number:,}") for topic, number in counted]
    return table([("topic", "type", "class", "messages"), *rows])
