"""Frames of links by compiled code: they are where our own kinematics have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.arms.motion.compiled_collisions import chain_of, link_frames
from rbxcompose.domains.arms.motion.numba_cache import cache_folder
from tests.body.kinematics import matrix
from tests.motion.test_inverse_kinematics import ARM, DESCRIPTION, GROUP, SPACE

LINKS = list(DESCRIPTION.body.links)


@given(st.integers(0, 2**31), st.sets(st.sampled_from(LINKS)))
def test_frames_are_those_of_our_own_kinematics(seed: int, links: set[str]) -> None:
    assert GROUP is not None
    values = SPACE.samples(1, seed)[0]
    chain, index = chain_of(DESCRIPTION.body, GROUP, {}, links)
    frames = link_frames(chain, values)
    poses = ARM.poses(values)
    assert links <= index.keys()
    for link, row in index.items():
        assert np.allclose(frames[row], matrix(poses[link])[:3], atol=1e-12)


def test_compiled_code_is_kept_for_this_user_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ask = cache_folder.__wrapped__
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = Path(ask())
    assert folder.parent == tmp_path / "rbxcompose/numba"
    folder.chmod(0o777)
    assert ask() == ""
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert ask() == ""
