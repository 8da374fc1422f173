"""Tools for tests of robots and plug-ins: virtual time, an in-process bus, findings of a text, golden files."""

from rbxcompose.testing.bench import Bench, instance
from rbxcompose.testing.clocks import clock_uses
from rbxcompose.testing.golden import Golden
from rbxcompose.testing.manifests import Checked, check_file, check_text
from rbxcompose.testing.missions import SteppedMission, compile_mission
from rbxcompose.testing.robots import Ran, run_robot
from rbxcompose.twins.servo_fake import FakeServo
from rbxcompose.twins.servo_faults import ServoFaults
from rbxcompose.twins.servo_line import FakeLine
from rbxcompose.twins.servo_port import FakePort

__all__ = [
    "Bench", "Checked", "FakeLine", "FakePort", "FakeServo", "Golden", "Ran", "ServoFaults", "SteppedMission",
    "check_file", "check_text", "clock_uses", "compile_mission", "instance", "run_robot",
]  # fmt: skip
