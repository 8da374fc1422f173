"""Each examination on made-up facts: what is fine is told as fine, what is wrong as a finding with what to do."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from rbxcompose import __version__
from rbxcompose.base.findings import Finding
from rbxcompose.base.plugins import Plugins
from rbxcompose.bus.graph import Graph, GraphEnd, GraphName, WireType
from rbxcompose.bus.wire import RosQos
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.devices.serial_ports import SerialPort, UsbDevice
from rbxcompose.runtime.folder import ClockOffset, RobotFolder, RobotState
from rbxcompose.runtime.processes import Process, boot_id
from rbxcompose.tools import doctor as machine
from rbxcompose.tools.doctor import (
    EXAMINATIONS,
    PLUGINS,
    BusFacts,
    Clocks,
    ExaminationResult,
    HostFacts,
    Listener,
    ResourceLimits,
    RunningRobot,
    Version,
    examination,
    examine_all,
    has_errors,
)
from tests.third_party.places import put, see

HERE = Process.of(os.getpid())
GONE = Process(HERE.pid, 1)


@pytest.fixture(autouse=True)
def titles(monkeypatch: pytest.MonkeyPatch) -> None:
    """This process stands for those of a robot, whatever it calls itself."""
    monkeypatch.setattr(Process, "is_titled", lambda self, prefix: True)


FINE = HostFacts(
    running=(),
    file=None,
    python="3.11.7",
    versions=(Version("pydantic", "2.13", "2.13"), Version("numpy", "2.1", None)),
    clocks=Clocks(wall=2e9, step=0.001, is_synchronised=True, oldest=1.9e9),
    limits=ResourceLimits(open_files=4096, real_time_priority=0, locked_memory=None, shared_memory=64_000_000),
    listeners={},
    processes={},
    base=Path("/nowhere"),
    disks={"logs, in /run": 16_000_000},
)
MANIFEST = "rbx: 1\nkind: Robot\nname: cart\n"


def told(name: str, facts: HostFacts) -> list[tuple[str, str]]:
    """Return what an examination tells: `ok` or the code, and the words."""
    PLUGINS.load_shipped()
    return [("ok", one) if isinstance(one, str) else (one.code, one.message) for one in EXAMINATIONS[name](facts)]


def robot_of(folder: Path, text: str) -> Robot:
    (folder / "robot.yaml").write_text(MANIFEST + text, encoding="utf-8")
    robot = compile_robot(str(folder / "robot.yaml"), environment={}).robot
    assert robot is not None
    return robot


def running(state: RobotState | None = None, **fields: object) -> RunningRobot:
    return replace(RunningRobot(RobotFolder(Path("/nowhere/cart")), state), **fields)  # type: ignore[arg-type]


def state(supervisor: Process = HERE, processes: Mapping[str, Process] | None = None) -> RobotState:
    return RobotState("cart", "robot.yaml", supervisor, processes or {}, (), "tcp/127.0.0.1:7447", boot_id())


def name_of(topic: str, giver: str = "", taker: str = "", types: tuple[str, str] = ("a/msg/A", "a/msg/A")) -> GraphName:
    ends = [
        (GraphEnd(node, WireType(type_, "RIHS01_1"), node.encode(), RosQos(depth=1)),) if node else ()
        for node, type_ in zip((giver, taker), types, strict=True)
    ]
    return GraphName(topic, *ends)


def on_bus(*topics: GraphName, ages: Mapping[str, float] | None = None) -> HostFacts:
    return replace(FINE, running=(running(state(), bus=BusFacts(Graph((), topics, (), ()), ages or {})),))


def test_on_a_machine_that_is_well_nothing_is_wrong() -> None:
    answers = examine_all(FINE)
    assert {result.level for result in answers} == {"ok"}
    assert {result.examination for result in answers} == set(EXAMINATIONS) - {
        "clashes",
        "wires",
    }  # for these one must run
    assert not has_errors(answers)


@pytest.mark.parametrize(
    ("module", "reason"),
    [
        ("import no_such_module", "the doctor 'odd' of package 'odd-package' cannot be used: ModuleNotFoundError"),
        (
            "from rbxcompose.tools.doctor import examination\n@examination\ndef odd(facts):\n    return {}['x']",
            "the examination odd of 'odd_module' has failed: KeyError: 'x'",
        ),
    ],
    ids=["import", "raises"],
)
def test_a_broken_examination_is_left_out_with_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, reason: str
) -> None:
    PLUGINS.load_shipped()
    put(tmp_path / "site", "odd-package", {"doctor.odd": "odd_module"}, {"odd_module.py": module})
    see(tmp_path / "site", monkeypatch)
    monkeypatch.setattr(machine, "PLUGINS", Plugins("doctor", "examinations"))
    monkeypatch.setattr(machine, "EXAMINATIONS", dict(machine.EXAMINATIONS))
    results = examine_all(FINE)
    [answer] = [result.answer for result in results if result.examination == "odd"]
    assert isinstance(answer, Finding)
    assert answer.code == "RBX9302"
    assert reason in answer.message
    assert len({result.examination for result in results}) > 1


def test_adapters_are_told_with_the_devices_that_they_are(tmp_path: Path) -> None:
    ports = (
        SerialPort("/dev/ttyS0"),
        SerialPort("/dev/ttyUSB0", (), UsbDevice("0403", "6014", "FT4"), about="FTDI UM232H"),
        SerialPort("/dev/ttyUSB1", (), UsbDevice("1a86", "7523", "", "1-1.2")),
    )
    shown = [("ok", "/dev/ttyUSB0 (0403:6014 FT4, FTDI UM232H)"), ("ok", "/dev/ttyUSB1 (1a86:7523 at USB port 1-1.2)")]
    new = "is plugged in; 'rbxcompose udev scan' gives it a name"
    assert told("adapters", replace(FINE, ports=ports)) == [(level, f"{words} {new}") for level, words in shown]
    robot = robot_of(tmp_path, "devices: {arm: {vendor: 0403, product: 6014}}\n")
    assert told("adapters", replace(FINE, file=robot, ports=ports)) == [
        ("ok", f"{shown[0][1]} is 'arm'"),
        ("RBX9412", f"{shown[1][1]} is none of the devices: arm"),
    ]
    assert told("adapters", FINE) == [("ok", "no USB adapter with a serial port is plugged in")]


def test_a_device_that_a_bus_names_is_looked_for(tmp_path: Path) -> None:
    lines = (
        "devices: {adapter: {vendor: 0000, product: 0000, serial: none}}",
        "body: {urdf: head.urdf}",
        "buses: {servos: {type: dynamixel, port: 'dev:adapter'}}",
        "actuators: {pan: {bus: servos, model: AX-12, id: 1}}",
        "joints: {pan: {actuator: pan}}",
    )
    (tmp_path / "head.urdf").write_text(
        '<robot name="h"><link name="a"/><link name="b"/><joint name="pan" type="continuous">'
        '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>',
        encoding="utf-8",
    )
    robot = robot_of(tmp_path, "\n".join(lines))
    assert told("devices", replace(FINE, file=robot)) == [
        ("RBX9411", "'servos': the device 'adapter' (0000:0000 none) is not connected")
    ]


def test_an_adapter_that_holds_replies_back_is_told_with_what_helps() -> None:
    assert told("latency", FINE) == [("ok", "no USB adapter has a latency timer")]
    some = replace(FINE, latencies={"/dev/ttyUSB0": 0.016, "/dev/ttyUSB1": 0.001})
    assert told("latency", some) == [
        ("RBX2206", "the adapter of /dev/ttyUSB0 holds replies back for up to 16 ms"),
        ("ok", "the adapter of /dev/ttyUSB1 passes replies on after 1 ms"),
    ]
    [slow, *_] = EXAMINATIONS["latency"](some)
    assert isinstance(slow, Finding)
    assert slow.help.startswith("echo 1 | sudo tee /sys/bus/usb-serial/devices/ttyUSB0/latency_timer; ")
    assert 'DRIVER=="ftdi_sio", ATTR{latency_timer}="1"' in slow.help


def test_a_package_that_is_missing_or_another_is_told() -> None:
    wrong = (Version("numpy", None, "2.1"), Version("pyyaml", "6.1", "6.0"), Version("mcap", None, None))
    assert told("versions", replace(FINE, versions=wrong)) == [
        ("RBX9401", "numpy is not installed, 2.1 is locked"),
        ("RBX9401", "pyyaml 6.1 is installed, 6.0 is locked"),
        ("RBX9401", "mcap is not installed"),
        ("ok", "Python 3.11.7"),
    ]


def test_a_robot_that_runs_another_version_is_found() -> None:
    old = replace(FINE, running=(running(replace(state(), package_version="0.0.9")),))
    [(code, words), (level, _)] = told("versions", old)
    assert (code, words.startswith("'cart' runs rbxcompose 0.0.9, and "), level) == ("RBX9401", True, "ok")
    assert [level for level, _ in told("versions", replace(FINE, running=(running(state()),)))] == ["ok"]


def test_the_port_of_the_bus_is_free_or_taken_by_whom(tmp_path: Path) -> None:
    assert told("ports", FINE) == [("ok", "port 7447 is free")]
    taken = {7447: Listener(12, "zenohd\x1b[2J"), 7500: Listener(None, "")}
    assert told("ports", replace(FINE, listeners=taken)) == [
        ("RBX9402", "port 7447 is taken by 'zenohd\\x1b[2J' (process 12)")
    ]
    other = robot_of(tmp_path, "bus: {port: 7500}\n")
    assert told("ports", replace(FINE, file=other, listeners=taken)) == [
        ("RBX9402", "port 7500 is taken by a process of another user")
    ]
    foreign = robot_of(tmp_path, "bus: {router: tcp/10.0.0.1:7447}\n")
    assert told("ports", replace(FINE, file=foreign, listeners=taken)) == []
    private = robot_of(tmp_path, "bus: {access: user}\n")
    assert told("ports", replace(FINE, file=private, listeners=taken)) == []


def test_a_router_listens_at_its_port_or_somebody_else_does() -> None:
    up = replace(FINE, running=(running(state(processes={"router": HERE})),))
    assert told("ports", replace(up, listeners={7447: Listener(HERE.pid, "")})) == [
        ("ok", "port 7447: router of cart, open to every user of this machine")
    ]
    more = {7447: Listener(HERE.pid, ""), 8080: Listener(HERE.pid, "", is_open=True), 9: Listener(1, "", is_open=True)}
    assert told("ports", replace(up, listeners=more))[1:] == [
        ("ok", "port 8080: process router of cart, open to the network")
    ]
    private = running(replace(state(processes={"router": HERE}), router="unixsock-stream//run/user/7/bus/router"))
    assert told("ports", replace(FINE, running=(private,))) == [
        ("ok", "the bus of cart takes programs of this user only")
    ]
    orphaned = running(state(supervisor=GONE, processes={"router": GONE}))
    assert told("ports", replace(FINE, running=(orphaned,))) == []  # its end is told as what it has left
    assert told("ports", up) == [
        ("RBX9403", "the router of 'cart' should listen at port 7447, but nothing listens there")
    ]
    assert (
        "'zenohd' (process 1) listens there"
        in told("ports", replace(up, listeners={7447: Listener(1, "zenohd")}))[0][1]
    )


@pytest.mark.parametrize(
    ("clocks", "code"),
    [
        (Clocks(1e9, 0.0, True, 1.9e9), "RBX9404"),
        (Clocks(2e9, 0.2, True, 1.9e9), "RBX9404"),
        (Clocks(2e9, -0.2, None, 1.9e9), "RBX9404"),
        (Clocks(2e9, 0.0, False, 1.9e9), "ok"),
        (Clocks(2e9, 0.0, None, 1.9e9), "ok"),
    ],
)
def test_a_clock_that_is_wrong_or_jumps_is_told(clocks: Clocks, code: str) -> None:
    assert [text for text, _ in told("clocks", replace(FINE, clocks=clocks))] == [code]


def test_a_node_whose_stamps_are_of_another_time_is_told() -> None:
    _, *others = told("clocks", on_bus(ages={"/near": 0.01, "/ahead": -3.0, "/behind": 2.0}))
    assert others == [
        ("RBX9405", "the stamps of '/ahead' of 'cart' are 3.00 s in the future"),
        ("RBX9405", "the stamps of '/behind' of 'cart' are 2.00 s in the past"),
    ]
    assert told("clocks", on_bus(ages={"/near": 0.01}))[1] == (
        "ok",
        "cart: the stamps of 1 nodes agree with this clock",
    )


def test_a_host_of_a_robot_whose_clock_is_too_far_off_is_told() -> None:
    apart = replace(state(), clocks={"desk": ClockOffset(0.3, 0.01), "robot": ClockOffset(-0.001, 0.01)})
    _, *others = told("clocks", replace(FINE, running=(running(apart),)))
    assert others == [
        ("RBX6129", "cart: the clock of host 'desk' is 300.0 ms ahead of ours (± 10.0 ms)"),
        ("ok", "cart: the clock of host 'robot' is 1.0 ms behind ours (± 10.0 ms)"),
    ]


def test_low_limits_are_told() -> None:
    low = ResourceLimits(open_files=64, real_time_priority=0, locked_memory=8_000_000, shared_memory=1_000_000)
    assert [code for code, _ in told("limits", replace(FINE, limits=low))] == ["RBX9406", "RBX9406", "ok"]
    none = replace(FINE.limits, shared_memory=None)
    assert told("limits", replace(FINE, limits=none))[0] == ("RBX9406", "shared memory: there is none")


def test_a_disk_that_is_full_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full = {"logs, in /run": 14_900_000, "recordings made here, in /home": 10**9}
    assert told("disks", replace(FINE, disks=full)) == [
        ("RBX9406", "logs, in /run: 15 MB free"),
        ("ok", "recordings made here, in /home: 1000 MB free"),
    ]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "not/yet"))
    assert {f"snapshots of missions, in {tmp_path}", f"recordings made here, in {tmp_path}"} < machine.disks().keys()


def test_a_subscription_without_a_publisher_is_told_unless_it_is_open(tmp_path: Path) -> None:
    facts = on_bus(name_of("/odom", giver="/base"), name_of("/speed", taker="/radio"), name_of("/a/_b", taker="/x"))
    assert told("wires", facts) == [
        ("RBX9407", "/radio of 'cart' subscribes to /speed, which has no publisher"),
        ("ok", "cart: 1 topics are published or open to the outside; published without a subscriber: /odom"),
    ]
    mux = "components: {base: {type: diff_drive_sim}}\nmuxes: {cmd_vel: {inputs: {pad: {priority: 1, timeout: 1 s}}}}\n"
    opened = on_bus(name_of("/cmd_vel/pad", taker="/cmd_vel"))
    with_robot = replace(opened, running=(replace(opened.running[0], robot=robot_of(tmp_path, mux)),))
    assert told("wires", with_robot) == [("ok", "cart: 1 topics are published or open to the outside")]


def test_ends_of_different_types_are_an_error() -> None:
    facts = on_bus(name_of("/odom", "/base", "/map", types=("a/msg/A", "a/msg/B")))
    assert told("clashes", facts) == [("RBX9408", "/odom of 'cart' has different types: a/msg/A, a/msg/B")]
    assert has_errors(examine_all(facts))
    assert told("clashes", on_bus(name_of("/odom", "/base", "/map")))[0][0] == "ok"


def test_what_dead_robots_have_left_is_told() -> None:
    dead = running(state(supervisor=GONE, processes={"world": HERE}))
    torn = running(None, problem="its checksum is wrong")
    titles = {
        Process(5, 1): "rbxcompose cart: robot",
        Process(6, 1): "rbxcompose lost: robot",
        Process(7, 1): "rbxcompose other: supervisor",
        Process(8, 1): "rbxcompose other: robot",
    }
    assert told("leftovers", replace(FINE, running=(dead, torn), processes=titles)) == [
        ("RBX9409", "the supervisor of 'cart' is dead; these processes still run: world"),
        ("RBX9409", "the state of 'cart' cannot be read: its checksum is wrong"),
        ("RBX9409", "processes of 'lost' run without a supervisor and without a state: robot (6)"),
    ]
    assert told("leftovers", replace(FINE, running=(dead,))) == [
        ("RBX9409", "the supervisor of 'cart' is dead; these processes still run: world")
    ]
    ended = running(state(supervisor=GONE, processes={"world": GONE}))
    assert told("leftovers", replace(FINE, running=(ended,)))[0] == (
        "RBX9409",
        "the supervisor of 'cart' is dead; its files, and shared memory, are still there",
    )
    assert told("leftovers", replace(FINE, running=(running(state()),)))[0] == ("ok", "cart: its supervisor runs")


def test_folders_and_secrets_that_others_may_open_are_an_error(tmp_path: Path) -> None:
    project = tmp_path / "project"
    (project / "secrets").mkdir(parents=True)
    robot = robot_of(project, "")
    token = project / "secrets/token"
    token.write_text("x")
    base = tmp_path / "base"
    base.mkdir(mode=0o700)
    facts = replace(FINE, base=base, file=robot)
    token.chmod(0o600)
    assert told("permissions", facts) == [("ok", "1 folders of robots and 1 secrets are private")]
    token.chmod(0o640)
    base.chmod(0o755)
    wrong = told("permissions", facts)
    assert [code for code, _ in wrong] == ["RBX9410", "RBX9410"]
    assert "(mode 0755)" in wrong[0][1]
    assert "(mode 0640)" in wrong[1][1]


def test_a_device_must_be_there_and_open(tmp_path: Path) -> None:
    robot = robot_of(tmp_path, "components: {base: {type: diff_drive_sim}}\n")
    component = robot.components["base"]

    def naming(device: str) -> HostFacts:
        config = component.config.model_copy(update={"max_speed": {"ports": [device]}})
        return replace(FINE, file=replace(robot, components={"base": replace(component, config=config)}))

    assert told("devices", naming("/dev/null")) == [("ok", "/dev/null of 'base' can be opened")]
    assert told("devices", naming("/dev/no_such_tty")) == [
        ("RBX9411", "'base' names /dev/no_such_tty, which does not exist")
    ]
    assert told("devices", naming("/dev/shm")) == [("RBX9411", "'base' names /dev/shm, which is not a device")]


def test_an_answer_is_plain_data() -> None:
    fine, wrong = (ExaminationResult("ports", text) for text in ("fine", next(iter(_taken()))))
    assert fine.to_data() == {"examination": "ports", "level": "ok", "message": "fine"}
    assert {key: wrong.to_data()[key] for key in ("level", "code")} == {"level": "warning", "code": "RBX9402"}


def _taken() -> list[str | Finding]:
    PLUGINS.load_shipped()
    return list(EXAMINATIONS["ports"](replace(FINE, listeners={7447: Listener(1, "a")})))


def test_a_name_belongs_to_one_examination() -> None:
    PLUGINS.load_shipped()

    def ports(facts: HostFacts) -> list[str]:
        return []

    with pytest.raises(ValueError, match="two examinations have the name 'ports'"):
        examination(ports)


def test_the_machine_tells_who_listens_what_it_may_and_what_is_installed() -> None:
    with socket.socket() as listener, socket.socket() as open_one:
        for each, address in ((listener, "127.0.0.1"), (open_one, "")):
            each.bind((address, 0))
            each.listen()
        found, others = (machine.listeners()[each.getsockname()[1]] for each in (listener, open_one))
    assert found.pid == os.getpid()
    assert (found.is_open, others.is_open) == (False, True)
    assert "python" in found.title or "pytest" in found.title
    assert machine.limits().shared_memory is not None
    versions = {version.name: version for version in machine.versions()}
    assert versions["pydantic"].installed
    assert versions["rbxcompose"].installed == __version__
    assert versions["pydantic"].locked
    clocks = machine.ClockWatch().clocks()
    assert abs(clocks.step) < 0.05
    assert clocks.oldest < clocks.wall


def test_an_extra_that_a_component_needs_and_that_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = robot_of(tmp_path, "components: {usage: {type: cpu_monitor}}\n")
    assert told("extras", replace(FINE, file=robot)) == [("ok", "cart: monitors installed")]
    monkeypatch.setattr("rbxcompose.commands.targets.find_spec", lambda name: None)
    assert told("extras", replace(FINE, file=robot)) == [
        ("RBX2253", "'usage' needs the package 'psutil', which is not installed")
    ]
    [found] = [one for one in EXAMINATIONS["extras"](replace(FINE, file=robot)) if isinstance(one, Finding)]
    assert found.help == "pip install 'rbxcompose[monitors]'"
    plain = robot_of(tmp_path, "components: {battery: {type: battery_sim}}\n")
    assert told("extras", replace(FINE, file=plain)) == [("ok", "cart needs none")]
    assert told("extras", FINE) == [("ok", "no robot was examined that may need one")]
