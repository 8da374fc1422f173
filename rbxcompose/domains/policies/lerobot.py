"""Data sets as LeRobot 0.4 reads them: tables in Parquet, pictures as videos, and what they are in `meta/`.

Format `v3.0`, as described at https://huggingface.co/docs/lerobot/lerobot-dataset-v3. Each episode has files of its
own, which the format permits: another one is added without touching those that are there. Needs the extra `lerobot`.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import field
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import Any

from rbxcompose.base.arrays import Bytes, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import TEMPORARY, read_regular, replace_file
from rbxcompose.domains.policies.episode import ACTION, PICTURES, STATE, EpisodeFrame, Features, NoEpisodeError
from rbxcompose.msgs.sensor_arrays import WrongPictureError, pixels
from rbxcompose.msgs.sensor_msgs import Image

VERSION = "v3.0"
_CHUNK = 1000  # files of a folder
_FILES = "chunk-{chunk_index:03d}/file-{file_index:03d}"
_DATA, _VIDEO = f"data/{_FILES}.parquet", f"videos/{{video_key}}/{_FILES}.mp4"
_EPISODES, _INFO, _STATS, _TASKS = (
    f"meta/episodes/{_FILES}.parquet",
    "meta/info.json",
    "meta/stats.json",
    "meta/tasks.parquet",
)
_LARGEST = 64 * 1024 * 1024  # [B] of a file in JSON
# Every second picture is whole, so that one can be read without those before it, as LeRobot's own recorder does.
_CODEC, _OPTIONS = "libx264", {"crf": "23", "preset": "veryfast", "g": "2", "bf": "0"}
_COUNTED = {"timestamp": "float32"} | dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), "int64")
_SHARES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_SEEN, _STEP = 10, 4  # statistics of pictures are of every 10th one, and there of every 4th pixel

Array = np.ndarray[Any, np.dtype[Any]]


class DatasetError(ValueError):
    """Raised for a folder that is no data set, and for an episode that does not fit to those that are there."""


@dataclass(slots=True)
class Dataset:
    """A data set in its folder, with what `meta/info.json` says."""

    folder: Path
    info: dict[str, Any]

    @classmethod
    def new(cls, folder: Path, robot: str | None, rate: int) -> Dataset:
        """Return a data set without episodes."""
        return cls(
            folder,
            {
                "codebase_version": VERSION,
                "robot_type": robot,
                "total_episodes": 0,
                "total_frames": 0,
                "total_tasks": 0,
                "chunks_size": _CHUNK,
                "data_files_size_in_mb": 100,
                "video_files_size_in_mb": 200,
                "fps": rate,
                "splits": {},
                "data_path": _DATA,
                "video_path": _VIDEO,
                "features": {},
            },
        )

    @classmethod
    def read(cls, folder: Path, rate: int) -> Dataset:
        """Return the data set of a folder.

        Raises:
            DatasetError: if there is none that this one can add to.
        """
        try:
            info = json.loads(read_regular(folder / _INFO, _LARGEST))
            version, found, paths = info["codebase_version"], info["fps"], (info["data_path"], info["video_path"])
            counts = [info[f"total_{what}"] for what in ("episodes", "frames", "tasks")]
            is_whole = all(isinstance(count, int) for count in counts) and isinstance(info["features"], dict)
        except (OSError, ValueError, TypeError, KeyError):
            raise DatasetError(f"'{folder}' is no data set of LeRobot") from None
        if version != VERSION or paths != (_DATA, _VIDEO) or not is_whole:
            raise DatasetError(f"'{folder}' is a data set of another kind ('{version}')")
        if found != rate:
            raise DatasetError(f"'{folder}' has {found} frames per second, not {rate}")
        return cls(folder, info)

    def add(self, features: Features, frames: Iterable[EpisodeFrame], task: str) -> int:
        """Add an episode; return how many frames it has.

        Raises:
            DatasetError: if it does not fit to those that are there, or a file of theirs is damaged.
            NoEpisodeError: if it has no frames.
            WrongPictureError: if a picture is none.
            OSError: if it cannot be written; the data set is as before.
        """
        number, before = self.info["total_episodes"], self.info["total_frames"]
        with ExitStack() as unfinished:
            state, action, cameras = self._filmed(features, frames, number, unfinished)
            tasks, length = self._tasks(task), len(state)
            places = np.arange(length)
            columns: dict[str, Array] = {
                **{STATE: np.array(state, np.float32), ACTION: np.array(action, np.float32)},
                "timestamp": (places / self.info["fps"]).astype(np.float32),
                "frame_index": places,
                "episode_index": np.full(length, number),
                "index": before + places,
                "task_index": np.full(length, tasks.index(task)),
            }
            stats = {name: _stats(values.reshape(length, -1)) for name, values in columns.items()}
            stats |= {f"{PICTURES}.{name}": camera.stats() for name, camera in cameras.items()}
            whole = self._all_stats(stats)
            for camera in cameras.values():
                os.replace(camera.unfinished, camera.path)
        self._write(columns, stats, whole, tasks, task)
        return length

    def _filmed(
        self, features: Features, frames: Iterable[EpisodeFrame], number: int, unfinished: ExitStack
    ) -> tuple[list[tuple[float, ...]], list[tuple[float, ...]], dict[str, _Camera]]:
        """Return the states, the actions and the cameras of an episode, whose videos are written but have no name yet.

        `unfinished` removes those that never get one.
        """
        rest = iter(frames)
        if (first := next(rest, None)) is None:
            raise NoEpisodeError("it is shorter than a frame")
        paths = {name: self._path(_VIDEO, number, f"{PICTURES}.{name}") for name in features.cameras}
        cameras = {name: _Camera.of(first.pictures[name], path) for name, path in paths.items()}
        self._fit(_described(features, cameras, self.info["fps"]))
        state, action = [], []
        with ExitStack() as open_videos:
            for camera in cameras.values():
                unfinished.callback(camera.unfinished.unlink, missing_ok=True)
                camera.open(open_videos, self.info["fps"])
            for frame in chain((first,), rest):
                state.append(frame.state)
                action.append(frame.action)
                for name, camera in cameras.items():
                    camera.add(frame.pictures[name])
        return state, action, cameras

    def _fit(self, described: Mapping[str, Any]) -> None:
        known = self.info["features"]
        if not known:
            self.info["features"] = dict(described)
            return
        for name in {**known, **described}:
            if known.get(name) != described.get(name):
                there, here = (_words(each.get(name)) for each in (known, described))
                raise DatasetError(f"'{name}' is {here} here, and {there} in the episodes before")

    def _write(
        self,
        columns: Mapping[str, Array],
        stats: Mapping[str, Any],
        whole: Mapping[str, Any],
        tasks: Sequence[str],
        task: str,
    ) -> None:
        """Write the tables of an episode, and with them the statistics of the `whole` data set."""
        number, length = self.info["total_episodes"], len(columns["index"])
        place = {"chunk_index": number // _CHUNK, "file_index": number % _CHUNK}
        row: dict[str, Any] = {"episode_index": number, "tasks": [task], "length": length}
        row |= {f"data/{key}": value for key, value in place.items()}
        row |= {"dataset_from_index": int(columns["index"][0]), "dataset_to_index": int(columns["index"][-1]) + 1}
        for name in stats:
            if name.startswith(PICTURES):
                row |= {f"videos/{name}/{key}": value for key, value in place.items()}
                row |= {f"videos/{name}/from_timestamp": 0.0, f"videos/{name}/to_timestamp": length / self.info["fps"]}
        row |= {f"stats/{name}/{key}": value for name, each in stats.items() for key, value in each.items()}
        row |= {f"meta/episodes/{key}": value for key, value in place.items()}
        counts = {"total_episodes": number + 1, "total_frames": row["dataset_to_index"], "total_tasks": len(tasks)}
        info = self.info | counts | {"splits": {"train": f"0:{number + 1}"}}
        replace_file(self._path(_DATA, number), _parquet(columns))
        replace_file(self._path(_EPISODES, number), _parquet({key: [value] for key, value in row.items()}))
        replace_file(self.folder / _TASKS, _task_table(tasks))
        replace_file(self.folder / _STATS, _json(whole))
        replace_file(self.folder / _INFO, _json(info))  # the last one: it says what counts
        self.info = info

    def _path(self, pattern: str, number: int, key: str = "") -> Path:
        name = pattern.format(chunk_index=number // _CHUNK, file_index=number % _CHUNK, video_key=key)
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def _tasks(self, task: str) -> list[str]:
        """Return all tasks in the order of their indices."""
        if not self.info["total_tasks"]:
            return [task]
        from pyarrow import parquet

        try:
            table = parquet.read_table(self.folder / _TASKS).to_pydict()
            texts = next(values for name, values in table.items() if name != "task_index")
            found = [name for _, name in sorted(zip(table["task_index"], texts, strict=True))]
        except (OSError, ValueError, KeyError, StopIteration) as error:
            raise DatasetError(f"'{self.folder / _TASKS}' cannot be read") from error
        return found if task in found else [*found, task]

    def _all_stats(self, added: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the statistics of all episodes, with those of one that is added.

        Quantiles are the means of those of the episodes, as LeRobot has them.
        """
        if not self.info["total_episodes"]:
            return added
        try:
            before = json.loads(read_regular(self.folder / _STATS, _LARGEST))
            return {name: _merged(before[name], stats) for name, stats in added.items()}
        except (OSError, ValueError, TypeError, KeyError) as error:
            raise DatasetError(f"'{self.folder / _STATS}' cannot be read") from error


def _described(features: Features, cameras: Mapping[str, _Camera], rate: int) -> dict[str, Any]:
    """Return the features as `info.json` has them."""
    found: dict[str, Any] = {
        name: {"dtype": "float32", "shape": [len(names)], "names": list(names)}
        for name, names in ((STATE, features.state), (ACTION, features.action))
    }
    for name, camera in cameras.items():
        found[f"{PICTURES}.{name}"] = {
            "dtype": "video",
            "shape": [camera.height, camera.width, 3],
            "names": ["height", "width", "channels"],
            "info": {
                "video.height": camera.height,
                "video.width": camera.width,
                "video.codec": "h264",
                "video.pix_fmt": "yuv420p",
                "video.is_depth_map": False,
                "video.fps": rate,
                "video.channels": 3,
                "has_audio": False,
            },
        }
    return found | {name: {"dtype": kind, "shape": [1], "names": None} for name, kind in _COUNTED.items()}


def _words(feature: Mapping[str, Any] | None) -> str:
    if feature is None:
        return "missing"
    if feature["dtype"] == "video":
        return "a video of {1} x {0}".format(*feature["shape"])
    return ", ".join(feature["names"] or [feature["dtype"]])


@dataclass(slots=True)
class _Camera:
    """A camera of one episode: writes its pictures to a video."""

    path: Path
    size: tuple[int, ...]
    """Of its pictures: rows and columns; a video has even sides."""
    stream: Any = None
    container: Any = None
    last: Bytes | None = None
    count: int = 0
    seen: list[Array] = field(default_factory=list)
    """What statistics are made of: values of some pictures, for each colour."""

    @classmethod
    def of(cls, message: Any, path: Path) -> _Camera:
        """Return one for pictures like this one."""
        return cls(path, _colours(message).shape[:2])

    @property
    def height(self) -> int:
        """Return the rows of the video."""
        return self.size[0] // 2 * 2

    @property
    def width(self) -> int:
        """Return the columns of the video."""
        return self.size[1] // 2 * 2

    @property
    def unfinished(self) -> Path:
        """Return the name of the video until it is whole."""
        return self.path.with_name(self.path.name + TEMPORARY)

    def open(self, stack: ExitStack, rate: int) -> None:
        """Begin the video."""
        import av

        self.container = stack.enter_context(av.open(str(self.unfinished), "w", format="mp4"))
        self.stream = self.container.add_stream(_CODEC, rate=rate, options=dict(_OPTIONS))
        self.stream.height, self.stream.width, self.stream.pix_fmt = self.height, self.width, "yuv420p"
        stack.callback(lambda: self.container.mux(self.stream.encode()))

    def add(self, message: Any) -> None:
        """Add a picture; one that makes no sense is replaced by the one before."""
        import av

        try:
            picture = _colours(message)
        except WrongPictureError:
            if self.last is None:
                raise
            picture = self.last
        if picture.shape[:2] != self.size:
            here, others = (f"{shape[1]} x {shape[0]}" for shape in (picture.shape, self.size))
            raise WrongPictureError(f"a picture has {here} pixels, others {others}")
        self.last = picture
        if self.count % _SEEN == 0:
            self.seen.append(picture[::_STEP, ::_STEP].reshape(-1, 3))
        self.count += 1
        even = np.ascontiguousarray(picture[: self.height, : self.width])
        self.container.mux(self.stream.encode(av.VideoFrame.from_ndarray(even, "rgb24")))

    def stats(self) -> dict[str, Any]:
        """Return the statistics of its colours, from 0 to 1."""
        found = _stats(np.concatenate(self.seen).astype(np.float64) / 255.0)
        return {key: [len(self.seen)] if key == "count" else [[[one]] for one in value] for key, value in found.items()}


def _colours(message: Any) -> Bytes:
    """Return a picture as an array, rows x columns x 3.

    Raises:
        WrongPictureError: if it is none.
    """
    found = pixels(message) if isinstance(message, Image) else _unpacked(bytes(message.data))
    return found if found.ndim == 3 else np.repeat(found[:, :, np.newaxis], 3, axis=2)


def _unpacked(data: bytes) -> Bytes:
    import av

    try:
        with av.open(BytesIO(data), "r", format="image2pipe") as container:
            frame = next(container.decode(video=0))
        return np.asarray(frame.to_ndarray(format="rgb24"), np.uint8)
    except (av.FFmpegError, StopIteration, IndexError, ValueError) as error:
        raise WrongPictureError("a compressed picture cannot be read") from error


def _stats(values: Array) -> dict[str, list[Any]]:
    """Return the statistics of each column of `values`, rows x columns, as LeRobot normalises by them."""
    found = {"min": values.min(0), "max": values.max(0)}
    found |= {"mean": values.mean(0, np.float64), "std": values.std(0, np.float64)}
    shares = np.quantile(values, list(_SHARES.values()), axis=0)
    found |= dict(zip(_SHARES, shares, strict=True))
    return {name: each.tolist() for name, each in found.items()} | {"count": [len(values)]}


def _merged(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    counts = np.array([one["count"][0], other["count"][0]], np.float64)
    share = counts / counts.sum()

    def mean(key: str) -> Array:
        return np.asarray(np.asarray(one[key]) * share[0] + np.asarray(other[key]) * share[1])

    centre = mean("mean")
    squares = [np.square(each["std"]) + np.square(np.asarray(each["mean"]) - centre) for each in (one, other)]
    return {
        "min": np.minimum(one["min"], other["min"]).tolist(),
        "max": np.maximum(one["max"], other["max"]).tolist(),
        "mean": centre.tolist(),
        "std": np.sqrt(squares[0] * share[0] + squares[1] * share[1]).tolist(),
        **{key: mean(key).tolist() for key in _SHARES},
        "count": [int(counts.sum())],
    }


def _parquet(columns: Mapping[str, Any], metadata: Mapping[bytes, bytes] | None = None) -> bytes:
    """Return a table: a column with several numbers in a row is a list of fixed length."""
    import pyarrow as pa
    from pyarrow import parquet

    made = {}
    for name, values in columns.items():
        is_many = isinstance(values, np.ndarray) and values.ndim == 2 and values.shape[1] > 1
        flat = values.ravel() if isinstance(values, np.ndarray) else values
        made[name] = pa.FixedSizeListArray.from_arrays(pa.array(flat), values.shape[1]) if is_many else pa.array(flat)
    table = pa.table(made)
    written = BytesIO()
    parquet.write_table(table.replace_schema_metadata(metadata) if metadata else table, written)
    return written.getvalue()


def _task_table(tasks: Sequence[str]) -> bytes:
    """Return the table of tasks, whose texts are an index of pandas."""
    types = {"task_index": ("int64", "int64"), "task": ("unicode", "object")}
    columns = [
        {"name": name, "field_name": name, "pandas_type": of_pandas, "numpy_type": of_numpy, "metadata": None}
        for name, (of_pandas, of_numpy) in types.items()
    ]
    pandas = {"index_columns": ["task"], "column_indexes": [], "columns": columns, "pandas_version": "2.0.0"}
    table = {"task_index": list(range(len(tasks))), "task": list(tasks)}
    return _parquet(table, {b"pandas": json.dumps(pandas).encode()})


def _json(content: Mapping[str, Any]) -> bytes:
    return (json.dumps(content, indent=4) + "\n").encode()
