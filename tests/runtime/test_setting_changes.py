"""Changes of settings in several processes: whatever ends in between, all have them or none."""

from __future__ import annotations

from collections.abc import Collection
from itertools import count

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.config import Config
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime import channel as tell
from rbxcompose.runtime.supervision.setting_changes import SettingChanges, WhenJudged
from rbxcompose.sdk.parameters import ChangeRefusal, WantedChange

NAMES = ("a", "b", "c")
REFUSED, LATE, RULED = 7, 8, 9  # values that are refused when they are prepared, when they are taken, by a rule


class Robot:
    """Three processes with a component each, whose orders wait until they are let through."""

    def __init__(self) -> None:
        self.values = dict.fromkeys(NAMES, 0)
        self.prepared: dict[str, tuple[int, int]] = {}  # wanted value, value before
        self.offered: dict[int, int] = {}  # what "a" has prepared for itself, by the number of its request
        self.orders: list[tuple[str, say.ChannelOrder]] = []
        self.judged: list[tuple[WhenJudged, bool]] = []
        self.answers: dict[int, ChangeRefusal | None] = {}
        self.changes = SettingChanges(self)
        self._numbers = count(1)

    def plan(self) -> Plan:
        return Plan("toys", "toys.yaml", tuple(Instance(name, "toy", Config(), name) for name in NAMES))

    def reached(self) -> Collection[str]:
        return NAMES

    def send(self, process: str, message: say.ChannelOrder) -> None:
        self.orders.append((process, message))

    def judge(self, now: list[str], new: list[str], then: WhenJudged) -> None:
        self.judged.append((then, str(RULED) in new))

    def want(self, values: dict[str, int]) -> int:
        parts = {f"/{name}": str(value) for name, value in values.items()}
        number = next(self._numbers)
        new = ""
        if values.keys() == {"a"} and not self.offered and "a" not in self.prepared:
            if values["a"] == REFUSED:
                self.answers[number] = ChangeRefusal("no")
                return number
            self.offered[number], new = values["a"], str(values["a"])
        self.changes.receive("a", tell.AskForChange(number, WantedChange(parts, "somebody", "x"), "", new))
        return number

    def step(self, which: int) -> None:
        """Let one order, or one judgement, through; those of a process keep their order."""
        if self.judged:
            then, is_broken = self.judged.pop()
            then(ChangeRefusal("a rule") if is_broken else None)
            return
        process = self.orders[which % len(self.orders)][0]
        order = self.orders.pop(next(index for index, (name, _) in enumerate(self.orders) if name == process))[1]
        self.follow(process, order)

    def follow(self, name: str, order: say.ChannelOrder) -> None:
        match order:
            case tell.PrepareChange(number, wanted):
                (text,) = wanted.parts.values() or ("",)
                if text and int(text) != REFUSED:
                    self.prepared[name] = int(text), self.values[name]
                self.changes.receive(name, tell.ChangePrepared(number, "no" if text == str(REFUSED) else "", "", text))
            case tell.CommitChange(number, decides):
                if decides in self.offered:
                    self.prepared.setdefault(name, (self.offered.pop(decides), self.values[name]))
                wanted_value, _ = self.prepared[name]
                is_taken = wanted_value != LATE
                if is_taken:
                    self.values[name] = wanted_value
                self.changes.receive(name, tell.ChangeFollowed(number, "" if is_taken else "not now"))
                if decides is not None and is_taken:
                    self.prepared.pop(name)
                    self.answers[decides] = None
            case tell.UndoChange(number):
                self.values[name] = self.prepared[name][1]
                self.changes.receive(name, tell.ChangeFollowed(number, ""))
            case tell.EndChange():
                self.prepared.pop(name, None)
            case tell.ChangeDecided(number, refusal):
                self.answers[number] = refusal
                self.offered.pop(number, None)

    def die(self, name: str) -> None:
        """End a process, which comes back with the values of its plan."""
        self.orders = [order for order in self.orders if order[0] != name]
        self.values[name] = 0
        self.prepared.pop(name, None)
        if name == "a":
            self.offered.clear()
        self.changes.gone(name)


VALUES = st.dictionaries(st.sampled_from(NAMES), st.integers(1, RULED), min_size=1)
TURNS = st.lists(st.integers(0, 9), max_size=60)


@given(wanted=st.lists(VALUES, min_size=1, max_size=3), turns=TURNS)
def test_changes_follow_each_other_and_each_is_done_whole_or_not_at_all(
    wanted: list[dict[str, int]], turns: list[int]
) -> None:
    robot = Robot()
    numbers = [robot.want(values) for values in wanted]
    expected = dict.fromkeys(NAMES, 0)
    for turn in [*turns, *[0] * 100]:
        if robot.orders or robot.judged:
            robot.step(turn)
    for number, values in zip(numbers, wanted, strict=True):
        is_refused = bool({REFUSED, LATE, RULED} & set(values.values()))
        assert (robot.answers[number] is not None) == is_refused
        expected |= {} if is_refused else values
    assert (robot.values, robot.prepared, robot.changes.is_busy) == (expected, {}, False)


@given(wanted=VALUES, turns=TURNS, dies=st.sampled_from(NAMES), at=st.integers(0, 12))
def test_a_process_that_ends_in_between_leaves_all_or_none(
    wanted: dict[str, int], turns: list[int], dies: str, at: int
) -> None:
    robot = Robot()
    number = robot.want(wanted)
    was_over = False
    for index, turn in enumerate([*turns, *[0] * 100]):
        if index == at:
            was_over = not robot.changes.is_busy
            robot.die(dies)
        if robot.orders or robot.judged:
            robot.step(turn)
    left = {name: robot.values[name] for name in wanted if name != dies}
    is_done = number in robot.answers and robot.answers[number] is None
    if dies in wanted and not was_over:
        assert not is_done
    if is_done or (dies == "a" and left and set(left.values()) != {0}):
        assert left == {name: value for name, value in wanted.items() if name != dies}
    else:
        assert set(left.values()) <= {0}
    assert not robot.changes.is_busy


def test_while_another_plan_is_applied_changes_wait() -> None:
    robot = Robot()
    robot.changes.hold()
    robot.want({"a": 1})
    assert robot.orders == []
    robot.changes.go_on()
    assert [name for name, _ in robot.orders] == ["a"]


def test_only_processes_that_a_change_concerns_or_that_have_made_one_are_asked() -> None:
    robot = Robot()

    def asked(values: dict[str, int]) -> list[str]:
        robot.want(values)
        names = sorted({name for name, order in robot.orders if isinstance(order, tell.PrepareChange)})
        while robot.orders or robot.judged:
            robot.step(0)
        return names

    assert asked({"a": 1}) == []  # it has prepared that itself, when it asked
    assert asked({"b": 1}) == ["a", "b"]
    assert asked({"a": 2}) == ["b"]
    robot.die("b")  # and comes back with the settings of the plan
    assert asked({"a": 3}) == []
    assert robot.values == {"a": 3, "b": 0, "c": 0}


def test_what_was_prepared_behind_another_change_is_prepared_again() -> None:
    robot = Robot()
    first = robot.want({"a": 1, "b": 1})
    second = robot.want({"a": 2})
    while robot.orders or robot.judged:
        robot.step(0)
    assert (robot.answers[first], robot.answers[second]) == (None, None)
    assert (robot.values["a"], robot.values["b"]) == (2, 1)


def test_a_component_of_another_host_is_told() -> None:
    robot = Robot()
    robot.changes.receive("a", tell.AskForChange(1, WantedChange({"/far": "1"}, "somebody")))
    ((_, answer),) = robot.orders
    assert isinstance(answer, tell.ChangeDecided)
    assert answer.refusal is not None
    assert "'/far' is no component of this robot on this host" in answer.refusal.reason
