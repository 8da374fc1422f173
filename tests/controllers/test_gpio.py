"""The controller of items of servos: lights and ports, with and without a joint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.domains.servos.controllers.gpio import GpioConfig, GpioController
from rbxcompose.msgs.std_msgs import Bool, Float64
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.testing import Bench, instance
from rbxcompose.testing.golden import Golden
from rbxcompose.testing.manifests import Checked, check_text

LAMP: dict[str, Any] = {"type": "gpio", "actuator": "pan", "item": "led", "direction": "out"}
PUMP = {"type": "gpio", "actuator": "extra", "item": "external_port_data_1", "direction": "out"}
RANGE = PUMP | {"item": "external_port_data_2", "direction": "in", "input": "analog"}
HEAT = LAMP | {"item": "present_temperature", "direction": "in"}
SERVOS = {"pan": {"id": 1, "model": "AX-12"}, "extra": {"id": 2, "model": "XM540-W270"}}
JOINT = {"lower": -1.0, "upper": 1.0, "velocity": 1.0, "acceleration": 8.0, "servos": [SERVOS["pan"]]}
CONTROLLERS = {"lamp": LAMP, "pump": PUMP, "range": RANGE, "heat": HEAT}


class Lit:
    """Two servos, one of which drives no joint, and the items that are used."""

    def __init__(self, *names: str, joints: bool = True) -> None:
        setups = {name: {"type": "gpio", "settings": CONTROLLERS[name]} for name in names}
        used = {one: SERVOS[one] for one in {CONTROLLERS[name]["actuator"] for name in names}}
        driven = {"pan_joint": JOINT} if joints else {}
        config = {"twin": "servo", "joints": driven, "controllers": setups, "used": used}
        self.robot = Bench(instance("servos", "servo_bus", config))
        self.driver: Any = self.robot.component("servos")
        self.answers: list[Any] = []
        self.robot.advance(0.3)

    def servo(self, id_: int) -> Any:
        return self.driver.cycle.bus.line[id_]

    def switch(self, name: str, is_on: bool) -> None:
        self.robot.publish(f"/{name}/command", Bool(data=is_on))
        self.robot.advance(0.2)

    def ask(self, name: str, is_on: bool) -> Any:
        self.robot.bus.client("me", f"/{name}/set", SetBool)(SetBool.Request(data=is_on), self.answers.append)
        self.robot.advance(0.2)
        return self.answers[-1].response


@pytest.mark.parametrize("joints", [True, False])
def test_only_a_bus_with_joints_is_expected_to_publish_where_they_are(joints: bool) -> None:
    lit = Lit("pump", joints=joints)
    found = lit.robot.statuses("servos: joint_states")
    lit.robot.advance(8.0)
    assert {status.level for status in found} == ({Level.OK} if joints else set())


def test_a_light_is_switched_by_topic_and_by_service_while_its_servo_drives_a_joint() -> None:
    lit = Lit("lamp")
    assert lit.servo(1).get("led") == 0
    lit.switch("lamp", True)
    assert lit.servo(1).get("led") == 1
    assert lit.ask("lamp", False).success
    assert lit.servo(1).get("led") == 0
    lit.robot.publish("/pan_joint/command", Float64(data=0.5))
    lit.robot.advance(2.0)
    assert lit.ask("lamp", True).success
    assert lit.servo(1).get("led") == 1
    assert lit.servo(1).get("torque_enable") == 1


@pytest.mark.parametrize("joints", [True, False])
def test_a_servo_without_a_joint_has_ports_whose_modes_are_set(joints: bool) -> None:
    lit = Lit("pump", "range", joints=joints)
    voltages = lit.robot.collect("/range/state", Float64)
    servo = lit.servo(2)
    assert (servo.get("external_port_mode_1"), servo.get("external_port_mode_2")) == (1, 0)
    servo.set("external_port_data_2", 4095)
    lit.switch("pump", True)
    assert servo.get("external_port_data_1") == 1
    lit.robot.advance(1.0)
    assert voltages[-1].data == pytest.approx(3.3)
    assert 10 <= len(voltages) <= 14


def test_inputs_are_in_the_unit_of_their_item() -> None:
    lit = Lit("heat")
    temperatures = lit.robot.collect("/heat/state", Float64)
    lit.robot.advance(1.0)
    assert 20.0 < temperatures[-1].data < 50.0


def test_what_is_not_confirmed_is_written_again_and_told() -> None:
    lit = Lit("pump")
    servo = lit.servo(2)
    servo.faults.is_mute = True
    lit.switch("pump", True)
    controller = lit.driver.controllers.controllers["pump"]
    assert "did not take 'external_port_data_1'" in controller.note
    servo.faults.is_mute = False
    lit.robot.advance(0.3)
    assert servo.get("external_port_data_1") == 1
    assert not controller.note


def test_a_servo_that_has_lost_its_supply_is_switched_again_when_its_bus_is_back() -> None:
    lit = Lit("lamp")
    lit.switch("lamp", True)
    lit.servo(1).set("led", 0)
    lit.driver.prepare()
    lit.robot.advance(0.2)
    assert lit.servo(1).get("led") == 1


def test_a_stop_leaves_outputs_as_they_are_and_refuses_changes() -> None:
    lit = Lit("lamp")
    lit.switch("lamp", True)
    lit.robot.host.stop()
    lit.robot.advance(0.2)
    lit.switch("lamp", False)
    answer = lit.ask("lamp", False)
    assert (answer.success, answer.message) == (False, "the robot is stopped")
    assert lit.servo(1).get("led") == 1


@pytest.mark.parametrize(
    ("settings", "field"),
    [(LAMP, ""), (RANGE, ""), (PUMP | {"input": "pull_up"}, "input"), (HEAT | {"input": "analog"}, "input")],
)
def test_an_input_is_for_ports_that_are_read(settings: dict[str, Any], field: str) -> None:
    mistake = GpioController.mistake(GpioConfig.model_validate(settings))
    assert (mistake[0] if mistake else "") == field


# A robot in YAML

ROBOT = """rbx: 1
kind: Robot
name: lamp
buses:
  servos: {type: dynamixel}
actuators:
  pan: {bus: servos, model: XL430-W250, id: 1}
controllers:
  lamp: {type: gpio, actuator: pan, item: led, direction: out}
"""
WRONG = {
    "a misspelt item": ROBOT.replace("item: led", "item: lde"),
    "an item that moves": ROBOT.replace("item: led", "item: goal_position"),
    "a port that the model lacks": ROBOT.replace("item: led", "item: external_port_data_1"),
    "an item that is not there to read": ROBOT.replace("item: led, direction: out", "item: voltage, direction: in"),
    "a servo that does not exist": ROBOT.replace("actuator: pan", "actuator: pna"),
    "an input of an output": ROBOT.replace("out}", "out, input: analog}"),
}
MISSION = "rbx: 1\nkind: Mission\nname: shine\ndo:\n  - lamp: true\n  - lamp: false\n"


def check(folder: Path, text: str, **others: str) -> Checked:
    return check_text(text, folder, others=others)


def test_each_mistake_is_told_at_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden) -> None:
    monkeypatch.chdir(tmp_path)
    told = {name: check(tmp_path, text).text for name, text in WRONG.items()}
    golden.check("gpio.txt", "\n".join(f"--- {name}\n{text}" for name, text in told.items()))


def test_a_bus_knows_servos_without_joints_and_missions_switch_their_lights(tmp_path: Path) -> None:
    checked = check_text(ROBOT + "missions: {shine: shine.yaml}\n", tmp_path, others={"shine.yaml": MISSION})
    assert checked.codes == []
    config: Any = next(one.config for one in checked.plan.instances if one.type == "servo_bus")
    assert {id_: model.name for id_, model in config.lone.items()} == {1: "XL430-W250"}
    assert list(config.controllers) == ["lamp"]


def test_a_bus_has_the_controllers_of_its_own_servos_only(tmp_path: Path) -> None:
    text = ROBOT.replace("  servos: {", "  other: {type: dynamixel}\n  servos: {")
    text = text.replace(
        "controllers:\n", "controllers:\n  eye: {type: gpio, actuator: far, item: led, direction: in}\n"
    )
    text = text.replace("  pan: {", "  far: {bus: other, model: AX-12, id: 1}\n  pan: {")
    checked = check(tmp_path, text)
    assert checked.codes == []
    buses: dict[str, Any] = {one.name: one.config for one in checked.plan.instances if one.type == "servo_bus"}
    assert {name: list(config.controllers) for name, config in buses.items()} == {"other": ["eye"], "servos": ["lamp"]}
