"""From picks to a policy: some are recorded and become a data set, of which a network learns to move the arm itself."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import String
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk.component import MissionOver
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.commands import command
from tests.conftest import ROOT
from tests.policies.learning import Array, train
from tests.policies.recordings import Timed, write_recording
from tests.soak import Soak

pytest.importorskip("av", reason="av is not installed")
parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
pytestmark = pytest.mark.timeout(120)

QUICK, MANY, RATE = 3, 10, 10
LEAST_MOTION = 5e-3  # [rad] in a frame; the others teach nothing but to wait
MISSION = "{rbx: 1, kind: Mission, name: pick, about: Pick the target up., do: [{pick_right_arm: target}]}"
PICKING = "{rbx: 1, kind: Overlay, name: picking, missions: {pick: pick.yaml}}"
LEARNED = """
rbx: 1
kind: Overlay
name: learned
components:
  learned:
    type: policy
    model: pick.onnx
    rate: %(rate)s Hz
    observes: [{topic: joint_states, joints: [%(joints)s], fields: [position]}]
    commands: {topic: arm_stream/policy, within: 0.3 s, outputs: {%(outputs)s}}
muxes:
  arm_stream:
    topic: right_arm_controller/joint_trajectory
    inputs:
      hand: {from: right_arm.stream, priority: 20, timeout: 0.5 s}
      policy: {from: learned, priority: 10, timeout: 0.5 s}
diagnostics:
  analyzers:
    motion: {match: [base_*, cmd_vel, servos, head, right_arm, learned, arm_stream]}
"""


def plan_of(folder: Path, text: str, **sets: object) -> Plan:
    """pi_robot with a target on its table, and what an overlay adds."""
    (folder / "overlay.yaml").write_text(text)
    made = compile_robot(
        str(ROOT / "robots/pi_robot"),
        profiles=["table"],
        overlays=[str(folder / "overlay.yaml")],
        sets=[f"{key}={value}" for key, value in sets.items()],
        environment={},
    )
    assert [finding for finding in made.report if finding.severity == "error"] == []
    assert made.plan
    return made.plan


def recorded_pick(folder: Path, number: int) -> Path:
    """A pick of the target at another place, as `record` keeps it."""
    place = {"scene.objects.target.at.y": f"{4 * number - 18} mm"}
    bench = Bench(plan=plan_of(folder, PICKING, start="pick", **place))
    messages: list[Timed] = []
    for topic in ("/joint_states", "/joint_commands"):

        def take(message: JointState, topic: str = topic) -> None:
            messages.append((bench.clock.now(), topic, message))

        bench.bus.subscribe("recorder", topic, JointState, Qos.EVENT, take)
    assert bench.run_until(lambda: any(isinstance(event, MissionOver) for event in bench.events), 30.0)
    assert [event.outcome for event in bench.events if isinstance(event, MissionOver)] == ["success"]
    return write_recording(folder / f"pick_{number}.mcap", messages)


@pytest.mark.soak
def test_a_network_learns_from_recorded_picks_and_moves_the_arm_through_the_mux(tmp_path: Path, soak: Soak) -> None:
    picks = soak.examples(QUICK, MANY)
    (tmp_path / "pick.yaml").write_text(MISSION)
    paths = [str(recorded_pick(tmp_path, number)) for number in range(picks)]
    words = ("--fps", str(RATE), "-o", "picks", "--task", "pick the block", "--topics", "joint_*", "--from", *paths)
    done = command("record", "--format", "lerobot", *words, environment={}, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    joints, episodes = read(tmp_path / "picks")
    assert (len(joints), len(episodes)) == (6, picks)
    states, actions = (np.concatenate(each) for each in zip(*(episode.moving for episode in episodes), strict=True))
    train(states, actions, 0.05, tmp_path / "pick.onnx")

    outputs = ", ".join(f"{joint}: {{least: -3, most: 3, jump: 0.5}}" for joint in joints)
    text = LEARNED % {"rate": RATE, "joints": ", ".join(joints), "outputs": outputs}
    bench = Bench(plan=plan_of(tmp_path, text, start="null"))
    came = bench.collect("/joint_states", JointState)
    holders = bench.collect("/arm_stream/active", String)
    bench.advance(1.0)
    assert np.abs(positions(came[-1], joints)).max() < 0.01, "it waits until it is switched on"
    policy: Any = bench.component("learned")
    assert policy.on_switch(SetBool.Request(data=True)).success
    bench.advance(12.0)
    path = np.array([positions(message, joints) for message in came])
    assert holders[-1].data == "policy"
    assert min(distance(path, episode.grasp) for episode in episodes) < 0.1, "it was where the block is grasped"
    assert min(distance(path[-50:], episode.states[-1]) for episode in episodes) < 0.05, "it ends where picks end"
    assert np.ptp(path[-50:], axis=0).max() < 0.02, "and rests there"


@dataclass(frozen=True)
class Episode:
    """What was recorded of the arm, rows x joints, and where it was when the gripper closed."""

    states: Array
    actions: Array
    grasp: Array

    @property
    def moving(self) -> tuple[Array, Array]:
        """States and actions of frames in which it moves, and of the last ones, so that it learns to stay there."""
        moves = np.abs(self.actions - self.states).max(1) > LEAST_MOTION
        moves[-3:] = True
        return self.states[moves], self.actions[moves]


def read(folder: Path) -> tuple[list[str], list[Episode]]:
    """The joints of the arm and the episodes of a data set."""
    names = json.loads((folder / "meta/info.json").read_text())["features"]["action"]["names"]
    columns = [turn for turn, name in enumerate(names) if name.startswith("right_arm")]
    gripper = names.index("right_gripper_finger_joint.pos")
    found = []
    for path in sorted(folder.glob("data/*/*.parquet")):
        table = parquet.read_table(path).to_pydict()
        states, actions = (np.array(table[name]) for name in ("observation.state", "action"))
        closed = int(np.argmax(states[:, gripper] < states[:, gripper].min() + 0.05))
        found.append(Episode(states[:, columns], actions[:, columns], states[closed, columns]))
    return [names[column].removesuffix(".pos") for column in columns], found


def positions(message: JointState, joints: list[str]) -> list[float]:
    return [float(message.position[message.name.index(joint)]) for joint in joints]


def distance(path: Array, place: Array) -> float:
    """How near a path comes to a place [rad], by the joint that is farthest."""
    return float(np.abs(path - place).max(1).min())
