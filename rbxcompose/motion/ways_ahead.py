"""The ways to contacts, one after the other, with motions to later ones planned elsewhere before they are needed.

Nearly all time of a goal that is hard goes into motions that are not found, so those are what helpers are given. Who
plans a motion does not change it: ways, motions and the reasons of failures are those without helpers, in the same
order. A motion that is needed is planned here, too, and what ends first counts: a helper that is slow, hangs or is gone
delays nothing.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.contacts import Contact, ContactCheckers, ContactSearch, ContactWay
from rbxcompose.motion.planner import MotionPlan, MotionPlanner, MotionRequest, Planning
from rbxcompose.motion.reasons import MotionFailure, StageFailure
from rbxcompose.motion.scene import PlacedObject

ATTEMPTS = 5  # ways that are planned to, before it gives up
ALONE = 6  # slices of the first motion before others are looked for: an easy one takes 2 to 6
STEPS = 32  # of looking for others, for each slice: one takes a millisecond
NOISE = 0.01  # [rad or m] by which joints may be elsewhere than where a helper was told: a servo has ticks

FoundWay = ContactWay | StageFailure | None
Planned = MotionPlan | MotionFailure


@dataclass(frozen=True, slots=True)
class PlanJob:
    """A motion that is to be planned elsewhere."""

    request: MotionRequest
    others: Mapping[str, float]
    """Positions of the joints that are not the arm's [rad or m]."""
    objects: tuple[PlacedObject, ...]
    paddings: Mapping[str, float]


class PlanningHelper(Protocol):
    """Plans elsewhere, one job at a time."""

    @property
    def is_idle(self) -> bool:
        """Return whether it can begin a job."""
        ...

    def begin(self, job: PlanJob) -> None:
        """Plan a motion."""
        ...

    def answer(self, job: PlanJob) -> Planned | None:
        """Return what was planned, once; None if that is not known yet, or never will be."""
        ...

    def abandon(self) -> None:
        """Let go of the job."""
        ...


class PlansWithHelp(Protocol):
    """What plans for an arm among objects, and who helps it."""

    planner: MotionPlanner
    objects: tuple[PlacedObject, ...]
    paddings: Mapping[str, float]
    helpers: Sequence[PlanningHelper]


class _Found:
    """What was found, and who plans the motion to it."""

    def __init__(self, way: FoundWay) -> None:
        self.way = way
        self.job: PlanJob | None = None
        self.helper: PlanningHelper | None = None
        self.planned: Planned | None = None

    def look(self) -> None:
        """Take the motion that its helper has planned."""
        if self.helper is not None and self.job is not None:
            self.planned = self.helper.answer(self.job)
            self.helper = None if self.planned is not None else self.helper

    def let_go(self) -> None:
        """Forget the motion."""
        if self.helper is not None:
            self.helper.abandon()
        self.job = self.helper = self.planned = None


class WaysAhead:
    """One search for ways. Close it at the end."""

    def __init__(
        self, search: ContactSearch, contacts: Iterable[Contact], checkers: ContactCheckers, works: PlansWithHelp
    ) -> None:
        self._search, self._contacts, self._checkers, self._works = search, list(contacts), checkers, works
        self._scene = (works.objects, works.paddings)
        self._now, self._count = _Found(None), 0  # what was asked for last, and how often
        self._later: list[_Found] = []
        self._looking = self._look(0)

    def next_way(self) -> Generator[None, None, FoundWay]:
        """Return what `ContactSearch.next_way` does; it yields while it works."""
        self._notice_changes()
        while not self._later:
            next(self._looking)
            yield
        self._now.let_go()
        self._now, self._count = self._later.pop(0), self._count + 1
        return self._now.way

    def plan(self, request: MotionRequest) -> Planning:
        """Plan a motion to the way that was returned last."""
        own, slices = self._works.planner.plan(request), 0
        while True:
            self._notice_changes()
            for one in (self._now, *self._later):
                one.look()
            if self._now.planned is not None and self._is_from(request):
                return self._now.planned
            try:
                next(own)
            except StopIteration as ended:
                planned: Planned = ended.value
                return planned
            slices += 1
            if self._works.helpers and (self._count > 1 or slices > ALONE):
                self._hand_out(request)
            yield

    def close(self) -> None:
        """Let helpers go."""
        for one in (self._now, *self._later):
            one.let_go()

    def _look(self, begin: int) -> Generator[None, None, None]:
        """Find one way after the other, among the contacts from one on."""
        rest, way = iter(self._contacts[begin:]), None
        while not self._later or isinstance(way, ContactWay):
            way = yield from self._search.next_way(rest, self._checkers)
            self._later.append(_Found(way))
            yield

    def _notice_changes(self) -> None:
        """Forget all that was found ahead once other objects are there."""
        if (scene := (self._works.objects, self._works.paddings)) == self._scene:
            return
        self.close()
        self._scene, self._later, way = scene, [], self._now.way
        last = way.contact if isinstance(way, ContactWay) else None
        self._looking = self._look(next((after for after, one in enumerate(self._contacts, 1) if one is last), 0))

    def _is_from(self, request: MotionRequest) -> bool:
        """Return whether the motion was planned from where all joints are."""
        job, others = self._now.job, self._search.kinematics.positions
        if job is None or job.others.keys() != others.keys():
            return False
        away = [*(request.start - job.request.start), *(others[name] - at for name, at in job.others.items())]
        return float(np.max(np.abs(away))) <= NOISE

    def _hand_out(self, request: MotionRequest) -> None:
        """Give idle helpers the motions to later ways, and look for more of these."""
        idle = [one for one in self._works.helpers if one.is_idle]
        for one in self._later:
            if idle and one.job is None and isinstance(one.way, ContactWay):
                wanted = replace(request, goal=one.way.coming[0])
                one.job = PlanJob(wanted, self._search.kinematics.positions, *self._scene)
                one.helper = idle.pop(0)
                one.helper.begin(one.job)
        for _ in range(STEPS):
            if any(one.job is None for one in self._later) or self._count + len(self._later) >= ATTEMPTS:
                break  # there is one that the next idle helper gets
            next(self._looking, None)


class HelpedPlanner(MotionPlanner):
    """A planner whose motions may be planned elsewhere."""

    def __init__(self, planner: MotionPlanner, ways: WaysAhead) -> None:
        super().__init__(planner.space, planner.checker, planner.settings, planner.now, planner.unlikely)
        self._ways = ways

    def plan(self, request: MotionRequest) -> Planning:
        """Plan a motion to the way that was returned last."""
        return self._ways.plan(request)
