"""Taking back changes of parameters."""

from __future__ import annotations

import pytest

from rbxcompose.msgs.rcl_interfaces import Parameter, ParameterValue
from rbxcompose.runtime.settings_history import ChangeCause, NothingToUndoError, ParameterHistory, identity, to_undo


class Robot:
    """Two components, and their histories."""

    def __init__(self) -> None:
        self.histories = {name: ParameterHistory(name) for name in ("base", "battery")}
        self.values: dict[str, int] = {}
        self.time = 0

    def set(self, cause: ChangeCause = ChangeCause("me"), **values: int) -> None:  # noqa: B008 - it is frozen
        """Set values such as `base_speed` at the next second."""
        self.time += 1_000_000_000
        for path, value in values.items():
            component, _, name = path.partition("_")
            old, self.values[path] = self.values.get(path, 0), value
            self.histories[component].note([parameter(name, old)], [parameter(name, value)], cause, self.time)

    def undo(self, wanted: str = "") -> list[str]:
        """Take back a change; return what was taken back."""
        found = to_undo([change for each in self.histories.values() for change in each.changes], wanted)
        for component in {
            change.component for change in found
        }:  # a component is sent one request for all of its changes
            own = [change for change in found if change.component == component]
            cause = ChangeCause("me", "", own[0].number)
            self.set(cause, **{f"{component}_{change.name}": change.before.integer_value for change in own})
        return [identity(change) for change in found]


def parameter(name: str, value: int) -> Parameter:
    return Parameter(name, ParameterValue(type=2, integer_value=value))


def test_undo_walks_back_to_the_start_and_then_says_so() -> None:
    robot = Robot()
    robot.set(base_speed=1)
    robot.set(battery_runtime=2)
    robot.set(base_speed=3)
    assert [robot.undo(), robot.undo(), robot.undo()] == [["base:2"], ["battery:1"], ["base:1"]]
    assert set(robot.values.values()) == {0}
    with pytest.raises(NothingToUndoError, match="there is no change to take back"):
        robot.undo()


def test_what_was_set_together_is_taken_back_together() -> None:
    robot = Robot()
    robot.set(ChangeCause("me", "abc"), base_speed=1, battery_runtime=2, battery_warn=3)
    assert sorted(robot.undo()) == ["base:1", "battery:1", "battery:2"]
    assert set(robot.values.values()) == {0}
    with pytest.raises(NothingToUndoError, match="there is no change to take back"):
        robot.undo()


def test_an_earlier_change_is_taken_back_if_nothing_came_after_it() -> None:
    robot = Robot()
    robot.set(base_speed=1)
    robot.set(battery_runtime=2)
    assert robot.undo("base:1") == ["base:1"]
    assert robot.values == {"base_speed": 0, "battery_runtime": 2}
    for name, reason in (("base:1", "taken back already"), ("base:2", "an undo"), ("base:9", "no change 'base:9'")):
        with pytest.raises(NothingToUndoError, match=reason):
            robot.undo(name)


def test_a_later_change_of_the_same_parameter_is_not_lost() -> None:
    robot = Robot()
    robot.set(base_speed=1)
    robot.set(ChangeCause("mission patrol"), base_speed=2)
    with pytest.raises(NothingToUndoError, match="was changed again by mission patrol: take back 'base:2' first"):
        robot.undo("base:1")
    robot.undo()
    assert robot.undo("base:1") == ["base:1"]


def test_the_last_hundred_changes_are_kept() -> None:
    robot = Robot()
    for value in range(1, 151):
        robot.set(base_speed=value)
    kept = robot.histories["base"].changes
    assert (len(kept), kept[0].number, kept[-1].number) == (100, 51, 150)
