"""The least time that the steps of a mission take: for driving between places, and for waits."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field

from rbxcompose.base.config import Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.geometry import Pose2
from rbxcompose.missions.analysis.facts import Constants, goal_place, items_of, number_of, shortened
from rbxcompose.missions.program.parts import NodeFlow
from rbxcompose.missions.program.program import ROOT, MissionNode, Program

MOST_STEPS = 2_000  # visited per mission; nested loops would take for ever

Here = Place | None  # where the robot is; None: unknown


@dataclass(frozen=True, slots=True)
class Driving:
    """The skill that drives, its main argument, the goal tolerance [m], and the least time between two poses [s]."""

    skill: str
    main: str
    tolerance: float
    least_time: Callable[[Pose2, Pose2], float]


@dataclass(frozen=True, slots=True)
class TooShort:
    """A node that needs at least `needs` [s] but is given `given` [s]; `leg` are its two places, if it is one drive."""

    node: MissionNode
    given: float
    needs: float
    limit: Expression | None
    """What gives it the time."""
    leg: tuple[Place, Place] | None = None


@dataclass(slots=True)
class Ways:
    """Goes through a mission in its intended course: each step succeeds, and what may be left out takes no time."""

    program: Program
    driving: Driving
    places: Mapping[str, Place]
    short: dict[int, TooShort] = field(default_factory=dict)  # the worst case of each node
    visited: dict[str, Place] = field(default_factory=dict)
    late: dict[int, TooShort] = field(default_factory=dict)  # loops whose rounds take longer than their period
    starts_at: dict[int, Place] = field(default_factory=dict)  # where the robot is when other skills begin
    leg: tuple[Place, Place] | None = None  # the last drive between two known places
    steps: int = 0

    def go(self, number: int, here: Here, constants: Constants) -> tuple[Here, float]:
        """Return where a node leaves the robot and the least time that it takes [s]."""
        self.steps += 1
        if self.steps > MOST_STEPS:
            return None, 0.0
        node = self.program.nodes[number]
        there, takes = self._inside(node, here, constants)
        given = number_of(node.limit, constants)
        for limit in (node.attempt_limit, node.limit):
            least = number_of(limit, constants)
            worst = self.short.get(number)
            if least and takes > least and (worst is None or worst.needs < takes):
                self.short[number] = TooShort(node, least, takes, limit, self.leg if node.skill else None)
        takes = takes if given is None else min(takes, given)
        if node.may_be_left_out:
            return (there if there is here else None), 0.0
        return there, 0.0 if node.is_forgiven else takes

    def _inside(self, node: MissionNode, here: Here, constants: Constants) -> tuple[Here, float]:
        if node.skill:
            return self._skill(node, here, constants)
        if not node.children:
            return here, number_of(node.step.lasts, constants) or 0.0
        match node.step.flow:
            case NodeFlow.IN_TURN:
                return self._in_turn(node, here, constants)
            case NodeFlow.PER_ITEM:
                return self._loop(node, here, constants)
            case NodeFlow.FIRST:
                there, _ = self.go(node.children[0], here, constants)
                for child in node.children[1:]:
                    self.go(child, None, constants)
                return there, 0.0
            case NodeFlow.ONE_OF | NodeFlow.OPEN:  # which one may depend on where the robot is
                for child in node.children:
                    self.go(child, None, constants)
        return None, 0.0

    def _skill(self, node: MissionNode, here: Here, constants: Constants) -> tuple[Here, float]:
        if node.skill != self.driving.skill:
            if here is not None:
                self.starts_at[node.number] = here
            return here, 0.0
        there = goal_place(node, self.driving.main, constants, self.places)
        if there is None:
            return None, 0.0
        self.visited[there.name] = there
        if here is None:
            return there, 0.0
        self.leg = (here, there)
        return there, self.driving.least_time(_pose(here), _pose(there))

    def between(self, here: Place, there: Place) -> float:
        """Return the least time from one place to another, whichever way the robot looks at the start [s]."""
        heading = math.atan2(there.y - here.y, there.x - here.x)
        return self.driving.least_time(Pose2(here.x, here.y, heading), _pose(there))

    def _in_turn(self, node: MissionNode, here: Here, constants: Constants) -> tuple[Here, float]:
        here, takes = self._round(node, here, constants)
        every = number_of(node.step.lasts, constants)
        if every and takes > every:
            self.late[node.number] = TooShort(node, every, takes, node.step.lasts)
        rounds = math.inf if node.step.rounds is None else number_of(node.step.rounds, constants)
        if not node.step.comes_again or not rounds or rounds < 2:
            return here, takes
        here, again = self._round(node, here, constants)
        ends_early = math.isinf(rounds) or any(asked.is_watched for asked in node.asked[: node.own])
        return here, takes if ends_early else takes + (rounds - 1) * max(again, every or 0.0)

    def _round(self, node: MissionNode, here: Here, constants: Constants) -> tuple[Here, float]:
        takes = 0.0
        for child in node.children:
            here, took = self.go(child, here, constants)
            takes += took
        return here, takes

    def _loop(self, node: MissionNode, here: Here, constants: Constants) -> tuple[Here, float]:
        items = items_of(node, {**shortened(self.program), **constants}, self.places)
        if items is None or not node.children:
            for child in node.children:
                self.go(child, None, {name: value for name, value in constants.items() if name != node.item})
            return None, 0.0
        takes = 0.0
        for item in items if self.steps < MOST_STEPS else ():
            here, took = self.go(node.children[0], here, {**constants, node.item: item})
            takes += took
        return here, takes


def too_short(ways: Ways, constants: Constants) -> Iterator[TooShort]:
    """Yield the timeouts in the mission and its reactions that are too short."""
    ways.go(ROOT, None, constants)
    for interrupt in ways.program.interrupts:
        if interrupt.root is not None:
            ways.go(interrupt.root, None, constants)
    yield from ways.short.values()


def _pose(place: Place) -> Pose2:
    return Pose2(place.x, place.y, place.heading)


def distance(here: Place, there: Place) -> float:
    """Return the straight-line distance between two places [m]."""
    return math.hypot(here.x - there.x, here.y - there.y)
