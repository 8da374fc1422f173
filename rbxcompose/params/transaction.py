"""Setting parameters of several components at once: all of them, or nothing.

First all are asked whether they would accept their values. Then they get them, one after the other. If one refuses
now, those before it get their old values back. Each request says which values the caller knows, so that a change by
somebody else in between is noticed and never overwritten. Pure: the caller sends requests and tells the answers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum, auto

from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters
from rbxcompose.msgs.rcl_interfaces import Parameter
from rbxcompose.params.history import ChangeCause


class _Phase(Enum):
    CHECKING = auto()
    SETTING = auto()
    GOING_BACK = auto()
    OVER = auto()


class Transaction:
    """One change of several nodes: `requests` has what to send next, until it is over.

    `refusal` is why it was not done; `stuck` are nodes that did not take their old values back, with the reason.
    """

    def __init__(
        self,
        wanted: Mapping[str, Sequence[Parameter]],
        known: Mapping[str, Sequence[Parameter]],
        cause: ChangeCause,
        undoes: Mapping[str, int] | None = None,
    ) -> None:
        """Set `wanted` values, by node, where there are `known` values of the same parameters now."""
        self.refusal = ""
        self.stuck: dict[str, str] = {}
        self.went_back: list[str] = []
        self._wanted, self._known, self._cause, self._undoes = wanted, known, cause, undoes or {}
        self._phase = _Phase.CHECKING if wanted else _Phase.OVER
        self._waiting = list(wanted)
        self._done: list[str] = []

    @property
    def is_over(self) -> bool:
        """Return whether there is nothing left to do."""
        return self._phase is _Phase.OVER

    @property
    def requests(self) -> Iterator[tuple[str, ChangeParameters.Request]]:
        """Yield the nodes to ask now, with the requests; they may be asked in parallel."""
        match self._phase:
            case _Phase.CHECKING:
                for node in self._waiting:
                    yield node, self._request(node, self._wanted[node], self._known[node], only_check=True)
            case _Phase.SETTING:
                node = self._waiting[0]
                yield node, self._request(node, self._wanted[node], self._known[node], undoes=self._undoes.get(node, 0))
            case _Phase.GOING_BACK:
                node = self._done[-1]
                yield node, self._request(node, self._known[node], self._wanted[node])

    def take(self, node: str, response: ChangeParameters.Response | None, error: str = "") -> None:
        """Take the answer of a node; None if there was an error in its place."""
        reason = error if response is None else "" if response.success else response.message or "it gave no reason"
        match self._phase:
            case _Phase.CHECKING:
                self._waiting.remove(node)
                self.refusal = self.refusal or (f"'{node}': {reason}" if reason else "")
                if not self._waiting:
                    self._waiting = sorted(self._wanted)  # one order for all, so that of two clients only one wins
                    self._phase = _Phase.OVER if self.refusal else _Phase.SETTING
            case _Phase.SETTING:
                self._waiting.remove(node)
                self._set(node, reason, is_known=response is not None)
            case _Phase.GOING_BACK:
                self._done.remove(node)
                if reason:
                    self.stuck[node] = reason
                else:
                    self.went_back.append(node)
                self._phase = _Phase.GOING_BACK if self._done else _Phase.OVER

    def _set(self, node: str, reason: str, *, is_known: bool) -> None:
        if not reason:
            self._done.append(node)
            self._phase = _Phase.SETTING if self._waiting else _Phase.OVER
            return
        self.refusal = f"'{node}': {reason}"
        if not is_known:  # it has failed, and then comes back with its old values, or its answer was lost
            self.stuck[node] = "whether it has the new values is not known"
        self._phase = _Phase.GOING_BACK if self._done else _Phase.OVER

    def _request(
        self,
        node: str,
        parameters: Sequence[Parameter],
        expected: Sequence[Parameter],
        *,
        only_check: bool = False,
        undoes: int = 0,
    ) -> ChangeParameters.Request:
        return ChangeParameters.Request(
            parameters=tuple(parameters),
            expected=tuple(expected),
            only_check=only_check,
            by=self._cause.by,
            together=self._cause.together,
            undoes=undoes,
        )
