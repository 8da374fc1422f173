"""Whether a program does what it declares: pure, fed with what its session has and what arrives from it."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from typing import Literal, get_args

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.sdk.updater import TaskStatus

PATIENCE = 10.0  # [s] after which a program should have declared and published what it says
_ACTION = re.compile(r"/_action/\w+$")
OWN = re.compile(
    r"^/(rosout|parameter_events)$|/_buf|"
    r"/(get|set|list|describe)_parameters$|/(get_parameter_types|set_parameters_atomically|get_type_description)$|"
    r"/_service_event$"
)
"""What every ROS 2 node has, besides what it is for."""


EndKind = Literal["publishes", "calls", "serves", "subscribes"]
"""What a session does at a key, by the key of the manifest for that."""
_ORDER = get_args(EndKind)  # of what is reported


@dataclass(frozen=True, slots=True)
class KeyOnBus:
    """A key of a program's session: the absolute ROS name, the DDS type and the hash."""

    kind: EndKind
    name: str
    type: str
    hash: str

    @classmethod
    def of(cls, kind: EndKind, key: str, domain: int) -> KeyOnBus | None:
        """Read a key such as `0/odom/nav_msgs::msg::dds_::Odometry_/RIHS01_...`; None for any other."""
        head, *name, type_, hash_ = key.split("/") if key.count("/") > 2 else ("", "", "")
        if head != str(domain) or not name or "::" not in type_:
            return None
        return cls(kind, "/" + "/".join(name), type_, hash_)

    def text(self, domain: int) -> str:
        """Return the key itself."""
        return f"{domain}{self.name}/{self.type}/{self.hash}"


@dataclass(frozen=True, slots=True)
class DeclaredKey:
    """An end that the manifest declares, with the rate at which it publishes at least [Hz]."""

    port: str
    key: KeyOnBus
    rate: float | None = None


class ProgramWatch:
    """Compares what a program does with what it declares."""

    def __init__(self, declared: Iterable[DeclaredKey], actions: Collection[str], since: float) -> None:
        """Take its ends, the names of its actions, and since when it is active [s]."""
        self._declared = {(end.key.kind, end.key.name): end for end in declared}
        self._actions, self._since = actions, since
        self._arrived: dict[str, int] = {}
        self._said: set[str] = set()

    def began(self, now: float) -> None:
        """Count its time from now [s]: it is ready."""
        self._since = now

    def arrived(self, port: str) -> None:
        """Count a message of one of its topics."""
        self._arrived[port] = self._arrived.get(port, 0) + 1

    def count(self, port: str) -> int:
        """Return how many messages have come."""
        return self._arrived.get(port, 0)

    def look(self, session: Collection[KeyOnBus], now: float) -> TaskStatus:
        """Return how it stands at a time [s]; `session` is what its session has, empty if that cannot be known."""
        troubles = [*self._undeclared(session), *self._missing(session, now)]
        values = {f"messages on {port}": str(number) for port, number in sorted(self._arrived.items())}
        if not troubles:
            return TaskStatus(Level.OK, "does what it declares", values)
        return TaskStatus(Level.WARN, "; ".join(troubles), values)

    def news(self, status: TaskStatus) -> Iterator[str]:
        """Yield what a status says that was not said before."""
        for text in status.message.split("; ") if status.level is not Level.OK else ():
            if text not in self._said:
                self._said.add(text)
                yield text

    def _undeclared(self, session: Collection[KeyOnBus]) -> Iterator[str]:
        for key in sorted(session, key=lambda key: (_ORDER.index(key.kind), key.name)):
            known = self._declared.get((key.kind, key.name))
            action = _ACTION.sub("", key.name)
            if known is None and (OWN.search(key.name) or action in self._actions):
                continue
            verb, where = _verb(key.kind), key.kind
            if known is None and action != key.name:
                if key.name.endswith("/send_goal"):  # one of its five ends stands for all
                    yield f"{verb} the action '{action}', which '{where}_actions' does not declare"
            elif known is None:
                yield f"{verb} '{key.name}', which '{where}' does not declare"
            elif known.key.type != key.type:
                yield f"{verb} '{key.name}' as {_ros(key.type)}, declared as {_ros(known.key.type)}"
            elif known.key.hash != key.hash:
                yield f"{verb} '{key.name}' with another version of {_ros(key.type)} than this robot's"

    def _missing(self, session: Collection[KeyOnBus], now: float) -> Iterator[str]:
        if now - self._since < PATIENCE:
            return
        there = {(key.kind, key.name) for key in session}
        for (kind, name), end in self._declared.items():
            heard = self.count(end.port) > 0
            is_there = (kind, name) in there or (kind == "publishes" and heard)
            if session and not is_there and kind != "calls":
                yield f"declares '{_ACTION.sub('', name)}', but never {_verb(kind)} it"
            elif kind == "publishes" and not heard and (end.rate is not None or not session):
                yield f"has published nothing on '{name}' for {PATIENCE:g} s"


def _verb(kind: EndKind) -> str:
    return "subscribes to" if kind == "subscribes" else kind


def _ros(dds: str) -> str:
    package, kind, *_, name = dds.split("::")
    return f"{package}/{kind}/{name.removesuffix('_')}"
