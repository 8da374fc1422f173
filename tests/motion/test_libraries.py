"""Libraries of compiled functions: they answer as numba's own, to the last bit, and only what they were made for."""

from __future__ import annotations

import subprocess
import sys
from math import sqrt
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from rbxcompose.domains.arms.motion import numba_cache
from rbxcompose.domains.arms.motion.compiled_collisions import near_pairs, workspace
from rbxcompose.domains.arms.motion.library import Library, flat
from rbxcompose.domains.arms.motion.numba_cache import CompiledFunction, borrowed, can_link, compiled, inlined, is_empty
from tests.motion.toy_arm import fast_planner
from tests.soak import rare

Array = NDArray[np.float64]
pytestmark = pytest.mark.skipif(not can_link(), reason="there is no linker")


class Pair(NamedTuple):
    values: Array
    weight: float


@inlined
def root(value: float) -> float:
    return sqrt(value)


@compiled
def weighted(pair: Pair, table: Array, found: Array, times: int) -> int:
    """Write sums that need memory of its own, and return how many entries they have."""
    values = borrowed(pair.values)
    own = np.empty(len(values))
    for index in range(len(own)):
        own[index] = values[index] * pair.weight * times + root(table[index, 1])
    for index in range(len(own)):
        found[index] = own[index]
    return len(own)


def asked(function: Any, table: Array, weight: float = 0.1) -> tuple[int, list[float]]:
    found = np.zeros(3)
    return function(Pair(np.array([1.0, 2.0, 3.0]), weight), table, found, 3), found.tolist()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the library of the function above."""
    made = tmp_path_factory.mktemp("libraries")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(numba_cache, "cache_folder", lambda: str(made))
        patch.setattr(numba_cache, "_made", [])
        maker = CompiledFunction(cast(CompiledFunction, weighted).function, is_kept=True)
        assert is_empty()
        asked(maker, np.ones((3, 2)))
        numba_cache.keep_libraries()
        assert not is_empty()
    return made


@pytest.fixture
def kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> CompiledFunction:
    """Return the function above, in a library."""
    monkeypatch.setattr(numba_cache, "cache_folder", lambda: str(folder))
    return CompiledFunction(cast(CompiledFunction, weighted).function, is_kept=True)


TABLE = np.array([[1.0, 2.0], [3.0, 5.0], [7.0, 11.0]])


def test_a_library_answers_as_numba(kept: CompiledFunction) -> None:
    found = asked(kept, TABLE)
    assert "dispatcher" not in vars(kept)
    assert found == asked(kept.dispatcher, TABLE)


@pytest.mark.parametrize(
    "table", [np.asfortranarray(TABLE), *rare(TABLE.astype(np.float32), np.repeat(TABLE, 2, 0)[::2])]
)
def test_other_arrays_are_left_to_numba(kept: CompiledFunction, table: Array) -> None:
    assert asked(kept, table) == asked(kept.dispatcher, TABLE.astype(table.dtype))
    assert "dispatcher" in vars(kept)


@pytest.mark.parametrize("value", [1, True, np.float32(1), "1", TABLE.T, np.zeros((1, 1, 1, 1))])
def test_only_what_a_library_takes_has_its_kind(value: object) -> None:
    assert flat(value)[0] != flat(1.0)[0]
    assert flat((1.0, value))[0] != flat((1.0, 1.0))[0]


def test_a_block_has_the_address_of_an_array() -> None:
    for array in (TABLE, TABLE[1:], np.empty(0), np.frombuffer(b"12345678")):
        assert np.frombuffer(flat(array)[1], dtype=np.int64)[4] == array.ctypes.data


def test_the_search_is_the_same_to_the_last_bit() -> None:
    checker: Any = fast_planner().checker
    numba_cache.keep_libraries()
    function, points = cast(CompiledFunction, near_pairs), fast_planner().space.samples(200, 1)
    path = function.library_path
    assert path is not None
    assert path.is_file()
    answers = []
    for called in (CompiledFunction(function.function, is_kept=True), function.dispatcher):
        found = np.zeros((4096, 2), dtype=np.int64)
        answers.append((called(checker._model, points, found, workspace(checker._model)), found.tolist()))
    assert answers[0] == answers[1]
    assert Library(path).kinds


def test_a_process_that_has_a_library_imports_neither_numba_nor_llvm() -> None:
    fast_planner()
    numba_cache.keep_libraries()
    code = "import sys; from tests.motion.toy_arm import fast_planner; fast_planner(); print({*sys.modules})"
    modules = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert "'numba'" not in modules
    assert "'llvmlite'" not in modules
