"""Data sets of recordings, for `record --format lerobot`: each recording becomes an episode."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import alone_in
from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.printable import plain
from rbxcompose.commands.console import INTERRUPTED, NotDoneError, ReportedError, emit, noted_interrupts, refuse
from rbxcompose.domains.policies.episode import ACTION, Episode, NoEpisodeError, Sample, features_of, role_of, sample_of
from rbxcompose.domains.policies.lerobot import Dataset, DatasetError
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.sensor_arrays import WrongPictureError
from rbxcompose.runtime.recording.topics import CDR, DAMAGED, RecordedTopic, Selection
from rbxcompose.tools.commands.lsp import NOT_INSTALLED
from rbxcompose.tools.recordings import opened, warn

NO_DATASET = kind("RBX3802")
_NEEDED = ("av", "pyarrow")


class EpisodeTopics(Selection):
    """Selects topics of which frames are made."""

    def takes(self, topic: RecordedTopic) -> bool:
        """Return whether a topic is selected."""
        return topic.encoding == CDR and role_of(topic.name, topic.type) is not None and super().takes(topic)


@dataclass(frozen=True, slots=True)
class WantedDataset:
    """What data set is to be made, or added to."""

    folder: Path
    task: str
    """What the robot does in the episodes, in words."""
    rate: int
    """Frames per second."""
    robot: str | None
    topics: EpisodeTopics
    is_added: bool
    """Whether the data set is there already."""

    def problem(self) -> Finding | None:
        """Return why it could not be made, to be told before anything is recorded."""
        if any(find_spec(name) is None for name in _NEEDED):
            help_text = "install it with: pip install 'rbxcompose[lerobot]'"
            return NOT_INSTALLED.at(None, "what writes data sets of LeRobot is not installed", help=help_text)
        name = plain(str(self.folder))
        if self.is_added:
            try:
                Dataset.read(self.folder, self.rate)
            except DatasetError as error:
                return NO_DATASET.at(None, plain(str(error)))
        elif self.folder.exists():
            return NO_DATASET.at(None, f"'{name}' is there already", help="'--append' adds an episode to it")
        elif not self.folder.parent.is_dir():
            return NO_DATASET.at(
                None, f"'{name}' cannot be made: there is no folder '{plain(str(self.folder.parent))}'"
            )
        return None


def write_dataset(wanted: WantedDataset, recordings: Sequence[Path]) -> None:
    """Make a data set with an episode of each recording, or add them; a new one is there wholly or not at all.

    An interrupt ends it between two messages: no file of an episode is half written.

    Raises:
        NotDoneError: if that cannot be.
        ReportedError: after an interrupt.
    """
    try:
        if wanted.is_added:
            # Two recorders would write the same episode; while it waits, an interrupt finds nothing to clear up.
            with alone_in(wanted.folder), noted_interrupts() as interrupts:
                for told in _added(Dataset.read(wanted.folder, wanted.rate), wanted, recordings, interrupts):
                    emit(told)
            return
        with noted_interrupts() as interrupts:
            folder = Path(tempfile.mkdtemp(prefix=f".{wanted.folder.name}.", dir=wanted.folder.parent))
            try:
                episodes = [*_added(Dataset.new(folder, wanted.robot, wanted.rate), wanted, recordings, interrupts)]
                folder.chmod(0o755)
                os.rename(folder, wanted.folder)
            finally:
                shutil.rmtree(folder, ignore_errors=True)
        emit("\n".join(episodes))
    except _InterruptedError:
        kept = "gets no further episode" if wanted.is_added else "is not made"
        refuse(NO_DATASET.at(None, f"interrupted: '{plain(str(wanted.folder))}' {kept}"))
        raise ReportedError(INTERRUPTED) from None
    except DatasetError as error:  # it has changed since the recording began
        raise NotDoneError(NO_DATASET.at(None, plain(str(error)))) from error
    except OSError as error:
        words = f"'{plain(str(wanted.folder))}' cannot be written: {plain(error.strerror or str(error))}"
        raise NotDoneError(NO_DATASET.at(None, words)) from error


class _InterruptedError(Exception):
    """Raised between two messages, after an interrupt."""


def _added(
    dataset: Dataset, wanted: WantedDataset, recordings: Sequence[Path], interrupts: Sequence[int]
) -> Iterator[str]:
    """Add an episode of each recording, and yield what it has."""
    for path in recordings:
        name = plain(str(path))
        try:
            features = features_of(_samples(path, wanted.topics, interrupts, warns=True))
            episode = Episode(features, wanted.rate)
            length = dataset.add(features, episode.frames(_samples(path, wanted.topics, interrupts)), wanted.task)
        except DatasetError as error:
            raise NotDoneError(NO_DATASET.at(None, f"'{name}' is not added: {plain(str(error))}")) from error
        except (NoEpisodeError, WrongPictureError) as error:
            raise NotDoneError(NO_DATASET.at(None, f"'{name}' is no episode: {plain(str(error))}")) from error
        yield f"episode {dataset.info['total_episodes'] - 1}: {length} frames in {length / wanted.rate:.1f} s"
        for camera, count in episode.repeated.items():
            if count:
                yield f"  {camera}: {count} of them have the picture before"


def _samples(path: Path, topics: EpisodeTopics, interrupts: Sequence[int], *, warns: bool = False) -> Iterator[Sample]:
    """Yield the samples of a recording; one with an earlier time than the one before came together with that one."""
    latest = 0
    with opened(path) as reader:
        for message in reader.messages():
            if interrupts:
                raise _InterruptedError
            topic = message.topic
            if (role := role_of(topic.name, topic.type)) is None or not topics.takes(topic):
                continue
            try:
                decoded = decode(registry.message(topic.type), message.payload)
            except CdrError:
                continue  # of a type with this name and other fields
            latest = max(latest, message.log_time)
            if (sample := sample_of(latest, topic.name, role, decoded)) is not None:
                yield sample
        for topic in filter(topics.takes, reader.topics):
            if (role := role_of(topic.name, topic.type)) is not None and role.feature == ACTION:
                yield Sample(latest, topic.name, role, {})
        if reader.damage and warns:
            warn(DAMAGED.at(None, f"'{plain(str(path))}' is damaged: {reader.damage}"))
