"""Skills that are topics: an order is a message, and another message may report how it ended."""

from __future__ import annotations

import math
from typing import Any

from rbxcompose.missions.execution.errands import ENDS, GONE, HALTS, SKILL, Shell, Waiting, WhenDone, port_name, text_in
from rbxcompose.missions.program.goals import SUCCESS, values_of
from rbxcompose.missions.program.outcomes import Result
from rbxcompose.missions.sources import OUTCOME, SkillSource
from rbxcompose.msgs import registry
from rbxcompose.sdk.bound import OrderSender

LATE_BY = 0.2  # [s] how long after an order was abandoned its end may still arrive
ROUNDING = 1e-9  # [s]
REPLACED = "replaced by a newer order"


class Desk:
    """The orders whose ends arrive on one topic, whichever skills and missions they belong to.

    Ends do not name their order, so at most one order is under way.
    """

    def __init__(self) -> None:
        self.current: TopicErrand | None = None
        self.closed_until = -math.inf  # [s] until then, an end belongs to an abandoned order

    def take(self, errand: TopicErrand) -> None:
        """Make an order the one that is under way; abandon the one before it."""
        if self.current is not None:
            self.current.replace()
        self.current = errand

    def leave(self, errand: TopicErrand) -> None:
        """Note that an order has ended or was abandoned."""
        if self.current is errand:
            self.current = None

    def ended(self, message: Any) -> None:
        """Handle an end. One that arrives while no order is under way belongs to an abandoned order."""
        current = self.current
        if current is not None and current.is_sent:
            current.ended(message)
            return
        self.closed_until = -math.inf
        if current is not None:
            current.look_soon()

    def changed(self) -> None:
        """Handle a change of subscribers."""
        if self.current is not None:
            self.current.changed()


class Desks:
    """The desks of all skills that are topics."""

    def __init__(self, shell: Shell) -> None:
        self._shell = shell
        self._desks: dict[str, Desk] = {}  # by the port on which ends arrive, else by that of the skill
        self._watched: set[str] = set()  # skills

    def of(self, source: SkillSource) -> Desk:
        """Return the desk of a skill."""
        asked, ends = SKILL + source.skill.name, source.orders.ends
        desk = self._desks.setdefault(port_name(ENDS, ends.topic) if ends is not None else asked, Desk())
        if asked not in self._watched:
            self._watched.add(asked)
            self._shell.bound[asked].watch(desk.changed)
        return desk

    def ended(self, port: str, message: Any) -> None:
        """Handle the end of an order; ignore it if nothing waits for it."""
        if port in self._desks:
            self._desks[port].ended(message)


class TopicErrand(Waiting):
    """An order on a topic."""

    nobody = "nothing subscribes to"

    def __init__(self, shell: Shell, done: WhenDone, desk: Desk, source: SkillSource, order: Any) -> None:
        super().__init__(shell, done, source.topic)
        self._desk, self._source, self._order = desk, source, order
        self._has_begun = False
        self._sent_to: frozenset[bytes] = frozenset()

    def begin(self) -> None:
        """Send the order once no end of an earlier one can arrive any more, or wait for a subscriber."""
        if self._source.orders.ends is not None:
            self._desk.take(self)
        self._begin_if_free()
        if not self._has_begun:
            self.look_soon()

    def send(self) -> bool:
        """Send it, if there is a subscriber that carries it out."""
        sender: OrderSender[Any] = self._shell.bound[SKILL + self._source.skill.name]
        if not sender.listeners:
            return False
        self.is_sent, self._sent_to = True, sender.listeners
        sender(self._order)
        if self._source.orders.ends is None:
            self.end(Result(True))
        return True

    def halt(self) -> None:
        """Abandon the order."""
        super().halt()
        self._give_up()

    def replace(self) -> None:
        """Abandon the order for a newer one."""
        self._give_up()
        self.end(Result(False, REPLACED))

    def ended(self, message: Any) -> None:
        """Handle its end."""
        values = values_of(message)
        outcome = values.get(OUTCOME) if self._source.skill.outcomes else ""
        self.end(
            Result(values.get(SUCCESS) is True, text_in(values), outcome if isinstance(outcome, str) else "", values)
        )

    def changed(self) -> None:
        """Check whether any of the subscribers that it was sent to is left."""
        sender: OrderSender[Any] = self._shell.bound[SKILL + self._source.skill.name]
        if not self.is_sent or self._sent_to & sender.listeners:
            return
        if not self._source.skill.restartable:
            self.end(Result(False, GONE))
            return
        self.wait(f"nothing subscribes to {self.name} any more", GONE)
        self.look_soon()

    def next_look(self) -> float | None:
        """Return when to poll it next [s]: when it may be sent, and while there is no subscriber."""
        return super().next_look() if self._has_begun else max(self._desk.closed_until, self._shell.now)

    def look(self) -> None:
        """Send it as soon as possible; fail at the timeout."""
        if self._has_begun:
            super().look()
        else:
            self._begin_if_free()

    def look_soon(self) -> None:
        """Request a poll at this instant."""
        self._shell.look_soon()

    def end(self, result: Result) -> None:
        """Report how it ended."""
        self._desk.leave(self)
        super().end(result)

    def _begin_if_free(self) -> None:
        if self._shell.now + ROUNDING >= self._desk.closed_until:
            self._has_begun = True
            super().begin()

    def _give_up(self) -> None:
        self._desk.leave(self)
        halts = self._source.orders.halts
        if not self.is_sent:
            return
        self.is_sent = False
        self._desk.closed_until = self._shell.now + LATE_BY
        if halts is not None:
            self._shell.bound[HALTS + self._source.skill.name](registry.message(halts.message)())
