"""No change of a manifest makes the compiler raise or hang: it is refused with places, or it is a robot."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.mutate.mutants import mutant, originals
from tests.mutate.project import Found, Project
from tests.soak import Soak

FOUND = Path(__file__).parent / "found"
QUICK, MANY = 12, 20_000
OFTEN = ("robots/rooms/robot.yaml", "robots/turtlebot/robot.yaml")
"""Robots that are tried without `--soak`."""


def try_seeds(seeds: range) -> Found:
    with TemporaryDirectory() as folder:
        return Project(Path(folder)).try_all(seeds)


def try_on_all_cores(count: int) -> Found:
    found, cores = Found(), os.cpu_count() or 1
    # Fresh processes: this one may have threads, with which it must not fork.
    with ProcessPoolExecutor(cores, mp_context=get_context("spawn")) as pool:
        for part in pool.map(try_seeds, [range(first, count, cores) for first in range(cores)]):
            found.add(part)
    return found


def keep(found: Found) -> None:
    """Write down what failed, so that it is tried from now on."""
    for one, _ in found.failures.values():
        path = FOUND / str(one.seed) / one.file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(one.data)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory, soak: Soak) -> Project:
    return Project(tmp_path_factory.mktemp("project"), () if soak.is_on else OFTEN)


@pytest.mark.timeout(0)
def test_a_mutant_is_refused_with_a_place_or_is_a_robot(project: Project, soak: Soak) -> None:
    count = soak.examples(QUICK, MANY)
    found = try_on_all_cores(count) if soak.is_on else project.try_all(range(count))
    keep(found)
    soak.tell(
        "mutants of manifests", found.examples, len(found.failures), f"{found.refused:,} refused, the rest robots"
    )
    told = [f"seed {one.seed}, {one.file}: {one.what}\n{text}" for one, text in found.failures.values()]
    assert not told, "\n".join(told)
    assert found.refused > count / 3  # else the mutants would be too tame to tell anything
    assert found.examples - found.refused > count / 50


KEPT = sorted(path for path in FOUND.iterdir() if path.is_dir()) if FOUND.exists() else []


@pytest.mark.parametrize("folder", KEPT, ids=lambda path: path.name)
def test_what_once_failed_does_not_any_more(folder: Path, project: Project) -> None:
    project.judge({str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()})


def test_a_seed_gives_the_same_mutant_again() -> None:
    files = originals()
    assert [mutant(seed, files) for seed in range(20)] == [mutant(seed, files) for seed in range(20)]


def test_what_is_not_changed_has_no_finding(project: Project) -> None:
    assert {name: list(out.report) for name, out in project.unchanged.items() if list(out.report)} == {}
