"""Mutants of the shipped manifests: each seed gives one, and what was done to it stands in `Mutant.what`."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[2]
FOLDERS = ("robots", "missions", "parts")
# Their bodies are files beside them, and a child process would expand most of these for each mutant.
WITH_BODY = ("kobuki", "box_robot", "head_only", "pedestal_pi", "pi_robot", "rover")
ODD = [
    *("\x00", "\x1b", "\x85", "\u2028", "\u202e", "\ufeff", "\t", "\r", "\xa0", "é", "\U0001f916", "\\", "'", '"', "#"),
    *(":", ": ", "- ", "? ", "|", ">", "&a ", "*a", "!remove", "!!python/name:x ", "<<: *a", "{", "}", "[", "]", ","),
    *("%", "@", "`", "$", "$$", "$battery", "${", "}", "${args.speed}", "${env.X:-", "${secret.x}", "---", "..."),
]
SCALARS = [
    *("", "~", "null", "true", "no", "0", "-1", "1e400", ".nan", "0x10", "12:30", "9" * 50, "x" * 300, "0 m", "-5 s"),
    *("1e9 m/s", "50 %", "500 %", "90 deg", "forever", "robot.yaml", "../../..", "/dev/zero", "rbx:parts/base.yaml"),
    *("battery", "battery.battery_level", "go_to", "dock", "$battery", "$battery < 1 %", "not $x", "((((", "a.b.c.d"),
]


@dataclass(frozen=True, slots=True)
class Mutant:
    """One changed file of a project, by its path in the project."""

    seed: int
    file: str
    data: bytes
    what: str


def originals() -> dict[str, bytes]:
    """Return the manifests of robots that ship, by path; parts are taken from the project, so that they change too."""
    found = (path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.yaml")))
    paths = [path for path in found if not path.name.endswith(".test.yaml") and path.parent.name not in WITH_BODY]
    return {
        str(path.relative_to(ROOT)): path.read_bytes().replace(
            b"rbx:parts/", b"../" * (len(path.relative_to(ROOT).parts) - 1) + b"parts/"
        )
        for path in paths
    }


def mutant(seed: int, files: dict[str, bytes]) -> Mutant:
    """Return the mutant of a seed: one to three changes of one file."""
    source = random.Random(seed)
    file = source.choice(sorted(files))
    data, done = files[file], []
    for _ in range(source.choice((1, 1, 2, 3))):
        change = source.choice(CHANGES)
        data = change(data, source)
        done.append(change.__name__)
    return Mutant(seed, file, data, ", ".join(done))


def truncate(data: bytes, source: random.Random) -> bytes:
    return data[: source.randrange(len(data) + 1)]


def flip_bytes(data: bytes, source: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(min(source.randint(1, 4), len(data))):
        changed[source.randrange(len(data))] = source.randrange(256)
    return bytes(changed)


def delete_bytes(data: bytes, source: random.Random) -> bytes:
    start = source.randrange(len(data) + 1)
    return data[:start] + data[start + source.randint(1, 30) :]


def insert_odd(data: bytes, source: random.Random) -> bytes:
    start = source.randrange(len(data) + 1)
    return data[:start] + source.choice(ODD).encode() + data[start:]


def delete_line(data: bytes, source: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    if lines:
        del lines[source.randrange(len(lines))]
    return b"".join(lines)


def duplicate_line(data: bytes, source: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    if lines:
        lines.insert(source.randrange(len(lines)), source.choice(lines))
    return b"".join(lines)


def indent_line(data: bytes, source: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    if lines:
        index = source.randrange(len(lines))
        lines[index] = source.choice((b"  ", b" ", b"\t", b"    ")) + lines[index].lstrip(source.choice((b" ", b"")))
    return b"".join(lines)


def swap_lines(data: bytes, source: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    if lines:
        one, other = source.randrange(len(lines)), source.randrange(len(lines))
        lines[one], lines[other] = lines[other], lines[one]
    return b"".join(lines)


Step = Callable[[Any, Any, random.Random], None]  # a list or a map, a key or index of it


def in_tree(data: bytes, source: random.Random, step: Step) -> bytes:
    """Return the file with one change at a random place of its tree; as it is if it cannot be read."""
    try:
        tree = yaml.load(data, Loader=yaml.BaseLoader)  # makes texts, lists and maps only
    except (yaml.YAMLError, ValueError):
        return data
    places = list(_places(tree))
    if places:
        step(*source.choice(places), source)
    return yaml.safe_dump(tree, sort_keys=False, allow_unicode=True, default_flow_style=None).encode("utf-8", "replace")


def _places(tree: Any) -> Iterator[tuple[Any, Any]]:
    keys = tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    for key in keys:
        yield tree, key
        yield from _places(tree[key])


def delete_node(data: bytes, source: random.Random) -> bytes:
    return in_tree(data, source, lambda around, key, _: around.__delitem__(key))


def retype_node(data: bytes, source: random.Random) -> bytes:
    def step(around: Any, key: Any, chance: random.Random) -> None:
        old = around[key]
        around[key] = chance.choice([[old], {"x": old}, [], {}, None, str(old)[:100], [[[old]]], {"type": old}, 7])

    return in_tree(data, source, step)


def replace_scalar(data: bytes, source: random.Random) -> bytes:
    return in_tree(data, source, lambda around, key, chance: around.__setitem__(key, chance.choice(SCALARS)))


def rename_key(data: bytes, source: random.Random) -> bytes:
    def step(around: Any, key: Any, chance: random.Random) -> None:
        if isinstance(around, dict):
            new = chance.choice([f"{key}x", key[:-1], key.upper(), "type", "do", "name", "", "x" * 100, *SCALARS[-5:]])
            entries = [(new if name == key else name, value) for name, value in around.items()]
            around.clear()
            around.update(entries)

    return in_tree(data, source, step)


def reorder_keys(data: bytes, source: random.Random) -> bytes:
    def step(around: Any, key: Any, chance: random.Random) -> None:
        if isinstance(around, dict):
            entries = list(around.items())
            chance.shuffle(entries)
            around.clear()
            around.update(entries)
        else:
            chance.shuffle(around)

    return in_tree(data, source, step)


def graft(data: bytes, source: random.Random) -> bytes:
    """Put one part of the tree into the place of another."""
    taken: list[Any] = []

    def take(around: Any, key: Any, chance: random.Random) -> None:
        taken.append(around[key])

    def put(around: Any, key: Any, chance: random.Random) -> None:
        around[key] = taken[0]

    read = in_tree(data, source, take)
    return in_tree(read, source, put) if taken else read


def swap_scalars(data: bytes, source: random.Random) -> bytes:
    def step(around: Any, key: Any, chance: random.Random) -> None:
        other = chance.choice(list(_places(around)))
        around[key], other[0][other[1]] = other[0][other[1]], around[key]

    return in_tree(data, source, step)


CHANGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    *(truncate, flip_bytes, delete_bytes, insert_odd, delete_line, duplicate_line, indent_line, swap_lines),
    *(delete_node, retype_node, replace_scalar, rename_key, reorder_keys, graft, swap_scalars),
)
