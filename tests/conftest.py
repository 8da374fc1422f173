"""Fixtures for all tests."""

from __future__ import annotations

import atexit
import fcntl
import gc
import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Generator, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers
from xdist.scheduler import LoadScopeScheduling

from rbxcompose.testing.golden import Golden
from tests.side_by_side import OTHERS, group_of, scope_of, turn_of
from tests.soak import Soak

ROOT = Path(__file__).parents[1]
collect_ignore = ["misconfig/wrong", "misconfig/right"]  # hundreds of manifests, in which there is no test

LONGEST = 180.0  # [s] of a test of real processes, on a busy machine
CACHES = "RBXCOMPOSE_TEST_CACHES"
WITH_ARMS = tuple(
    f"tests/{start}"
    for start in (
        "cli/test_arm",
        *(f"components/test_{start}" for start in ("arm", "cloud", "con", "fail", "head", "move", "pick", "s")),
        "interop/",
        "motion/",
        "policies/test_learning",
        "robots/",
        "testing/",
    )
)


def pytest_configure(config: pytest.Config) -> None:
    """Give all workers a folder of caches that goes with the run; say how many examples to try; keep bytecode."""
    gc.disable()  # thousands of tests are collected, which stay: looking for garbage among them takes half of the time
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    config.addinivalue_line("markers", "soak: takes long, and runs under --soak alone")
    many = bool(config.getoption("--soak"))
    settings.register_profile(
        "rbxcompose",
        max_examples=300 if many else 5,
        derandomize=not many,  # what `make test` says does not depend on luck; `make soak` looks for what nobody tried
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow],  # it is the machine that is slow, as with deadlines
    )
    settings.load_profile("rbxcompose")
    if not many:
        # Hypothesis also draws constants of the modules that a worker happens to have imported, and in a new checkout
        # each worker would read all of these for 8 s.
        vars(providers)["_get_local_constants"] = lambda: providers._local_constants
    os.environ.setdefault("NUMBA_CACHE_DIR", str(ROOT / ".numba_cache"))  # compiling takes longer than most tests may
    if CACHES not in os.environ:
        os.environ[CACHES] = os.environ["XDG_CACHE_HOME"] = tempfile.mkdtemp()
        atexit.register(shutil.rmtree, os.environ[CACHES], ignore_errors=True)


class Crashes:
    """How many workers a test has ended, for the plug-in that tries tests again: a file of each that ended any.

    Its own keeper of them is asked twice for each test, over a socket: 4 ms of processor time, and 40 ms until the
    second of two short messages may follow the first.
    """

    def file(self, nodeid: str) -> Path:
        return Path(os.environ[CACHES], f"crashes-{hashlib.sha256(nodeid.encode()).hexdigest()}")

    def get_test_failures(self, nodeid: str) -> int:
        file = self.file(nodeid)
        return file.stat().st_size if file.exists() else 0

    def set_test_reruns(self, nodeid: str, reruns: int) -> None:
        """Keep nothing: the scheduler takes up each test that ended a worker."""


def pytest_sessionstart(session: pytest.Session) -> None:
    if "PYTEST_XDIST_WORKER" in os.environ:
        session.config.failures_db.sock.close()  # type: ignore[attr-defined]
        session.config.failures_db = Crashes()  # type: ignore[attr-defined]


@pytest.hookimpl(optionalhook=True)
def pytest_handlecrashitem(crashitem: str) -> None:
    """Note that a test has ended a worker."""
    with Crashes().file(crashitem).open("a") as file:
        file.write("x")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Let one worker compile the tests and the package of a new checkout, instead of each of them at the same time."""
    with open(Path(os.environ[CACHES], "collecting"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if any(ROOT.glob("tests/worlds/__pycache__/*-pytest-*")):  # of a folder that is collected late
            fcntl.flock(lock, fcntl.LOCK_UN)
        return (yield)


def pytest_collection_finish(session: pytest.Session) -> None:
    """Leave what was collected out of the search for garbage; compile what arms need before any test.

    On a busy machine, compiling takes longer than a test may: one worker does, the others begin with other tests.
    """
    gc.enable()
    gc.freeze()
    gc.set_threshold(50_000, 10, 100)  # a tenth of the time of all tests went into looking for garbage
    if not session.config.option.collectonly and any(item.nodeid.startswith(WITH_ARMS) for item in session.items):
        with suppress(BlockingIOError):
            compile_for_arms(fcntl.LOCK_NB)


def pytest_sessionfinish() -> None:
    """Look for garbage once: pytest does so five times at the end, among all that thousands of tests have left."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Wait for what is compiled outside of the time that a test has; leave those of real time the processors."""
    if "PYTEST_XDIST_WORKER" in os.environ and not group_of(item.nodeid):
        be_nice()
    if item.nodeid.startswith(WITH_ARMS):
        compile_for_arms()
    return (yield)


@cache
def be_nice() -> None:
    """Let the tests of other workers go first."""
    os.nice(OTHERS)


@cache
def compile_for_arms(flags: int = 0) -> None:
    """Compile what arms need, or take it from the worker that has."""
    from rbxcompose.domains.arms.motion.numba_cache import keep_libraries
    from tests.motion.toy_arm import compile_all

    with open(Path(os.environ[CACHES], "compiling"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | flags)
        compile_all()
        keep_libraries()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Begin with what takes longest; let tests try again, since a busy machine keeps no deadline.

    Those of real processes try three times; many others start a program or a session as well, and try twice. The
    summary lists each test that did. What a test decides without the machine fails again.
    """
    if not config.getoption("--soak"):
        config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("soak")])
        items[:] = [item for item in items if not item.get_closest_marker("soak")]
    items.sort(key=lambda item: turn_of(item.nodeid))
    for item in items:
        is_real = group_of(item.nodeid) is not None
        item.add_marker(pytest.mark.flaky(reruns=2 if is_real else 1))
        if is_real and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(LONGEST))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="write golden files")
    parser.addoption("--soak", action="store_true", help="try many more random examples, and keep the figures")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return how many workers `-n auto` starts: two beside the processors, since two of them mostly wait."""
    return (os.cpu_count() or 1) + 2


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    """Say how tests are given to the workers of `pytest -n`."""
    config.option.loadscopereorder = False
    scheduling = LoadScopeScheduling(config, log)
    scheduling._split_scope = scope_of
    return scheduling


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Golden:
    """Golden files in the folder `golden` beside the test."""
    return Golden(request.path.parent / "golden", update=bool(request.config.getoption("--update-golden")))


@pytest.fixture
def repository(monkeypatch: pytest.MonkeyPatch) -> Path:
    """The repository's root, as the current directory, so that findings name files as a person would see them."""
    monkeypatch.chdir(ROOT)
    return ROOT


@pytest.fixture(scope="session")
def soak(request: pytest.FixtureRequest) -> Iterator[Soak]:
    """How many examples random tests try, and where they tell what they found."""
    soak = Soak(is_on=bool(request.config.getoption("--soak")))
    yield soak
    if soak.is_on:
        soak.write()
