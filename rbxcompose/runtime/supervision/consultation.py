"""Asks the components that a change concerns how they would take it, before anything is touched."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import field
from itertools import count

from rbxcompose.base.dataclass import dataclass
from rbxcompose.runtime import channel as messages
from rbxcompose.runtime.supervision.changes import Changes, Fate
from rbxcompose.runtime.supervision.plan_change import text_of
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.registry import component_type

WhenConsidered = Callable[[Sequence[str], str], None]  # what components say, and why they refuse, which may be empty


@dataclass(slots=True)
class _Question:
    waiting: set[str]  # processes whose answers are due
    then: WhenConsidered
    said: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)


class Consultations:
    """The questions that are open; a process that ends says nothing, since its components have nothing to lose."""

    def __init__(self, send: Callable[[str, messages.ChannelOrder], None]) -> None:
        self._send = send
        self._numbers = count(1)
        self._open: dict[int, _Question] = {}

    def ask(self, changes: Changes, reached: Collection[str], then: WhenConsidered) -> None:
        """Ask the components that are changed or restarted, in these processes; `then` is called now or later."""
        asked: dict[str, list[str]] = {}
        for one in changes.fated:
            is_asked = component_type(one.instance.type).consider is not Component.consider
            if one.fate in (Fate.LIVE, Fate.RESTARTED) and is_asked and one.instance.process in reached:
                asked.setdefault(one.instance.process, []).append(one.instance.name)
        if not asked:
            then((), "")
            return
        number = next(self._numbers)
        self._open[number] = _Question(set(asked), then)
        for process, names in asked.items():
            mine = [instance for instance in changes.after.instances if instance.name in names]
            self._send(process, messages.Consider(number, text_of(changes.after, mine)))

    def receive(self, process: str, message: messages.ChannelWord) -> None:
        """Take a message of a process; others than answers are ignored."""
        if isinstance(message, messages.Considered) and (question := self._open.get(message.number)) is not None:
            question.said += message.said
            question.refused += message.refused
            self._heard(message.number, process)

    def gone(self, process: str) -> None:
        """Expect nothing of a process any more."""
        for number in list(self._open):
            self._heard(number, process)

    def _heard(self, number: int, process: str) -> None:
        question = self._open[number]
        question.waiting.discard(process)
        if not question.waiting:
            del self._open[number]
            question.then(tuple(question.said), "; ".join(question.refused))
