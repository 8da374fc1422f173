"""What every registered component type keeps, ours and those of others."""

from __future__ import annotations

import inspect
import subprocess
import sys
from functools import cache
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from docs.generating.components import entry_shown
from rbxcompose.base.config import field_docs
from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.model import Instance
from rbxcompose.msgs.nav_msgs import MapMetaData, OccupancyGrid
from rbxcompose.msgs.rbxcompose_msgs import Switches
from rbxcompose.msgs.types import Message
from rbxcompose.sdk.capabilities import require_declared, settings_of
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import In, Qos, Serves
from rbxcompose.sdk.registry import component_names, component_type
from rbxcompose.testing import Bench, clock_uses

ROBOT = """
rbx: 1
kind: Robot
name: example
places:
  dock: {{x: 0 m, y: 0 m, heading: 0 deg}}
components:
{example}
"""
UNFIT: dict[type[Any] | None, Message] = {
    OccupancyGrid: OccupancyGrid(info=MapMetaData(resolution=0.1, width=2, height=2), data=np.zeros(3, np.int8)),
    Switches: Switches(name=("front", "back"), angle=np.zeros(1), is_on=(True, True)),
}
HEAVY = {"pin", "ompl", "yourdfpy", "mujoco", "cv2", "scipy"}
TYPES = [name for name in component_names() if not name.startswith("toy_")]
all_types = pytest.mark.parametrize("name", TYPES)


def example_of(name: str) -> str:
    """Return the example in a type's docstring, indented as below `components:`."""
    assert entry_shown(name)
    text = inspect.cleandoc(component_type(name).__doc__ or "").partition("Example:\n")[2]
    return inspect.cleandoc(text)


@cache
def instance_of(name: str) -> Instance:
    """Compile the example of a type, which must be right, and return its instance."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "robot.yaml"
        file.write_text(ROBOT.format(example="  " + example_of(name).replace("\n", "\n  ")), encoding="utf-8")
        out = compile_robot(str(file), environment={})
    assert out.plan, render_text(out.report, out.sources)
    return next(instance for instance in out.plan.instances if instance.type == name)


@all_types
def test_it_says_what_it_is_and_shows_how_it_is_written(name: str) -> None:
    assert (component_type(name).__doc__ or "").strip()
    assert example_of(name).startswith(f"{example_of(name).partition(':')[0]}: {{type: {name}")


@all_types
def test_every_field_of_its_configuration_is_described(name: str) -> None:
    model = component_type(name).config_type()
    assert [field for field in model.model_fields if field not in field_docs(model)] == []


@all_types
def test_it_has_a_handler_for_each_input_and_service(name: str) -> None:
    cls, config = component_type(name), instance_of(name).config
    for port, end in cls.ports(config).items():
        if isinstance(end, Serves):
            assert hasattr(cls(name, config, Mock()), f"on_{port}")
        if isinstance(end, In) and not hasattr(cls, f"on_{port}"):
            own = cls.__mro__[: cls.__mro__.index(Component)]
            assert any(overrides_received(one) or port in inspect.getsource(one) for one in own)


def overrides_received(cls: type[Any]) -> bool:
    return "received" in vars(cls)


@all_types
def test_its_capabilities_name_ports_and_fields_that_it_has_with_their_values(name: str) -> None:
    cls, config = component_type(name), instance_of(name).config
    declared = require_declared(name, cls.capabilities(config), cls.ports(config), type(config))
    settings = [setting for capability in declared for setting in settings_of(capability) if setting.field]
    assert [setting.value for setting in settings] == [attrgetter(setting.field)(config) for setting in settings]


@all_types
def test_its_lifecycle_runs_twice_and_leaves_nothing_on_the_bus(name: str) -> None:
    robot = Bench(instance_of(name))
    text = next(iter(robot.host.hosted))
    robot.advance(1.0)
    robot.host.shutdown()
    left = len(robot.bus)
    robot.host.is_braking = False
    robot.host.configure()
    robot.host.activate([text])
    robot.advance(1.0)
    assert robot.host.states()[text] == ("active", 0), robot.texts()
    robot.host.shutdown()
    assert len(robot.bus) == left


@all_types
def test_it_does_the_same_for_the_same_input(name: str) -> None:
    def run() -> list[str]:
        robot = Bench(instance_of(name))
        robot.advance(1.5)
        return [record.to_json() for record in robot.records]

    assert run() == run()


@all_types
def test_a_message_whose_arrays_do_not_fit_leaves_it_running(name: str) -> None:
    instance = instance_of(name)
    inputs = [end for end in component_type(name).ports(instance.config).values() if isinstance(end, In)]
    wrong = {end.name: message for end in inputs if (message := UNFIT.get(end.interface)) is not None}
    if not wrong:
        return
    robot = Bench(instance)
    for port, message in wrong.items():
        robot.publish(instance.topic(port), message, Qos.LATCHED)
    robot.advance(1.0)
    assert robot.host.states()[instance.name] == ("active", 0), robot.texts()


@pytest.mark.soak  # `tests/testing/test_clocks.py` looks into all files that import a clock
@all_types
def test_it_never_asks_for_time_itself(name: str) -> None:
    assert clock_uses(Path(inspect.getfile(component_type(name)))) == []


def test_importing_them_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from rbxcompose.sdk.registry import component_type\n"
        f"for name in {TYPES!r}:\n"
        "    component_type(name)\n"
        f"    heavy = sys.modules.keys() & {HEAVY!r}\n"
        "    assert not heavy, (name, heavy)\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
