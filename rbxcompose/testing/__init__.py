"""Tools for tests of robots and plug-ins: virtual time, an in-process bus, findings of a text, golden files."""

from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_faults import ServoFaults
from rbxcompose.domains.servos.twins.servo_line import FakeLine
from rbxcompose.domains.servos.twins.servo_twin import FakePort
from rbxcompose.testing.bench import Bench, Ran, instance, run_robot
from rbxcompose.testing.clocks import clock_uses
from rbxcompose.testing.golden import Golden
from rbxcompose.testing.manifests import Checked, SteppedMission, check_file, check_text, compile_mission

__all__ = [
    "Bench", "Checked", "FakeLine", "FakePort", "FakeServo", "Golden", "Ran", "ServoFaults", "SteppedMission",
    "check_file", "check_text", "clock_uses", "compile_mission", "instance", "run_robot",
]  # fmt: skip
