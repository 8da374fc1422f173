"""The judge: a process that knows the rules about the whole robot, and is asked before live settings change.

Rules may take long, and those of other packages may do anything, so they run neither in the supervisor nor beside a
component. The judge is forked from the supervisor, which has the rules in its memory, when it is needed first.
"""

import gc
import os
import select
import selectors
import signal
import socket
from collections.abc import Iterable
from itertools import count
from typing import Protocol

import setproctitle

from rbxcompose.base.config import Config
from rbxcompose.base.processes import end_with
from rbxcompose.base.scheduler import ScheduledCallback, Scheduler
from rbxcompose.compiler.plan.dump import load_configs
from rbxcompose.runtime import channel as messages
from rbxcompose.runtime.folder import ChosenLayers
from rbxcompose.runtime.processes import close_all, in_child
from rbxcompose.runtime.supervision.setting_changes import WhenJudged
from rbxcompose.sdk.parameters import ChangeRefusal, RobotRules

PATIENCE = 10.0  # [s] for an answer; the first one after another plan compiles the robot
_OWNER = "judge"
UNKNOWN = ChangeRefusal("the rules of the robot cannot be checked now", "'rbxcompose check' shows its errors")


class FiledRules(RobotRules, Protocol):
    """Rules that can be made of the files of a robot."""

    def remade(self, file: str, layers: ChosenLayers) -> RobotRules | None:
        """Return the rules of the robot as its files are now; None if they have errors."""
        ...


class Judge:
    """The supervisor's side: asks one question after the other."""

    def __init__(self, rules: FiledRules | None, title: str, selector: selectors.BaseSelector, scheduler: Scheduler):
        self._rules, self._title, self._selector, self._scheduler = rules, title, selector, scheduler
        self._channel: messages.Channel | None = None
        self._pid = 0
        self._numbers = count(1)
        self._asked: tuple[int, WhenJudged, ScheduledCallback] | None = None

    def ask(
        self, generation: int, file: str, layers: ChosenLayers, now: list[str], new: list[str], then: WhenJudged
    ) -> None:
        """Ask; `then` gets the answer. Without rules, everything is allowed."""
        if self._rules is None:
            then(None)
            return
        channel = self._channel or self._forked(self._rules)
        number = next(self._numbers)
        late = self._scheduler.at(self._scheduler.now + PATIENCE, _OWNER, self.close)
        self._asked = number, then, late
        channel.send(messages.AskRules(number, generation, file, layers, now, new))
        self._watch(channel)

    def close(self) -> None:
        """End the process; a question that is open stays unanswered, which is a refusal."""
        if self._channel is not None:
            self._selector.unregister(self._channel)
            self._channel.close()
            self._channel = None
            os.kill(self._pid, signal.SIGKILL)  # not reaped yet: the id is still its own
            os.waitpid(self._pid, 0)
        self._answered(UNKNOWN)

    def _forked(self, rules: FiledRules) -> messages.Channel:
        ours, theirs = socket.socketpair()
        supervisor = os.getpid()
        pid = os.fork()
        if pid == 0:
            in_child(lambda: _run(rules, theirs, self._title, supervisor))
        theirs.close()
        self._pid, self._channel = pid, messages.Channel(ours)
        self._selector.register(self._channel, selectors.EVENT_READ, self._receive)
        return self._channel

    def _watch(self, channel: messages.Channel) -> None:
        """Wait for the answer, and until the judge can take the rest of a long question."""
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if channel.is_behind else 0)
        self._selector.modify(channel, events, self._receive)

    def _receive(self) -> None:
        channel = self._channel
        if channel is None:
            return
        channel.flush()
        received = channel.receive()
        if channel.is_open:
            self._watch(channel)
        else:
            self.close()
        for message in received:
            if isinstance(message, messages.RulesSay) and self._asked is not None and message.number == self._asked[0]:
                self._answered(message.refusal)

    def _answered(self, refusal: ChangeRefusal | None) -> None:
        if self._asked is not None:
            (_, then, late), self._asked = self._asked, None
            late.cancel()
            then(refusal)


def _run(rules: FiledRules, connection: socket.socket, title: str, supervisor: int) -> None:
    end_with(supervisor, signal.SIGKILL)
    signal.set_wakeup_fd(-1)
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # it ends with the supervisor
    close_all(keep=[connection.fileno()])
    os.setpgid(0, 0)
    setproctitle.setproctitle(title)
    gc.freeze()
    channel, judging = messages.Channel(connection), _Judging(rules)
    while channel.is_open:
        select.select([channel], [channel] if channel.is_behind else [], [])
        for message in channel.receive():
            if isinstance(message, messages.AskRules):
                channel.send(messages.RulesSay(message.number, judging.answer(message)))
        channel.flush()


class _Judging:
    """The judge's own side: the rules of the plan in effect."""

    def __init__(self, rules: FiledRules) -> None:
        self._first, self._generation = rules, 0
        self._rules: RobotRules | None = rules

    def answer(self, asked: messages.AskRules) -> ChangeRefusal | None:
        """Return which rule would be broken, if any."""
        if asked.generation != self._generation:
            self._generation, self._rules = asked.generation, self._first.remade(asked.file, asked.layers)
        if self._rules is None:
            return UNKNOWN
        try:
            return self._rules.why_not(_configs(asked.now), _configs(asked.new))
        except Exception as error:  # a rule of another package, or our own bug: nothing is changed
            return ChangeRefusal(f"{UNKNOWN.reason}: {type(error).__name__}: {error}")


def _configs(texts: Iterable[str]) -> dict[str, Config]:
    return {name: config for text in texts for name, config in load_configs(text).items()}
