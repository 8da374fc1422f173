"""A policy that commands joints at 50 Hz, and a data set of four cameras."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.measuring import COMMAND, Row, processor_time, program, timed
from rbxcompose.domains.policies.components.policy import PolicyNetwork
from rbxcompose.runtime.processes import titled
from tests.policies.networks import network

MEASURES = ("rbxcompose/domains/policies", "rbxcompose/runtime", "rbxcompose/tools/datasets.py")
ROOT = Path(__file__).parents[1]
RATE, SECONDS = 50, 20
CAMERAS, PICTURES = 4, 15  # and pictures per second of each
OVERLAY = f"""
rbx: 1
kind: Overlay
name: measured
components:
  steer:
    type: policy
    model: steer.onnx
    rate: {RATE} Hz
    starts: true
    observes: [{{topic: joint_states, joints: [head_pan_joint, head_tilt_joint], fields: [position]}}]
    commands:
      topic: head_controller/joint_trajectory
      outputs: {{head_pan_joint: {{least: -1, most: 1, jump: 1}}, head_tilt_joint: {{least: -1, most: 1, jump: 1}}}}
"""
PICTURE = "{{type: test_picture, width: 640, height: 480, rate: {rate} Hz, topic: camera_{number}/image}}"


@contextmanager
def _up(folder: Path, overlay: str) -> Iterator[Mapping[str, str]]:
    """Have `head_only` up with an overlay; yield what its commands need in their environment."""
    (folder / "overlay.yaml").write_text(overlay, encoding="utf-8")
    environment = {"XDG_RUNTIME_DIR": str(folder)}
    program([*COMMAND, "up", "-d", str(ROOT / "robots/head_only"), "-f", str(folder / "overlay.yaml")], environment)()
    try:
        yield environment
    finally:
        program([*COMMAND, "down"], environment)()


def _share(folder: Path) -> tuple[float, float]:
    """Return the share of a core that the process of a policy takes, and that of its inference alone [%]."""
    path = network(folder / "steer.onnx", np.eye(2), [0, 0])
    with _up(folder, OVERLAY):
        [process] = titled("rbxcompose head_only: policy")
        time.sleep(1.0)
        before, began = processor_time(process.pid), time.monotonic()
        time.sleep(SECONDS)
        share = (processor_time(process.pid) - before) / (time.monotonic() - began)
    made = PolicyNetwork(path)
    return 100 * share, 100 * RATE * timed(lambda: made.answer([0.1, 0.2]), 500).median


def _kept(folder: Path) -> tuple[float, float]:
    """Return the share of pictures that a data set has of those that cameras made, and what the recorder takes [%]."""
    cameras = "".join(f"  c{n}: {PICTURE.format(rate=PICTURES, number=n)}\n" for n in range(CAMERAS))
    with _up(folder, f"rbx: 1\nkind: Overlay\nname: measured\ncomponents:\n{cameras}") as environment:
        words = ["record", "--format", "lerobot", "-o", "data", "--fps", str(PICTURES), "--for", f"{SECONDS}s"]
        recorder = subprocess.Popen(
            [*COMMAND, *words],
            cwd=folder,
            env={**os.environ, **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        time.sleep(SECONDS / 2)
        before, began = processor_time(recorder.pid), time.monotonic()
        time.sleep(SECONDS / 4)
        share = (processor_time(recorder.pid) - before) / (time.monotonic() - began)
        told, _ = recorder.communicate(timeout=60)
    if recorder.returncode != 0:
        raise RuntimeError(f"nothing was recorded: {told}")
    info = json.loads((folder / "data/meta/info.json").read_text(encoding="utf-8"))
    lines = [line.split() for line in told.splitlines() if line.startswith("/camera_")]
    if len(lines) != CAMERAS or sum("images" in name for name in info["features"]) != CAMERAS:
        raise RuntimeError(f"not all cameras were recorded: {told}")
    fewest = min(int(line[-1]) for line in lines)
    frames = info["total_frames"] + 1  # the last one lacks the command after it
    return 100 * min(fewest, frames) / (SECONDS * PICTURES), 100 * share


def rows() -> list[Row]:
    """Return what a policy takes and what a data set keeps."""
    with TemporaryDirectory() as folder:
        share, inference = _share(Path(folder))
    with TemporaryDirectory() as folder:
        kept, recorder = _kept(Path(folder))
    return [
        Row(
            name=f"policy: two joints at {RATE} Hz",
            unit="% of a core",
            how=f"its process: observations, the network ({inference:.1f} %), judging, trajectories",
            ours=share - inference,
            most=10,
        ),
        Row(
            name=f"data set: {CAMERAS} cameras of 640 x 480 at {PICTURES} Hz",
            unit="% of pictures",
            how=f"those of the camera with fewest that are in it; the recorder took {recorder:.0f} % of a core",
            ours=kept,
            least=99,
        ),
    ]
