"""`rbxcompose servo new-robot`, with fake servos on a pseudo-terminal."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.commands.main import main
from rbxcompose.domains.devices.serial_ports import SerialPort
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_line import FakeLine
from rbxcompose.domains.servos.twins.servo_twin import FakePort
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, Golden, check_file

AX, XL, SLOW = "AX-12", "XL430-W250", 57_600
Making = Callable[..., tuple[int, str]]


@pytest.fixture
def made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Iterator[Making]:
    """Return a function that makes the robot `arm` of servos, and returns the exit code and what was told."""
    with ExitStack() as stack:

        def make(*servos: FakeServo, more: tuple[str, ...] = ()) -> tuple[int, str]:
            port = stack.enter_context(FakePort(FakeLine(servos, SteppedClock().now), tmp_path / "servos"))
            words = ["--port", str(port.path), "--timeout", "120ms", "--last", "3", "--into", str(tmp_path)]
            code = main(["servo", "new-robot", "arm", *words, *more])
            out, err = capsys.readouterr()
            return code, (out + err).replace(str(tmp_path), "FOLDER")

        yield make


def test_a_robot_of_all_that_answers_is_written_as_people_would_write_it(
    made: Making, tmp_path: Path, golden: Golden
) -> None:
    code, told = made(FakeServo(AX, 1), FakeServo(XL, 3))
    assert code == 0
    assert "with XL430-W250 at id 3, as servo_3 and joint_3" in told
    for name in ("robot.yaml", "arm.urdf"):
        text = (tmp_path / "robots/arm" / name).read_text(encoding="utf-8").replace(str(tmp_path), "/dev")
        golden.check(f"servo_new_robot/{name}.txt", text)


def test_it_has_no_findings_and_moves_in_simulation(made: Making, tmp_path: Path) -> None:
    assert made(FakeServo(AX, 1), FakeServo(XL, 3))[0] == 0
    robot = tmp_path / "robots/arm"
    assert main(["check", "--strict", str(robot)]) == 0
    for is_real in (False, True):
        assert check_file(robot / "robot.yaml", real=is_real).text == ""
    at: dict[str, float] = {}
    bench = Bench(plan=check_file(robot / "robot.yaml").plan)
    bench.bus.subscribe(
        "me",
        "/joint_states",
        JointState,
        Qos.STATE,
        lambda message: at.update(zip(message.name, message.position, strict=True)),
    )
    command = bench.bus.publisher("me", "/joint_3/command", Float64, Qos.COMMAND)
    bench.advance(0.5)
    command(Float64(data=0.5))
    bench.advance(3.0)
    assert at == pytest.approx({"joint_1": 0.0, "joint_3": 0.5}, abs=0.01)


def test_its_port_has_the_name_that_stays(made: Making, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = "rbxcompose.domains.servos.command_actions.serial_ports"
    monkeypatch.setattr(
        path, lambda: [SerialPort(os.path.realpath(tmp_path / "servos"), ["/dev/serial/by-id/usb-FT4"])]
    )
    assert made(FakeServo(AX, 1))[0] == 0
    assert "    port: /dev/serial/by-id/usb-FT4\n" in (tmp_path / "robots/arm/robot.yaml").read_text(encoding="utf-8")


def test_nothing_is_overwritten_and_a_bad_name_is_refused(made: Making, tmp_path: Path) -> None:
    assert made(FakeServo(AX, 1))[0] == 0
    before = (tmp_path / "robots/arm/robot.yaml").read_bytes()
    code, told = made(FakeServo(XL, 2))
    assert (code, (tmp_path / "robots/arm/robot.yaml").read_bytes()) == (1, before)
    assert "RBX9101" in told
    assert main(["servo", "new-robot", "My Arm", "--port", "nowhere"]) == 1


def test_servos_at_another_rate_are_left_out_with_the_way_to_change_it(made: Making, tmp_path: Path) -> None:
    slow = FakeServo(XL, 1, baud=SLOW)
    code, told = made(FakeServo(AX, 1), FakeServo(AX, 2), slow)
    assert code == 0
    assert "warning[RBX2250]: the XL430-W250 at id 1 has 57600 bit/s, the bus 1000000; it is left out" in told
    assert "rbxcompose servo set-id 1 3 --port FOLDER/servos --baud 57600" in told
    assert "rbxcompose servo write 3 baud=3 --port FOLDER/servos --baud 57600" in told
    where = ["--port", str(tmp_path / "servos"), "--baud", "57600", "--timeout", "200ms"]
    assert main(["servo", "set-id", "1", "3", *where]) == 0
    assert main(["servo", "relax", "3", *where]) == 0
    assert main(["servo", "write", "3", "baud=3", *where]) == 0
    assert slow.baud == 1_000_000


def test_clashes_and_unknown_models_are_left_out_and_told(made: Making, tmp_path: Path) -> None:
    strange = FakeServo(AX, 3)
    strange.set("model_number", 4242)
    code, told = made(FakeServo(AX, 1), FakeServo(AX, 2), FakeServo(AX, 2), strange)
    assert code == 1
    assert "more than one servo answers at id 2 with 1000000 bit/s; it is left out" in told
    assert "the servo at id 3 is model 4242, which is not known" in told
    text = (tmp_path / "robots/arm/robot.yaml").read_text(encoding="utf-8")
    assert "servo_1:" in text
    assert "servo_2:" not in text


def test_one_id_in_both_protocols_is_a_clash(made: Making, tmp_path: Path) -> None:
    code, told = made(FakeServo(AX, 1), FakeServo(XL, 1))
    assert code == 1
    assert "RBX2209" in told
    assert not (tmp_path / "robots").exists()


def test_a_port_without_servos_makes_no_robot(made: Making, tmp_path: Path) -> None:
    code, told = made()
    assert code == 1
    assert "RBX2208" in told
    assert not (tmp_path / "robots").exists()


def test_what_was_made_is_told_in_json(made: Making) -> None:
    _, told = made(FakeServo(XL, 2), more=("--json",))
    assert json.loads(told) == {
        "files": ["FOLDER/robots/arm/robot.yaml", "FOLDER/robots/arm/arm.urdf"],
        "baud": 1_000_000,
        "servos": [{"id": 2, "protocol": 2, "model": XL}],
    }
