"""Transforms: look-ups in a chain of frames, and what it costs to publish frames that move."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from benchmarks.measuring import Row, in_turns
from benchmarks.numpy_frames import NumpyFrames
from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.base.transforms import TransformTree
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

MEASURES = ("rbxcompose/base", "rbxcompose/msgs", "rbxcompose/domains/body")

FRAMES, RATE, MANY = 12, 50, 200  # look-ups per sample
JOINTS, STEP = 30, 1_000_000_000 // RATE  # [ns]
ROUNDS = 25
LIMITS = '<limit lower="-3" upper="3" effort="1" velocity="9"/>'


def rows() -> list[Row]:
    """Return the figures of transforms."""
    tree, peer = _trees()
    last, between = f"frame_{FRAMES}", 5 * 1_000_000_000 + STEP // 3
    return [
        _beside(
            f"newest pose through {FRAMES} frames",
            lambda: tree.lookup("frame_0", last),
            lambda: peer.lookup("frame_0", last),
            f"theirs: {FRAMES} products of 4x4 matrices that are ready",
            least_ratio=0.75,
        ),
        _beside(
            f"pose at a time through {FRAMES} frames",
            lambda: tree.lookup_at("frame_0", last, between),
            lambda: peer.lookup("frame_0", last, between),
            f"interpolated; 10 s at {RATE} Hz are remembered; theirs: 4x4 matrices, bisect, slerp",
            least_ratio=2,
        ),
        _publishing(),
    ]


def _beside(name: str, ours: Callable[[], object], theirs: Callable[[], object], how: str, least_ratio: float) -> Row:
    mine, peer = in_turns(_many(ours), _many(theirs), rounds=ROUNDS)
    return Row(
        name=name,
        unit="1/s",
        how=how,
        ours=MANY / mine.median,
        peer=MANY / peer.median,
        against="numpy",
        least_ratio=least_ratio,
    )


def _many(job: Callable[[], object]) -> Callable[[], object]:
    def run() -> None:
        for _ in range(MANY):
            job()

    return run


def _trees() -> tuple[TransformTree, NumpyFrames]:
    random, tree, peer = np.random.default_rng(1), TransformTree(), NumpyFrames()
    for index in range(FRAMES):
        parent, child = f"frame_{index}", f"frame_{index + 1}"
        for step in range(10 * RATE + 1):
            x, y, z, roll, pitch, yaw = map(float, random.uniform(-1.0, 1.0, 6))
            pose, stamp = Transform3((x, y, z), quaternion_from_rpy(roll, pitch, yaw)), step * STEP
            tree.set(parent, child, pose, stamp=step / RATE, static=False, measured=stamp)
            peer.set(parent, child, np.array(pose.translation), np.array(pose.rotation), stamp)
    time = 5 * 1_000_000_000 + STEP // 3
    ours, theirs = tree.lookup_at("frame_0", f"frame_{FRAMES}", time), peer.lookup("frame_0", f"frame_{FRAMES}", time)
    if not np.allclose(ours.translation, theirs[:3, 3]):
        raise ValueError("the two differ")
    return tree, peer


def _publishing() -> Row:
    """Return what a second of `transforms` costs, as a component of a host, beside numpy and rosbags."""
    robot = Bench(instance("transforms", "transforms", {"urdf": _urdf()}))
    send = robot.bus.publisher("source", "/joint_states", JointState, Qos.STATE)
    sent: list[int] = []
    robot.bus.subscribe("taker", "/tf", TFMessage, Qos.STATE, lambda message: sent.append(len(encode(message))))
    names = tuple(f"joint_{index}" for index in range(JOINTS))

    def second() -> None:
        for step in range(RATE):
            send(JointState(name=names, position=np.full(JOINTS, step / RATE)))
            robot.advance(1 / RATE)

    ours, peer = in_turns(second, _theirs(), rounds=ROUNDS)
    if len(sent) < RATE * ROUNDS:
        raise ValueError("messages were lost")
    return Row(
        name=f"publish {JOINTS} moving frames at {RATE} Hz",
        unit="% of a core",
        how="`transforms` in a host, robot time stepped, messages encoded; theirs computes the same and writes as much",
        ours=100 * ours.median,
        p99=100 * ours.p99,
        peer=100 * peer.median,
        against="numpy and rosbags",
        most_ratio=1.25,
    )


def _theirs() -> Callable[[], object]:
    store = get_typestore(Stores.ROS2_JAZZY)
    types, axis = store.types, np.array([0.0, 0.0, 1.0])

    def made(index: int, angle: float) -> Any:
        turn = np.append(np.sin(angle / 2) * axis, np.cos(angle / 2))
        stamp = types["builtin_interfaces/msg/Time"](sec=1, nanosec=0)
        header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=f"link_{index}")
        vector = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.1)
        pose = types["geometry_msgs/msg/Transform"](vector, types["geometry_msgs/msg/Quaternion"](*map(float, turn)))
        return types["geometry_msgs/msg/TransformStamped"](header, f"link_{index + 1}", pose)

    def second() -> None:
        for step in range(RATE):
            links = [made(index, step / RATE) for index in range(JOINTS)]
            store.serialize_cdr(types["tf2_msgs/msg/TFMessage"](links), "tf2_msgs/msg/TFMessage")

    return second


def _urdf() -> str:
    links = "".join(f'<link name="link_{index}"/>' for index in range(JOINTS + 1))
    joints = "".join(
        f'<joint name="joint_{index}" type="revolute"><parent link="link_{index}"/><child link="link_{index + 1}"/>'
        f'<origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>{LIMITS}</joint>'
        for index in range(JOINTS)
    )
    return f'<robot name="many">{links}{joints}</robot>'
