"""What a person is shown before a running robot is changed."""

from __future__ import annotations

from rbxcompose.base.requests import to_data
from rbxcompose.runtime.plan_requests import PlanComparison
from rbxcompose.runtime.supervision.plan_change import changes
from rbxcompose.testing import Golden
from rbxcompose.tools.inspection.plan_text import changes_text, with_places
from tests.conftest import ROOT
from tests.manifests import checked, turtlebot

EDITED = (
    (ROOT / "robots/turtlebot/robot.yaml")
    .read_text(encoding="utf-8")
    .replace("default: 0.3 m/s", "default: 0.4 m/s")
    .replace("reach: 20 cm", "reach: 25 cm")
    .replace("priority: 100", "priority: 90")
    .replace("dock: {x: 0.5 m", "dock: {x: 0.6 m")
    .replace("  charger:\n", "  lamp:\n    type: transforms\n    process: lights\n  charger:\n", 1)
    .replace("    warn: 50 %\n", "")
)


def shown(*sets: str, text: str = "") -> str:
    found, robot = changes(turtlebot(), turtlebot(*sets, text=text)), checked(*sets, text=text).compilation.robot
    assert robot is not None
    out = changes_text(with_places(to_data(PlanComparison.of(found, 0, "")), robot)) + "\n"
    file = checked(*sets, text=text).compilation.sources
    return out.replace(next(iter(file)), "robots/turtlebot/robot.yaml")


def test_the_difference_tells_each_component_its_fate_and_where_the_reason_stands(golden: Golden) -> None:
    golden.check("changes.txt", shown(text=EDITED))


def test_what_the_command_line_says_has_no_place_in_a_file() -> None:
    assert "      runtime: 45 s -> 30 s by --set\n" in shown("battery.runtime=30 s")


def test_many_reasons_are_counted() -> None:
    sets = [f"places.corner_{number}.{axis}=7 m" for number in range(1, 5) for axis in "xy"]
    assert "      and 2 more\n" in shown(*sets)
