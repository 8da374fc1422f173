"""Calls the roll of the processes of a host over the bus, and answers the calls of others."""

from __future__ import annotations

from rbxcompose.bus.roll_call import RollCall, roll_key
from rbxcompose.bus.transport import Closable, Question, Transport, TransportReply
from rbxcompose.runtime.process_group.driver import BEAT

BEATS = 6  # of the process between two calls
LONGEST_CALL = 2 * BEATS * BEAT  # [s] for an answer; a call is over by then


class RollCaller:
    """The part of one process: calls are answered in Zenoh's threads, since they test the session."""

    def __init__(self, transport: Transport, robot: str, host: str, name: str) -> None:
        self._transport, self._key = transport, roll_key(robot, host)
        self._roll = RollCall(name)
        self._beats = 0
        self._call: Closable | None = None
        self._answers: list[bytes] = []
        transport.serve(self._key, self._answer)

    def beat(self) -> list[str]:
        """Count a beat of the process; when due, judge the last call, and call again.

        Returns the processes that others reach and this session does not, if it must be opened again.
        """
        self._beats += 1
        if self._beats % BEATS:
            return []
        lost: list[str] = []
        if self._call is not None:
            self._call.close()
            lost = self._roll.judge(list(self._answers))
        answers = self._answers = []

        def answered(given: TransportReply) -> None:
            if not given.error:
                answers.append(given.payload)

        self._call = self._transport.ask(self._key, b"", b"", answered, of_all=True, within=LONGEST_CALL)
        return lost

    def _answer(self, question: Question) -> None:
        question.reply(self._roll.answer, b"")
