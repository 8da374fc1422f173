"""The ports and windows of a running component, which the runtime binds to the bus and tests to whatever they like."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.msgs.stamps import to_nanoseconds

if TYPE_CHECKING:
    from rbxcompose.msgs.std_msgs import Header

M = TypeVar("M")
M_contra = TypeVar("M_contra", contravariant=True)
M_co = TypeVar("M_co", covariant=True)
Q_contra = TypeVar("Q_contra", contravariant=True)
R = TypeVar("R")
R_contra = TypeVar("R_contra", contravariant=True)
G_co = TypeVar("G_co", covariant=True)
G_contra = TypeVar("G_contra", contravariant=True)
F_co = TypeVar("F_co", covariant=True)
F_contra = TypeVar("F_contra", contravariant=True)


class Sender(Protocol[M_contra]):
    """Publishes one message per call."""

    @property
    def is_wanted(self) -> bool:
        """Return whether anything would receive a message now; a costly one need not be made for nobody."""

    def __call__(self, message: M_contra, /) -> None:
        """Publish `message`."""


class OrderSender(Sender[M_contra], Protocol[M_contra]):
    """Sends orders, and knows which components carry them out."""

    @property
    def listeners(self) -> frozenset[bytes]:
        """Return the components that would receive an order now, each by a unique name that changes at a restart."""

    def watch(self, changed: Callable[[], None], /) -> None:
        """Call `changed` whenever a subscriber appears or disappears."""


class Latest(Protocol[M_co]):
    """The newest message of a subscription."""

    @property
    def value(self) -> M_co | None:
        """Return the newest message, or None before the first one."""

    @property
    def age(self) -> float:
        """Return the time since the newest message arrived [s]; infinite before the first one."""


@dataclass(frozen=True, slots=True)
class Reply(Generic[R]):
    """The end of a call: a response, or the reason for having none, or for one that refuses."""

    response: R | None
    error: str = ""


class Later(Generic[R]):
    """What a component returns for a request if it knows the response only later; then it calls `reply`, once."""

    def __init__(self) -> None:
        self._response: R | None = None
        self._then: Callable[[R], None] | None = None

    def reply(self, response: R) -> None:
        """Send the response."""
        self._response = response
        self._send()

    def then(self, send: Callable[[R], None]) -> None:
        """Let `send` have the response, as soon as it is known."""
        self._then = send
        self._send()

    def _send(self) -> None:
        if self._then is not None and self._response is not None:
            self._then(self._response)


class Caller(Protocol[Q_contra, R]):
    """Calls a service; the reply arrives later, on the same thread."""

    @property
    def is_available(self) -> bool:
        """Return whether a server is known."""

    def __call__(self, request: Q_contra, then: Callable[[Reply[R]], None], /, *, timeout: float = 5.0) -> None:
        """Send `request`; `then` is called with the reply, or with an error after `timeout` [s]."""


class Outcome(StrEnum):
    """How a goal ended."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELED = "canceled"
    REJECTED = "rejected"  # the server refused it
    LOST = "lost"  # the server is gone


REASONS = ("message", "error_msg", "error_string")  # fields of a result or a response that give a reason


@dataclass(frozen=True, slots=True)
class Ended(Generic[R]):
    """The end of a goal as its client sees it; `result` is None if none arrived."""

    outcome: Outcome
    result: R | None = None
    message: str = ""


class ServedGoal(Protocol[G_co, R_contra, F_contra]):
    """A goal as its server sees it; exactly one of the last three methods ends it."""

    @property
    def request(self) -> G_co:
        """Return the goal as sent."""

    @property
    def cancel_requested(self) -> bool:
        """Return whether the goal should end soon, by `canceled`."""

    @property
    def is_paused(self) -> bool:
        """Return whether the goal is paused: hold it as it is until it continues or is cancelled."""

    def feedback(self, message: F_contra, /) -> None:
        """Send feedback to the client."""

    def succeeded(self, result: R_contra | None = None, /) -> None:
        """End the goal as succeeded; without a result its zero value is sent."""

    def aborted(self, reason: str = "", result: R_contra | None = None, /) -> None:
        """End the goal as failed; the reason goes to the log, and into the result unless one is given."""

    def canceled(self, result: R_contra | None = None, /) -> None:
        """End the goal because its client or a stop requested it."""


class ActionServer(Protocol[G_co, R_contra, F_contra]):
    """The server of an action, with its current goal."""

    @property
    def current(self) -> ServedGoal[G_co, R_contra, F_contra] | None:
        """Return the accepted goal, or None; a newer goal replaces it."""


class SentGoal(Protocol):
    """A goal as its client sees it."""

    def cancel(self) -> None:
        """Request the server to end the goal; `Ended` still follows."""


class ActionCaller(Protocol[G_contra, R, F_co]):
    """Sends goals to a server."""

    @property
    def is_available(self) -> bool:
        """Return whether a server is known."""

    def __call__(
        self, goal: G_contra, then: Callable[[Ended[R]], None], feedback: Callable[[F_co], None] | None = None, /
    ) -> SentGoal:
        """Send `goal`; `then` is called with its end exactly once."""


class Window(Protocol):
    """Publishes updates to tools outside."""

    @property
    def is_watched(self) -> bool:
        """Return whether there is a subscriber; without one, nothing need be prepared."""

    def put(self, value: object, /) -> None:
        """Send an update, as data for JSON."""


class Look(Protocol):
    """A pose of one frame in another."""

    def now(self, *, within: float = math.inf) -> Pose2 | None:
        """Return the newest pose [m, m, rad]; None while the frames are not connected, or if it is older [s]."""

    def transform(self, *, at: int | None = None) -> Transform3:
        """Return the newest pose in space, or the one at a stamp [ns], interpolated.

        Raises:
            LookupError: if there is none; the text names the frames or the times that there are.
        """

    def newest(self) -> int | None:
        """Return the newest stamp [ns] at which all frames between the two are known; None if they never move.

        Raises:
            LookupError: as `transform`.
        """


KeyedParts = Mapping[str, Any]


class KeyFeed:
    """What a window tells of something with named parts: all of them at first, then what is new, if anybody watches.

    An update is `{"whole": bool, "changed": {...}, "gone": [...]}`; a whole one replaces what was known. The messages
    around them are those of `bus/window.py`.
    """

    def __init__(self, window: Window) -> None:
        self._window = window
        self._sent: KeyedParts | None = None  # None while nobody watched

    def update(self, parts: KeyedParts) -> None:
        """Send what differs from what was told last."""
        before, self._sent = self._sent, dict(parts) if self._window.is_watched else None
        if self._sent is None or self._sent == before:
            return
        self._window.put(whole(parts) if before is None else _difference(before, parts))


def whole(parts: KeyedParts) -> dict[str, Any]:
    """Return all parts as an update."""
    return {"whole": True, "changed": dict(parts), "gone": []}


def _difference(before: KeyedParts, parts: KeyedParts) -> dict[str, Any]:
    changed = {key: part for key, part in parts.items() if key not in before or before[key] != part}
    return {"whole": False, "changed": changed, "gone": [key for key in before if key not in parts]}


def added(known: KeyedParts, update: KeyedParts) -> dict[str, Any]:
    """Return what is known after an update."""
    kept = {} if update["whole"] else {key: entry for key, entry in known.items() if key not in update["gone"]}
    return {**kept, **update["changed"]}


LATE = 0.3  # [s] that a transform may come later than what was measured at its time


class WithHeader(Protocol):
    """A message with a header."""

    @property
    def header(self) -> Header:
        """Return when and in which frame it was measured."""
        ...


H = TypeVar("H", bound=WithHeader)


class NewestMessage(Generic[H]):
    """The newest message of a sensor, until it is known where that was when it measured.

    Transforms of that time may come later than the message, so that they are missing is a problem only if it lasts.
    """

    def __init__(self, frame: str = "", wrong: str = "it is in '{}', not in '{}'") -> None:
        """Take messages in a frame, or in any; `wrong` says what is wrong with those in another one."""
        self._frame, self._wrong = frame, wrong
        self._message: H | None = None
        self._stamp = 0  # of the newest one [ns]
        self._waits = math.inf  # since when transforms have been missing [s]
        self.problem = ""
        """Why it cannot be used so far."""

    def put(self, message: H) -> None:
        """Take a message in place of the one before, unless that only comes again: a sensor that hangs may do so."""
        before, self._stamp = self._stamp, to_nanoseconds(message.header.stamp)
        if before and before == self._stamp:
            self.problem = "it comes again and again with the same stamp"
        else:
            self._message = message

    def take(self, now: float, *looks: Look) -> tuple[H, list[Transform3]] | None:
        """Return the message with the poses of frames at its time, once; None as long as there is none [s]."""
        if (message := self._message) is None:
            return None
        frame, stamp = message.header.frame_id.lstrip("/"), to_nanoseconds(message.header.stamp) or None
        if self._frame and frame not in ("", self._frame):
            self.problem = self._wrong.format(frame, self._frame)
            return None
        try:
            poses = [look.transform(at=stamp) for look in looks]
        except LookupError as error:
            self._waits = min(self._waits, now)
            if now - self._waits >= LATE:
                self.problem = str(error)
            return None
        self._message, self._waits, self.problem = None, math.inf, ""
        return message, poses
