"""The rosbridge protocol v2 on the robot's side: frames of clients in, frames for clients and requests for the bus out.

It knows no socket, no bus and no clock: times are arguments [s], stamps are those of messages [ns].
"""

from __future__ import annotations

import json
import math
import re
import sys
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from functools import partial
from types import MappingProxyType
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.printable import plain
from rbxcompose.domains.console import encodings, old_actions, rosapi
from rbxcompose.domains.console.access import EDITS, OperationTarget, Role, needed
from rbxcompose.domains.console.json_messages import WrongMessageError, arguments, encoded, from_json, to_json
from rbxcompose.domains.console.lease import LATEST, DriveLease, DriveLimits, Lateness, limited, moves
from rbxcompose.domains.console.rosapi import BusView, absolute
from rbxcompose.missions.sources import PAUSE
from rbxcompose.msgs import registry
from rbxcompose.msgs.rcl_interfaces import GetParameters, ListParameters, SetParameters
from rbxcompose.msgs.types import Action, Message, Service
from rbxcompose.sdk import parameters
from rbxcompose.sdk.bound import Ended, Outcome

LARGEST = 8 * 1024 * 1024  # [characters] of a frame
DEEPEST = 100  # lists and maps of a frame, each within the one before
MOST_VALUES = 250_000  # of a frame, outside of base64: while it is read, all other clients wait
MOST_PER_SECOND = 200  # frames of a client
MOST_SUBSCRIPTIONS = 200  # of a client; as many topics may it advertise, and as many calls may be open
MOST_ACTIONS = 20  # that a client serves; each is eight ends on the bus
MOST_FRAMES = 1000  # statuses and answers that wait for a client, which is then given up
LONGEST_QUEUE = 1000  # messages of a topic that wait for a client
DEPTH = 10  # messages of a topic that wait for a client that wants no queue, but reads slowly
STOP: Mapping[str, str] = {"type": "robot.StopRobot", "by": "the console"}
RELEASE: Mapping[str, str] = {"type": "robot.ReleaseRobot"}
LONGEST_NAME = 64  # characters of the name of who drives
ROUNDING = 1e-9  # of a period
LOOK = 0.2  # [s] between two looks at the robot itself, unless its clients want fewer
PATIENCE = 10.0  # [s] for an answer, if a client does not say
LONGEST_PATIENCE = 60.0  # [s]

_STATUSES = {Outcome.SUCCEEDED: 4, Outcome.CANCELED: 5, Outcome.ABORTED: 6}  # of action_msgs/GoalStatus
LEVELS = ("info", "warning", "error", "none")

WINDOWS = "/console/windows/"
DRIVE_WINDOW = f"{WINDOWS}drive"  # who holds the drive lease
CONFIG_WINDOW = f"{WINDOWS}config"  # what the page shows of the robot
CHANGES_WINDOW = f"{WINDOWS}changes"  # how often the console has changed the robot or its files
_OWN_WINDOWS = (DRIVE_WINDOW, CONFIG_WINDOW, CHANGES_WINDOW)
_DRIVES = "/console/drive"
_QUERY = re.compile(r"(?P<about>\w+)/(?P<name>\w+)(?P<values>(/\w+/\w+)*)", re.ASCII)
_NAME = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)
_TYPE = re.compile(r"\w+(/(msg|srv|action))?/\w+", re.ASCII)
_SETTING = re.compile(r"[A-Za-z_]\w*(\.\w+)*", re.ASCII)
_HASH = re.compile(r"[0-9a-f]{0,64}", re.ASCII)
_LONGEST_ROS_NAME = 247
_NODE_SERVICES: Mapping[type[Service[Any, Any]], str] = {
    GetParameters: "get_parameters",
    ListParameters: "list_parameters",
    SetParameters: "set_parameters",
}
_CANCELS = "/_action/cancel_goal"  # the end of the name of the service that cancels goals of an action
_STATUS_OF_ACTION = "/_action/status"  # the end of the name of the topic that tells how goals of an action are
_NESTS = (dict, list)
_TOO_DEEP = f"lists and maps are nested more than {DEEPEST} deep"
_SHOWN = 60  # characters of what a client sent, in a status
_TEXT = re.compile(r'"(?:[^"\\]++|\\.)*+"', re.DOTALL)  # in JSON


class BusRequest:
    """What the bus has to do, or whoever serves the clients."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Subscribe(BusRequest):
    """Pass the messages of a topic to `Bridge.arrived`."""

    topic: str
    message: type[Message]


@dataclass(frozen=True, slots=True)
class Advertise(BusRequest):
    """Declare a publisher."""

    topic: str
    message: type[Message]
    is_latched: bool = False


@dataclass(frozen=True, slots=True)
class Publish(BusRequest):
    """Publish on a topic that was advertised."""

    topic: str
    message: Message


@dataclass(frozen=True, slots=True)
class ServiceCall(BusRequest):
    """Call a service within `timeout` [s], and pass the reply to `Bridge.answered`."""

    number: int
    service: str
    type: type[Service[Any, Any]]
    request: Message
    timeout: float


@dataclass(frozen=True, slots=True)
class Serve(BusRequest):
    """Serve a service, and pass each request to `Bridge.requested`."""

    service: str
    type: type[Service[Any, Any]]


@dataclass(frozen=True, slots=True)
class ServiceAnswer(BusRequest):
    """Answer a request; without a response, by why there is none."""

    number: int
    response: Message | None
    error: str = ""


@dataclass(frozen=True, slots=True)
class ServeAction(BusRequest):
    """Serve an action, and pass each goal to `Bridge.goal_came`, and its cancelation to `Bridge.goal_unwanted`."""

    action: str
    type: type[Action[Any, Any, Any]]


@dataclass(frozen=True, slots=True)
class Withdraw(BusRequest):
    """No client listens, publishes or serves under this name any more; `kind` is the request that began it."""

    kind: type[Subscribe | Advertise | Serve | ServeAction]
    name: str


@dataclass(frozen=True, slots=True)
class GoalFeedback(BusRequest):
    """Feed back on a goal that a client carries out."""

    number: int
    feedback: Message


@dataclass(frozen=True, slots=True)
class GoalEnd(BusRequest):
    """End a goal that a client carries out; without a result, by a zero one."""

    number: int
    outcome: Outcome
    result: Message | None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class SendGoal(BusRequest):
    """Send a goal to an action; pass what comes back to `Bridge.fed_back`, and its end to `Bridge.ended`."""

    number: int
    action: str
    type: type[Action[Any, Any, Any]]
    goal: Message
    wants_feedback: bool


@dataclass(frozen=True, slots=True)
class CancelGoal(BusRequest):
    """Cancel a goal; its end still follows."""

    number: int


@dataclass(frozen=True, slots=True)
class AskRobot(BusRequest):
    """Send a request to the robot itself, as `commands` do, and pass its answer to `Bridge.robot_answered`."""

    number: int
    request: Mapping[str, Any]
    role: Role
    """Of who asks: commands need more than queries."""
    who: str


@dataclass(frozen=True, slots=True)
class SaveSettings(BusRequest):
    """Write parameters into the manifest, or with `is_trial` only find what would be; pass that to `robot_answered`."""

    number: int
    names: tuple[str, ...]
    is_trial: bool
    seen: str = ""
    """The hash that a trial told: only what was shown then is written."""


@dataclass(frozen=True, slots=True)
class EditMission(BusRequest):
    """Pass a request to the editor of missions and of the robot, and its answer to `Bridge.robot_answered`."""

    number: int
    request: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class CountMessages(BusRequest):
    """Count the messages of all topics, and pass the rates since the last time [Hz] to `Bridge.robot_answered`."""

    number: int


@dataclass(frozen=True, slots=True)
class TailLog(BusRequest):
    """Read the robot's log behind a place, and pass it to `Bridge.robot_answered`."""

    number: int
    after: int


@dataclass(frozen=True, slots=True)
class ReadTested(BusRequest):
    """Read what tests have tried of a mission, and pass it to `Bridge.robot_answered`."""

    number: int
    mission: str


@dataclass(frozen=True, slots=True)
class Watch(BusRequest):
    """Repeat a query of the robot every `period` [s], in place of an earlier period; pass answers to `Bridge.seen`."""

    window: str
    request: Mapping[str, str]
    period: float


@dataclass(frozen=True, slots=True)
class Unwatch(BusRequest):
    """No client looks through this window any more."""

    window: str


class BadFrameError(ValueError):
    """Raised for a frame that cannot be carried out; its text goes to the client."""


class _Shared:
    """A message for several clients, or an answer of the robot, encoded once in each form that somebody takes."""

    __slots__ = ("_encoded", "_message", "_stamp")

    def __init__(self, message: Message | None, text: str = "", stamp: int = 0) -> None:
        self._message, self._stamp = message, stamp
        self._encoded: dict[str, str | bytes] = {"none": text} if text or message is None else {}

    @property
    def text(self) -> str:
        if "none" not in self._encoded and self._message is not None:
            self._encoded["none"] = encoded(self._message)
        return str(self._encoded["none"])

    def frame(self, head: str, topic: str, compression: str) -> str | bytes:
        """Return the frame that publishes it; `head` begins one of text."""
        is_text = compression == "none" or (self._message is None and compression != "png")
        if is_text:
            return f"{head}{self.text}}}"
        key = f"{compression} {topic}"
        if key not in self._encoded:
            if self._message is None or compression == "png":
                self._encoded[key] = encodings.as_png(f"{head}{self.text}}}")
            elif compression == "cbor":
                self._encoded[key] = encodings.as_cbor(topic, self._message)
            else:
                self._encoded[key] = encodings.as_raw_cbor(topic, self._message, self._stamp)
        return self._encoded[key]


@dataclass(frozen=True, slots=True)
class _Wish:
    """One subscription of a client: least time between two messages [s], and how many may wait meanwhile."""

    throttle: float
    queue: int
    compression: str = "none"
    piece: int = 0  # characters of a frame; 0: whole frames


class _Stream:
    """A topic on its way to one client, under the name by which the client knows it."""

    def __init__(self, name: str, topic: str) -> None:
        self.topic, self._name = topic, name
        self.compression = "none"
        self.wishes: dict[str | None, _Wish] = {}
        self._head = f'{{"op":"publish","topic":{json.dumps(name)},"msg":'
        self._waiting: deque[_Shared] = deque()
        self._due = -math.inf  # [s], when the next one may be sent
        self.throttle, self._queue = 0.0, 0  # least time between two messages [s]

    def follow_wishes(self, now: float) -> None:
        """Do what suits all subscriptions: the lowest throttle, the longest queue."""
        self.throttle = min(wish.throttle for wish in self.wishes.values())
        self._queue = max(wish.queue for wish in self.wishes.values())
        self.compression = [*self.wishes.values()][-1].compression
        self.piece = min((wish.piece for wish in self.wishes.values() if wish.piece), default=0)
        self._waiting = deque(self._waiting, maxlen=self._queue or DEPTH)
        self._due = min(self._due, now + self.throttle)

    def offer(self, message: _Shared, now: float) -> bool:
        """Take a message, unless it comes too early and nothing may wait; return whether its client has to look again.

        While others wait, it will look anyway.
        """
        if not self.wants(now):
            return False
        if self.throttle and not self._queue:
            self._pass(now)
        was_empty = not self._waiting
        self._waiting.append(message)
        return was_empty

    def wants(self, now: float) -> bool:
        """Return whether a message that comes now is not too early."""
        return not self.throttle or self._queue > 0 or now >= self._due

    def take(self, now: float) -> str | bytes | None:
        """Return the next frame if it is due."""
        if not self._waiting or self.pause(now) > 0:
            return None
        if self.throttle and self._queue:
            self._pass(now)
        return self._waiting.popleft().frame(self._head, self._name, self.compression)

    def pause(self, now: float) -> float:
        """Return the time until the next frame is due [s], infinite if none waits."""
        if not self._waiting:
            return math.inf
        return max(0.0, self._due - now) if self.throttle and self._queue else 0.0

    def _pass(self, now: float) -> None:
        """Let one message through.

        The next instants form a grid, so that a rate is kept on average. It is the same one for all clients: what many
        want at one rate is decoded, encoded and sent for all of them together.
        """
        grid = math.floor(now / self.throttle + ROUNDING) + 1
        early = grid * self.throttle - now < self.throttle / 2
        self._due = (grid + early) * self.throttle


class _Client:
    """One connection: what it wants, and what waits for it."""

    def __init__(self, number: int, role: Role, who: str) -> None:
        self.number, self.role, self.who = number, role, who
        self.noted = ""  # last in the log
        self.level = LEVELS.index("warning")
        self.frames: deque[tuple[str, int]] = deque()  # each with the characters of a piece; 0: it is sent as a whole
        self.sent_pieces: deque[str] = deque()  # of the frame that is being sent
        self.pieces_so_far = 0
        self.pieces = encodings.Pieces(LARGEST)  # that came
        self.streams: dict[str, _Stream] = {}  # by the name that it uses; the next to be served is the first
        self.advertised: dict[str, type[Message]] = {}
        self.advertised_as: dict[str, set[object]] = {}  # the ids with which it advertised a topic
        self.open_calls = 0  # with goals
        self.asks_for_lease = False  # before it drives
        self.lateness = Lateness()
        self._allowed, self._since = float(MOST_PER_SECOND), -math.inf
        self._complained = -math.inf  # [s]

    def may_send(self, now: float) -> bool:
        """Return whether a frame at `now` is within the limit."""
        if self._since > -math.inf:
            earned = MOST_PER_SECOND * max(0.0, now - self._since)
            self._allowed = min(float(MOST_PER_SECOND), self._allowed + earned)
        self._since = now
        if self._allowed < 1:
            return False
        self._allowed -= 1
        return True

    def may_complain(self, now: float) -> bool:
        """Return whether the last complaint about too many frames is a second ago."""
        if now - self._complained < 1:
            return False
        self._complained = now
        return True


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A call that is not answered yet."""

    client: int
    id: object
    service: str
    piece: int = 0  # characters of a piece of the answer
    then: Callable[[Any], dict[str, Any] | None] | None = None
    """What makes the answer of a response, or asks on and returns None."""


@dataclass(slots=True)
class _Offer:
    """A service or an action that a client serves."""

    client: int
    name: str  # by which the client knows it
    type: Any
    open: set[int] = field(default_factory=set)  # requests that it has not answered
    goal: int | None = None  # that it carries out


@dataclass(slots=True)
class _Goal:
    """A goal that has not ended: of the client that sent it, or of one that is gone."""

    client: int
    id: object
    name: str  # by which the client knows the action
    action: str
    is_old: bool  # came by the topics of ROS 1


@dataclass(slots=True)
class _Listened:
    """A topic or a window to which at least one client listens."""

    message: type[Message] | None  # None for what is made here
    is_latched: bool
    streams: list[tuple[int, _Stream]] = field(default_factory=list)  # each with the number of its client
    last: deque[_Shared] = field(default_factory=lambda: deque(maxlen=1))  # of a latched one, of each publisher
    period: float = math.inf  # [s] of a window


class Bridge:
    """All clients of one robot."""

    def __init__(
        self,
        graph: Callable[[], BusView],
        drive: DriveLimits | None = None,
        guarded: Mapping[str, Role] = MappingProxyType({}),
        admit: Callable[[str], Role] = lambda _: Role.NOBODY,
    ) -> None:
        """Have no clients yet; `guarded` are least roles by patterns of names, `admit` returns the role of a token."""
        self._guarded, self._admit = guarded, admit
        self.lease = DriveLease()
        self.woken: set[int] = set()
        """Clients for which something new waits; who sends takes them out."""
        self.notes: deque[str] = deque(maxlen=MOST_FRAMES)
        """Who did what, for the log; who writes it takes them out."""
        self.refused: deque[str] = deque(maxlen=MOST_FRAMES)
        """Who came with a wrong token, likewise."""
        self._graph, self._drive = graph, drive
        self._clients: dict[int, _Client] = {}
        self._listened: dict[str, _Listened] = {}
        self._advertised: dict[str, type[Message]] = {}  # topics on which clients publish
        self._calls: dict[int, _Waiting] = {}
        self._offers: dict[str, dict[str, _Offer]] = {"service": {}, "action": {}}
        self._goals: dict[int, _Goal] = {}
        self._pending_notes: dict[int, str] = {}  # notes of what calls will have changed
        self._old_statuses: dict[str, dict[object, tuple[int, str]]] = {}  # by name of an action, then of a goal
        self._clients_so_far = self._calls_so_far = self._changes_so_far = 0
        self._requests: list[BusRequest] = []
        self._config: Mapping[str, object] = {}
        self._now, self._stamp = 0.0, 0

    # What the socket does

    def __len__(self) -> int:
        """Return how many clients there are."""
        return len(self._clients)

    def open(self, role: Role = Role.CONFIGURE, who: str = "") -> int:
        """Return the number of a new client; `who` is what the log calls it."""
        self._clients_so_far += 1
        number = self._clients_so_far
        self._clients[number] = _Client(number, role, who or f"client {number}")
        return number

    @property
    def strangers(self) -> int:
        """Return how many clients have not said who they are."""
        return sum(client.role is Role.NOBODY for client in self._clients.values())

    def role(self, number: int) -> Role:
        """Return what a client may do."""
        return self._clients[number].role

    def receive(self, number: int, frame: str | bytes, now: float, stamp: int) -> list[BusRequest]:
        """Carry out a frame of a client; return what the bus has to do for it."""
        self._now, self._stamp = now, stamp
        self._halt_if(self.lease.expire(now))
        client = self._clients[number]
        if not client.may_send(now):
            if client.may_complain(now):
                self._status(client, "error", f"more than {MOST_PER_SECOND} frames a second: the rest is dropped")
            return self.take_requests()
        identity: object = None
        try:
            data = _parsed(frame)
            identity = data.get("id")
            self._carry_out(client, data)
        except (BadFrameError, encodings.WrongEncodingError, WrongMessageError) as error:
            self._status(client, "error", str(error), identity)
        return self.take_requests()

    def close(self, number: int, now: float, stamp: int) -> list[BusRequest]:
        """Forget a client; what it had is withdrawn, and the robot that it drove stops."""
        self._now, self._stamp = now, stamp
        client = self._clients.pop(number)
        self._halt_if(self.lease.release(number))
        for name in list(client.streams):
            self._end_stream(client, name)
        for topic in client.advertised:
            self._unadvertise(topic)
        self._calls = {call: waiting for call, waiting in self._calls.items() if waiting.client != number}
        for kind, offers in self._offers.items():
            for name in [name for name, offer in offers.items() if offer.client == number]:
                self._end_offer(kind, name)
        # Goals go on, as missions do: a phone that sleeps must not leave a robot where it is.
        self.woken.discard(number)
        return self.take_requests()

    def next_frame(self, number: int, now: float) -> str | bytes | None:
        """Return what to send to a client now; None if nothing is due. Topics take turns."""
        client = self._clients[number]
        if client.sent_pieces:
            return client.sent_pieces.popleft()
        frame, size = self._whole_frame(client, now)
        if isinstance(frame, str) and 0 < size < len(frame):
            client.pieces_so_far += 1
            client.sent_pieces.extend(encodings.pieces(frame, size, f"fragment:{client.pieces_so_far}"))
            return client.sent_pieces.popleft()
        return frame

    def _whole_frame(self, client: _Client, now: float) -> tuple[str | bytes | None, int]:
        if client.frames:
            return client.frames.popleft()
        for name, stream in client.streams.items():
            if (frame := stream.take(now)) is not None:
                client.streams[name] = client.streams.pop(name)
                return frame, stream.piece
        return None, 0

    def pause(self, number: int, now: float) -> float:
        """Return the time until something is due for a client [s], if nothing else happens; it may be infinite."""
        return min((stream.pause(now) for stream in self._clients[number].streams.values()), default=math.inf)

    def is_overrun(self, number: int) -> bool:
        """Return whether a client asks for more than it reads, and should be disconnected."""
        return len(self._clients[number].frames) > MOST_FRAMES

    # What the bus does

    def wants(self, topic: str, now: float) -> bool:
        """Return whether a message of a topic would reach anyone if it came now; any thread may ask."""
        listened = self._listened.get(topic)
        return listened is not None and (
            listened.is_latched or any(stream.wants(now) for _, stream in listened.streams)
        )

    def arrived(self, topic: str, message: Message, now: float, stamp: int = 0) -> None:
        """Pass a message that came at `stamp` [ns] on to the clients that listen."""
        self._pass_on(topic, _Shared(message, stamp=stamp), now)

    def show_config(self, config: Mapping[str, object]) -> None:
        """Let who follows it know what the page shows of the robot."""
        self._config = config
        self.seen(CONFIG_WINDOW, config, self._now)

    def seen(self, window: str, answer: object, now: float, refusal: str = "") -> None:
        """Pass what the robot answers to a query on, or why it refuses, if that is another answer than before."""
        listened = self._listened.get(window)
        text = json.dumps(_finite({"refused": refusal} if refusal else {"answer": answer}), separators=(",", ":"))
        if listened is not None and (not listened.last or listened.last[-1].text != text):
            self._pass_on(window, _Shared(None, text), now)

    def _pass_on(self, topic: str, shared: _Shared, now: float) -> None:
        if (listened := self._listened.get(topic)) is None:
            return
        if listened.is_latched:
            listened.last.append(shared)
        for number, stream in listened.streams:
            if stream.offer(shared, now):
                self.woken.add(number)

    def answered(self, number: int, response: Message | None, error: str = "") -> None:
        """Pass the reply to a call on, or why there is none."""
        waiting = self._calls.get(number)
        if response is None:
            self._respond(number, error, is_good=False)
        elif waiting is None or waiting.then is None:
            self._respond(number, to_json(response), is_good=True)
        else:
            try:
                values = waiting.then(response)
            except (BadFrameError, WrongMessageError) as wrong:
                self._respond(number, str(wrong), is_good=False)
                return
            if values is not None:
                self._respond(number, values, is_good=True)

    def requested(self, service: str, number: int, request: Message) -> None:
        """Pass a request to the client that serves it."""
        served = self._offers["service"][service]
        served.open.add(number)
        if len(served.open) > MOST_SUBSCRIPTIONS:
            served.open.discard(oldest := min(served.open))
            self._requests.append(ServiceAnswer(oldest, None, "the client that serves it does not answer"))
        frame = {"op": "call_service", "id": f"request:{number}", "service": served.name, "args": to_json(request)}
        self._send(self._clients[served.client], frame)

    def goal_came(self, action: str, number: int, goal: Message) -> None:
        """Pass a goal to the client that serves its action; it replaces an earlier one."""
        self.goal_unwanted(action)
        served = self._offers["action"][action]
        served.goal = number
        self._ask_server(action, "send_action_goal", action_type=served.type.TYPE, args=to_json(goal), feedback=True)

    def goal_unwanted(self, action: str) -> None:
        """Ask the client that carries out a goal to cancel it."""
        if self._offers["action"][action].goal is not None:
            self._ask_server(action, "cancel_action_goal")

    def _ask_server(self, action: str, op: str, **fields: object) -> None:
        served = self._offers["action"][action]
        frame = {"op": op, "id": f"goal:{served.goal}", "action": served.name, **fields}
        self._send(self._clients[served.client], frame)

    def fed_back(self, number: int, feedback: Message) -> None:
        """Pass feedback on a goal on."""
        if (goal := self._goals.get(number)) is None:
            return
        values = to_json(feedback)
        if goal.is_old:
            status = old_actions.status_of(goal.id, old_actions.ACTIVE, self._old_stamp)
            self._pass_old(goal.name, "feedback", status=status, feedback=old_actions.feedback_of(values))
        else:
            self._tell(goal, "action_feedback", values=values)

    def ended(self, number: int, end: Ended[Any]) -> None:
        """Pass the end of a goal on."""
        if (goal := self._goals.pop(number, None)) is None:
            return
        if (client := self._clients.get(goal.client)) is not None:
            client.open_calls -= 1
        values = None if end.result is None else to_json(end.result)
        if goal.is_old:
            is_newer = any(other > number and each.action == goal.action for other, each in self._goals.items())
            state, text = old_actions.end_of(end, values or {}, is_replaced=is_newer)
            status = old_actions.status_of(goal.id, state, self._old_stamp, text)
            self._note_old(goal, state, text)
            self._pass_old(goal.name, "result", status=status, result=values or {})
        else:
            said = end.message if values is None else values
            self._tell(
                goal, "action_result", values=said, status=_STATUSES.get(end.outcome, 0), result=values is not None
            )

    def _tell(self, goal: _Goal, op: str, **fields: object) -> None:
        if (client := self._clients.get(goal.client)) is not None:
            self._send(client, {"op": op, **_identified(goal.id), "action": goal.name, **fields})

    def robot_answered(self, number: int, answer: object, refusal: str = "") -> None:
        """Pass on what the robot answered to a request, or why it refused."""
        if (note := self._pending_notes.pop(number, "")) and not refusal:
            self.notes.append(note)
            self._changes_so_far += 1
            self.seen(CHANGES_WINDOW, self._changes_so_far, self._now)
        message = refusal or (answer if isinstance(answer, str) else "")
        self._respond(number, {"success": not refusal, "message": message, "answer": answer}, is_good=True)

    def expire(self, now: float, stamp: int) -> list[BusRequest]:
        """End a drive lease that was not renewed: the robot stops."""
        self._now, self._stamp = now, stamp
        self._halt_if(self.lease.expire(now))
        return self.take_requests()

    def stop_driving(self, now: float, stamp: int) -> list[BusRequest]:
        """Take the drive lease from whoever has it, since the gateway ends."""
        self._now, self._stamp = now, stamp
        self._halt_if(self.lease.client is not None and self.lease.release(self.lease.client))
        return self.take_requests()

    # Operations

    def _carry_out(self, client: _Client, data: Mapping[str, Any]) -> None:
        op = data.get("op")
        if not isinstance(op, str):
            raise BadFrameError("a frame has an 'op', which is a text")
        if not isinstance(data.get("id"), str | int | float | None):
            raise BadFrameError("an 'id' is a text")
        if op not in _OPERATIONS:
            raise BadFrameError(f"there is no operation '{_short(op)}'")
        operation, key = _OPERATIONS[op]
        target = self._target(op, key, data.get(key)) if key else OperationTarget(op)
        if op in _ANSWERED:
            operation(self, client, data, target)
        else:
            self._permitted(client, target, partial(operation, self, client, data, target))

    def _target(self, op: str, key: str, name: object) -> OperationTarget:
        """Return what an operation is carried out on that names a topic, a service or an action.

        Raises:
            BadFrameError: if that is no name.
        """
        if not isinstance(name, str) or not _is_name(name):
            raise BadFrameError(f"'{key}' is the name of {'an' if key == 'action' else 'a'} {key}")
        full = done = absolute(name)
        if key == "service":
            return self._service_target(op, full, name)
        whole, old = _whole(full), None
        if key == "topic":
            done = full if op in _LISTENS else self._commanded(full)
            if (old := self._old_parts(done)) is not None:
                whole = old[1]
        return OperationTarget(op, done, name, (full, whole), old=old)

    def _service_target(self, op: str, service: str, written: str = "") -> OperationTarget:
        actions, whole = self._graph().actions, _whole(service)
        type_ = "" if service in _OWN or service in rosapi.TYPES else self._graph().services.get(service, "")
        if service == f"{whole}{_CANCELS}" and whole in actions:
            type_ = "action_msgs/srv/CancelGoal"  # hidden, as in ROS 2, but pages cancel goals that others sent
        if (paused := service.removesuffix(f"/{PAUSE}")) in actions:
            whole = paused
        elif service == _DRIVES and self._drive is not None:
            whole = self._drive.topic
        return OperationTarget(op, service, written, (whole,), type_)

    def _require(self, client: _Client, target: OperationTarget) -> Role:
        """Refuse what a client's role may not; return the role that is needed.

        Raises:
            BadFrameError: if it has a lower one.
        """
        least = needed(target, self._guarded)
        if client.role < least:
            raise BadFrameError(f"this needs the role '{least.word}'; yours is '{client.role.word}'")
        return least

    def _permitted(self, client: _Client, target: OperationTarget, do: Callable[[], None]) -> None:
        """Do what a client may, and note it if it changes something."""
        least = self._require(client, target)
        is_known = target.name in client.advertised
        do()
        is_new = not is_known and target.name in client.advertised
        is_quiet = target.op == "call_service" and target.name in _OWN and target.name != _DRIVES  # noted when done
        if least > Role.VIEW and not is_quiet and (target.op != "publish" or is_new or target.old is not None):
            text = f"{target.op} {target.name}"
            if client.noted != text:
                client.noted = text
                self.notes.append(f"{client.who} ({client.role.word}): {text}")

    def _note_when_done(self, client: _Client, number: int, text: str) -> None:
        """Note what a request changes once that is done, also if its client is gone by then."""
        self._pending_notes[number] = f"{client.who} ({client.role.word}): {text}"

    def _fragment(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        if (frame := client.pieces.add(data)) is not None:
            self._carry_out(client, _within(frame))

    def _png(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        self._carry_out(client, _within(encodings.from_png(data.get("data"), LARGEST)))

    def _auth(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        """Give a client the role of its token, which is the `mac` of rosbridge's `auth`."""
        role = self._admit(token) if isinstance(token := data.get("mac"), str) else Role.NOBODY
        if role is Role.NOBODY:
            self.refused.append(client.who)
            raise BadFrameError("'mac' is no token of this robot")
        client.role = max(client.role, role)

    def _subscribe(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        name, topic = target.written, target.name
        if (compression := data.get("compression") or "none") not in encodings.COMPRESSIONS:
            raise BadFrameError(
                f"a compression is one of {', '.join(encodings.COMPRESSIONS)}, not '{_short(compression)}'"
            )
        throttle = _count(data, "throttle_rate", math.inf) / 1000
        wish = _Wish(throttle, min(_count(data, "queue_length"), LONGEST_QUEUE), compression, _piece(data))
        is_window = topic.startswith(WINDOWS)
        is_old = target.old is not None
        message = None if is_window or is_old else self._message_on(topic, data)
        if is_window and topic not in _OWN_WINDOWS and not _QUERY.fullmatch(topic.removeprefix(WINDOWS)):
            raise BadFrameError(f"after '{WINDOWS}' come a subject, a query, and its fields with their values")
        if sum(len(stream.wishes) for stream in client.streams.values()) >= MOST_SUBSCRIPTIONS:
            raise BadFrameError(f"a client has at most {MOST_SUBSCRIPTIONS} subscriptions")
        if (listened := self._listened.get(topic)) is None:
            listened = self._listened[topic] = _Listened(message, is_window or topic in self._graph().latched)
            if message is not None:
                self._requests.append(Subscribe(topic, message))
                listened.last = deque(maxlen=max(1, len(self._graph().publishers.get(topic, ()))))
            self._show_holder()
            if topic == CONFIG_WINDOW:
                self.seen(topic, self._config, self._now)
            if is_old and topic.endswith("/status"):
                listened.is_latched = True
                self._show_old_statuses(topic.rpartition("/")[0])
        stream, is_new = client.streams.get(name), False
        if stream is None:
            stream, is_new = client.streams.setdefault(name, _Stream(name, topic)), True
            listened.streams.append((client.number, stream))
        stream.wishes.pop(_key(data), None)  # the newest is the last
        stream.wishes[_key(data)] = wish
        stream.follow_wishes(self._now)
        self._follow_windows(topic)
        for last in tuple(listened.last) if is_new else ():
            if stream.offer(last, self._now):
                self.woken.add(client.number)

    def _unsubscribe(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        name = target.written
        if (stream := client.streams.get(name)) is None:
            raise BadFrameError(f"there is no subscription to '{name}'")
        if (key := _key(data)) is None:
            stream.wishes.clear()
        elif stream.wishes.pop(key, None) is None:
            raise BadFrameError(f"there is no subscription '{_short(key)}' to '{name}'")
        if stream.wishes:
            stream.follow_wishes(self._now)
            self._follow_windows(stream.topic)
        else:
            self._end_stream(client, name)

    def _advertise(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        if target.old is None:  # else it is taken here
            message = self._message_on(target.name, data)
            self._declare(client, target.name, message, is_latched=data.get("latch") is True)
            client.advertised_as.setdefault(target.name, set()).add(_key(data))

    def _unadvertise_op(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        topic = target.name
        if target.old is not None:
            return
        if topic not in client.advertised:
            raise BadFrameError(f"'{target.written}' is not advertised")
        ids = client.advertised_as.pop(topic, set())
        if (key := _key(data)) is not None and (others := ids - {key}):
            client.advertised_as[topic] = others
            return
        del client.advertised[topic]
        if self._drive is not None and topic == self._drive.topic:
            self._halt_if(self.lease.release(client.number))  # while there is a publisher
        self._unadvertise(topic)

    def _publish(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        topic = target.name
        if target.old is not None:
            self._publish_old(client, *target.old, data.get("msg"))
            return
        if (type_ := client.advertised.get(topic)) is None:
            type_ = self._message_on(topic, data)
        message = from_json(type_, data.get("msg", {}), self._stamp)
        if self._drive is not None and topic == self._drive.topic:
            late = client.lateness.of(data["sent"], self._now) if "sent" in data else 0.0
            if late > LATEST:
                self._status(client, "warning", f"a command was dropped: it is {late * 1000:.0f} ms late")
                return
            message = limited(message, self._drive)
            if not self._may_drive(client, target.written, is_moving=moves(message)):
                return
        self._declare(client, topic, type_, is_latched=data.get("latch") is True)
        self._requests.append(Publish(topic, message))

    def _commanded(self, topic: str) -> str:
        """Return where velocities go that a client sends to some topic: there is one way to the base."""
        return self._drive.topic if self._drive is not None and topic in self._drive.aliases else topic

    def _may_drive(self, client: _Client, name: str, *, is_moving: bool) -> bool:
        """Renew the lease of a client that has it; one that knows no leases gets it while it wants to move.

        Pages of other programs send zero all the time: this neither takes nor keeps the lease.

        Raises:
            BadFrameError: if the client must not drive.
        """
        is_free = self.lease.client is None
        if self.lease.client != client.number:
            if client.asks_for_lease or not is_free:
                if not (is_moving or client.asks_for_lease):
                    return False
                who = "" if is_free else f": '{self.lease.holder}' drives"
                raise BadFrameError(f"'{name}' takes commands only from who has the drive lease{who}")
            return is_moving and self.lease.take(client.number, f"client {client.number}", self._now)
        if is_moving or client.asks_for_lease:
            self.lease.renew(client.number, self._now)
        return True

    def _call_service(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        if client.open_calls >= MOST_SUBSCRIPTIONS:
            raise BadFrameError(f"at most {MOST_SUBSCRIPTIONS} calls of a client are open")
        piece = _piece(data)
        self._calls_so_far += 1
        number = self._calls_so_far
        self._calls[number] = _Waiting(client.number, data.get("id"), target.written, piece)
        client.open_calls += 1
        try:
            self._permitted(client, target, partial(self._begin_call, client, number, data, target))
        except (BadFrameError, WrongMessageError) as error:
            self._respond(number, str(error), is_good=False)

    def _begin_call(self, client: _Client, number: int, data: Mapping[str, Any], target: OperationTarget) -> None:
        given, values = data.get("args"), None
        if target.name in _OWN:
            values = _OWN[target.name](self, client, _named(given, _DRIVE_ARGUMENTS), number)
        elif target.name in rosapi.TYPES:
            api = target.name.removeprefix("/rosapi/")
            named = _named(given, rosapi.ARGUMENTS[api])
            if api in _PARAMETERS:
                values = _PARAMETERS[api](self, named, number)
            else:
                values = rosapi.answer(api, named, self._graph(), self._stamp)
        else:
            self._call(number, target, given, data)
        if values is not None:
            self._respond(number, values, is_good=True)

    def _call(self, number: int, target: OperationTarget, given: object, data: Mapping[str, Any]) -> None:
        type_ = self._type_of(target.name, target.type, data.get("type"), "service")
        request = from_json(type_.Request, arguments(type_.Request, given), self._stamp)
        timeout = data.get("timeout")
        if isinstance(timeout, bool) or not isinstance(timeout, int | float | None):
            raise BadFrameError("'timeout' is a number of seconds")
        patience = min(timeout, LONGEST_PATIENCE) if timeout is not None and timeout > 0 else PATIENCE
        self._requests.append(ServiceCall(number, target.name, type_, request, patience))

    # Services and actions of clients

    def _offer(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        name, type_, kind = target.name, data.get("type"), target.op.removeprefix("advertise_")
        if not isinstance(type_, str) or not _TYPE.fullmatch(type_):
            raise BadFrameError(f"'type' is the name of a type of {kind}s")
        if kind == "service":
            is_served, most = name in self._graph().services or name in _OWN or name in rosapi.TYPES, MOST_SUBSCRIPTIONS
        else:
            is_served, most = name in self._graph().actions, MOST_ACTIONS
        if is_served or name in self._offers[kind]:
            raise BadFrameError(f"'{name}' is served already")
        if sum(offer.client == client.number for offer in self._offers[kind].values()) >= most:
            raise BadFrameError(f"a client serves at most {most} {kind}s")
        known = _class_of(kind, type_)
        self._offers[kind][name] = _Offer(client.number, target.written, known)
        self._requests.append((Serve if kind == "service" else ServeAction)(name, known))

    def _withdraw_offer(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        kind = target.op.removeprefix("unadvertise_")
        if (offer := self._offers[kind].get(target.name)) is None or offer.client != client.number:
            raise BadFrameError(f"'{target.name}' is not served by this client")
        self._end_offer(kind, target.name)

    def _end_offer(self, kind: str, name: str) -> None:
        """Serve no more; a goal is lost, and its sender learns that."""
        offer = self._offers[kind].pop(name)
        self._requests += (ServiceAnswer(number, None, "the client that served it has left") for number in offer.open)
        self._requests.append(Withdraw(Serve if kind == "service" else ServeAction, name))

    def _service_response(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        """Pass on what a client answers to a request."""
        service = target.name
        served = self._offers["service"].get(service)
        number = next((one for one in served.open if data.get("id") == f"request:{one}"), -1) if served else -1
        if served is None or served.client != client.number or number < 0:
            raise BadFrameError(f"there is no open request to '{service}' of this id")
        served.open.discard(number)
        if data.get("result") is False:
            values = data.get("values")
            reason = values.get("message") if isinstance(values, dict) else values
            refusal = _short(reason) if isinstance(reason, str) and reason else "it was refused"
            self._requests.append(ServiceAnswer(number, None, refusal))
        else:
            try:
                values = arguments(served.type.Response, data.get("values") or {})
                response = from_json(served.type.Response, values, self._stamp)
            except WrongMessageError as error:
                self._requests.append(ServiceAnswer(number, None, f"its response cannot be used: {error}"))
                raise
            self._requests.append(ServiceAnswer(number, response))

    def _action_feedback(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        served, number = self._carried_out(client, data, target.name)
        feedback = from_json(served.type.Feedback, data.get("values") or {}, self._stamp)
        self._requests.append(GoalFeedback(number, feedback))

    def _action_result(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        """Take how a goal ended: by its `status`, or else by whether there is a `result`."""
        served, number = self._carried_out(client, data, target.name)
        by_default = _STATUSES[Outcome.ABORTED if data.get("result") is False else Outcome.SUCCEEDED]
        status, values = data.get("status", by_default), data.get("values")
        outcome = next((outcome for outcome, known in _STATUSES.items() if known == status), None)
        if outcome is None:
            raise BadFrameError("the 'status' of a result is 4 (succeeded), 5 (canceled) or 6 (aborted)")
        result = from_json(served.type.Result, values, self._stamp) if isinstance(values, dict) else None
        reason = _short(values) if isinstance(values, str) and values else f"{client.who} gave up"
        self._requests.append(GoalEnd(number, outcome, result, reason))
        served.goal = None

    def _carried_out(self, client: _Client, data: Mapping[str, Any], action: str) -> tuple[_Offer, int]:
        served = self._offers["action"].get(action)
        is_own = served is not None and served.client == client.number and served.goal is not None
        if served is None or served.goal is None or not is_own or data.get("id") != f"goal:{served.goal}":
            raise BadFrameError(f"there is no open goal of '{action}' of this id")
        return served, served.goal

    # Parameters, by the names that rosapi has for them: `/battery:runtime`, or `/battery/runtime` as in ROS 1

    def _get_param(self, given: Mapping[str, Any], number: int) -> dict[str, Any] | None:
        """Read a parameter; if there is none, the default, else null: roslib gives up unless this is successful."""
        default = given.get("default_value", "")
        otherwise = None if default == "" else _read(default)

        def answer_of(response: GetParameters.Response) -> dict[str, Any]:
            found = parameters.from_message(response.values[0]) if response.values else None
            value = otherwise if found is None else found
            return {"value": json.dumps(_finite(value)), "successful": True, "reason": ""}

        return self._look_up(given, number, answer_of)

    def _has_param(self, given: Mapping[str, Any], number: int) -> dict[str, Any] | None:
        return self._look_up(given, number, lambda found: {"exists": any(value.type for value in found.values)})

    def _look_up(
        self, given: Mapping[str, Any], number: int, answer_of: Callable[[GetParameters.Response], dict[str, Any]]
    ) -> dict[str, Any] | None:
        """Ask a node for a parameter; without such a node, return the answer about one that is not set."""
        node, name = self._parameter(given)
        if not node:
            return answer_of(GetParameters.Response())
        self._ask_node(number, node, GetParameters, {"names": [name]}, answer_of)
        return None

    def _set_param(self, given: Mapping[str, Any], number: int) -> None:
        """Set a parameter, whose type decides how its value is read: JavaScript writes 2.0 as 2."""
        node, name = self._parameter(given)
        if not node:
            raise WrongMessageError(f"there is no node with a parameter '{_short(given['name'])}'")
        value = _read(given.get("value"))

        def told(response: SetParameters.Response) -> dict[str, Any]:
            result = next(iter(response.results), None)
            if result is None or not result.successful:
                raise WrongMessageError(result.reason if result and result.reason else "it was refused")
            return {"successful": True, "reason": ""}

        def then(response: GetParameters.Response) -> None:
            now = parameters.from_message(response.values[0]) if response.values else None
            is_number = isinstance(now, float) and type(value) is int and abs(value) <= sys.float_info.max
            if (message := parameters.to_message(float(value) if is_number else value)) is None:
                raise WrongMessageError("no parameter can have this value")
            change = {"name": name, "value": to_json(message)}
            self._ask_node(number, node, SetParameters, {"parameters": [change]}, told)

        self._ask_node(number, node, GetParameters, {"names": [name]}, then)

    def _get_param_names(self, given: Mapping[str, Any], number: int) -> dict[str, Any] | None:
        """List the parameters of all nodes, one after the other."""
        client, found = self._clients[self._calls[number].client], list[str]()
        targets = (self._service_target("call_service", service) for service in self._graph().services)
        left = [
            target.name.removesuffix("/list_parameters")
            for target in targets
            if target.type == ListParameters.TYPE
            and target.name.endswith("/list_parameters")
            and needed(target, self._guarded) <= client.role
        ]

        def ask() -> dict[str, Any] | None:
            if not left:
                return {"names": found}
            node = left.pop(0)

            def then(response: ListParameters.Response) -> dict[str, Any] | None:
                found.extend(f"{node}:{name}" for name in response.result.names)
                return ask()

            self._ask_node(number, node, ListParameters, {}, then)
            return None

        return ask()

    def _parameter(self, given: Mapping[str, Any]) -> tuple[str, str]:
        """Return the node that a parameter belongs to, empty if there is none, and its name there."""
        if not isinstance(name := given.get("name"), str):
            raise WrongMessageError("'name' is a text")
        node, _, parameter = name.rpartition(":" if ":" in name else "/")
        node = absolute(node)
        return (node if f"{node}/get_parameters" in self._graph().services else ""), parameter

    def _ask_node(
        self,
        number: int,
        node: str,
        type_: type[Service[Any, Any]],
        fields: Mapping[str, Any],
        then: Callable[[Any], dict[str, Any] | None],
    ) -> None:
        target = self._service_target("call_service", f"{node}/{_NODE_SERVICES[type_]}")
        self._require(self._clients[self._calls[number].client], target)  # a guard of the node counts, too
        self._calls[number] = replace(self._calls[number], then=then)
        self._call(number, target, fields, {"type": type_.TYPE})

    # Actions

    def _send_goal(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        goal = _Goal(client.number, data.get("id"), target.written, target.name, is_old=False)
        begin = partial(self._begin_goal, client, goal, data.get("args"), data.get("action_type"))
        try:
            self._permitted(client, target, partial(begin, wants_feedback=data.get("feedback") is True))
        except (BadFrameError, WrongMessageError) as error:
            self._tell(goal, "action_result", values=str(error), status=0, result=False)

    def _begin_goal(self, client: _Client, goal: _Goal, given: object, wanted: object, *, wants_feedback: bool) -> None:
        if client.open_calls >= MOST_SUBSCRIPTIONS:
            raise BadFrameError(f"at most {MOST_SUBSCRIPTIONS} calls of a client are open")
        type_ = self._action_type(goal.action, wanted)
        message = from_json(type_.Goal, arguments(type_.Goal, given or {}), self._stamp)
        self._calls_so_far += 1
        self._goals[self._calls_so_far] = goal
        client.open_calls += 1
        self._requests.append(SendGoal(self._calls_so_far, goal.action, type_, message, wants_feedback))

    def _action_type(self, action: str, wanted: object = None) -> type[Action[Any, Any, Any]]:
        found: type[Action[Any, Any, Any]] = self._type_of(action, self._graph().actions.get(action), wanted, "action")
        return found

    def _type_of(self, name: str, known: str | None, wanted: object, kind: str) -> Any:
        """Return the type of a service or an action; what a client takes it for, if it says so, must be that.

        Raises:
            BadFrameError: if there is none, or it is not known here, or another.
        """
        if not known:
            raise BadFrameError(f"there is no {kind} '{name}'")
        if wanted and (not isinstance(wanted, str) or registry.full_name(wanted, _KINDS[kind]) != known):
            raise BadFrameError(f"'{name}' is of the type '{known}', not '{_short(wanted)}'")
        return _class_of(kind, known, f" of '{name}'")

    def _cancel_goal(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        """Cancel goals of the client to an action, by their id."""
        wanted = client.number, data.get("id"), target.name
        numbers = [number for number, goal in self._goals.items() if (goal.client, goal.id, goal.action) == wanted]
        if not numbers:
            raise BadFrameError("there is no goal of this id that has not ended")
        self._requests += map(CancelGoal, numbers)

    def _old_parts(self, topic: str) -> tuple[str, str, str] | None:
        """Return what a topic is that an action has in ROS 1, unless there is a topic of that name."""
        found = old_actions.parts_of(topic, self._graph().actions)
        return None if found is None or topic in self._graph().topics else found

    def _publish_old(self, client: _Client, name: str, action: str, part: str, message: object) -> None:
        """Take a goal, or cancel: that of an id, else all."""
        if not isinstance(message, dict):
            raise WrongMessageError("'msg' is a message")
        if part == "goal":
            identity, goal = old_actions.goal_of(message, self._action_type(action).Goal.FIELDS)
            if not isinstance(identity, str):
                raise WrongMessageError("the id of a goal is a text")
            begun = _Goal(client.number, identity or f"goal {self._calls_so_far + 1}", name, action, is_old=True)
            self._begin_goal(client, begun, goal, None, wants_feedback=True)
            self._note_old(begun, old_actions.ACTIVE)
        elif part == "cancel":
            wanted = message.get("id") or None
            self._requests += [
                CancelGoal(number)
                for number, goal in self._goals.items()
                if goal.action == action and wanted in (None, goal.id)
            ]

    @property
    def _old_stamp(self) -> dict[str, int]:
        seconds, rest = divmod(self._stamp, 1_000_000_000)
        return {"secs": seconds, "nsecs": rest}

    def _note_old(self, goal: _Goal, state: int, text: str = "") -> None:
        statuses = self._old_statuses.setdefault(goal.name, {})
        statuses[goal.id] = (state, text)
        while len(statuses) > old_actions.MOST_STATUSES:
            del statuses[next(iter(statuses))]
        self._show_old_statuses(goal.name)

    def _show_old_statuses(self, name: str) -> None:
        stamp, statuses = self._old_stamp, self._old_statuses.get(name, {})
        listed = [old_actions.status_of(id_, state, stamp, text) for id_, (state, text) in statuses.items()]
        self._pass_old(name, "status", status_list=listed)

    def _pass_old(self, name: str, part: str, **fields: object) -> None:
        message = {"header": {"seq": 0, "stamp": self._old_stamp, "frame_id": ""}, **fields}
        text = json.dumps(_finite(message), separators=(",", ":"))
        self._pass_on(f"{name}/{part}", _Shared(None, text), self._now)

    def _set_level(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        if (level := data.get("level")) not in LEVELS:
            raise BadFrameError(f"a level is one of {', '.join(LEVELS)}")
        client.level = LEVELS.index(level)

    def _take_status(self, client: _Client, data: Mapping[str, Any], target: OperationTarget) -> None:
        """Ignore what a client reports: nobody here reads it."""

    # Services of the gateway

    def _drive_service(self, client: _Client, given: Mapping[str, Any], number: int) -> dict[str, Any]:
        if not isinstance(take := given.get("take"), bool):
            raise WrongMessageError("'take' is true or false")
        if not isinstance(name := given.get("name", ""), str):
            raise WrongMessageError("'name' is a text")
        if self._drive is None:
            return {"success": False, "holder": "", "message": "this robot does not drive"}
        client.asks_for_lease = True
        if not take:
            self._halt_if(self.lease.release(client.number))
            return {"success": True, "holder": self.lease.holder, "message": ""}
        shown = "".join(letter for letter in name if letter.isprintable())[:LONGEST_NAME].strip() or "somebody"
        self._declare(client, self._drive.topic, registry.message(self._drive.type))  # first: it may be refused
        if not self.lease.take(client.number, shown, self._now):
            holder = self.lease.holder
            return {"success": False, "holder": holder, "message": f"'{holder}' drives"}
        client.who = f"{shown}, {client.who.rpartition(', ')[2]}"
        return {"success": True, "holder": shown, "message": ""}

    def _stop_service(self, client: _Client, given: Mapping[str, Any], number: int) -> None:
        self._requests.append(AskRobot(number, STOP, Role.CONFIGURE, client.who))  # anyone may

    def _release_service(self, client: _Client, given: Mapping[str, Any], number: int) -> None:
        self._requests.append(AskRobot(number, RELEASE, client.role, client.who))

    def _ask_service(self, client: _Client, given: Mapping[str, Any], number: int) -> None:
        if not isinstance(given.get("type"), str):
            raise WrongMessageError("'type' is the name of a request, such as 'mission.ListMissions'")
        self._requests.append(AskRobot(number, given, client.role, client.who))

    def _log_service(self, client: _Client, given: Mapping[str, Any], number: int) -> None:
        after = given.get("after", 0)
        if not isinstance(after, int) or isinstance(after, bool):
            raise WrongMessageError("'after' is a whole number: that of the last answer")
        self._requests.append(TailLog(number, after))

    def _rates_service(self, client: _Client, given: Mapping[str, Any], number: int) -> None:
        self._requests.append(CountMessages(number))

    def _tested_service(self, client: _Client, given: Mapping[str, Any], number: int) -> None:
        if not isinstance(mission := given.get("mission"), str):
            raise WrongMessageError("'mission' is the name of a mission")
        self._requests.append(ReadTested(number, mission))

    def _save_service(self, client: _Client, given: Mapping[str, Any], number: int) -> None:
        names = given.get("names", [])
        if not isinstance(names, list) or not all(isinstance(one, str) and _SETTING.fullmatch(one) for one in names):
            raise WrongMessageError("'names' are components, or their parameters: 'battery', 'battery.runtime'")
        seen = given.get("hash", "")
        if not isinstance(seen, str) or not _HASH.fullmatch(seen):
            raise WrongMessageError("'hash' is what a dry run told")
        is_trial = given.get("dry_run") is True
        if not is_trial:
            self._note_when_done(client, number, f"saves {', '.join(names) or 'all changed parameters'}")
        self._requests.append(SaveSettings(number, tuple(names), is_trial, seen))

    def _edit_service(self, client: _Client, given: Mapping[str, Any], number: int, name: str) -> None:
        """Pass on what the editor is asked about a mission, or about the robot."""
        request: dict[str, Any] = {"do": name.removeprefix("mission/")}
        for key in EDITS[name][1]:
            value = given.get(key, _OTHERWISE.get((name, key)))
            if not isinstance(value, _EDITED.get(key, str)):
                raise WrongMessageError(f"'{key}' is missing, or of another type")
            request[key] = value
        if name in ("mission/save", "robot/save") and given.get("dry_run") is True:
            request["dry_run"] = True
        elif name in _WRITES:
            self._note_when_done(client, number, _WRITES[name].format(*map(_short, request.values())))
        self._requests.append(EditMission(number, request))

    # What they share

    def _message_on(self, topic: str, data: Mapping[str, Any]) -> type[Message]:
        """Return the type of a topic: the one that exists, else the one that the frame names."""
        name = data.get("type")
        if name is not None and not (isinstance(name, str) and _TYPE.fullmatch(name)):
            raise BadFrameError(f"'{_short(name)}' is not the name of a type")
        wanted = registry.full_name(name, "msg") if name else ""
        known = self._known_type(topic)
        if not (known or wanted):
            raise BadFrameError(f"there is no topic '{topic}' yet, so its type must be given")
        if known and wanted and known != wanted:
            raise BadFrameError(f"'{topic}' is of the type '{known}', not '{wanted}'")
        return _class_of("message", known or wanted)  # type: ignore[no-any-return]

    def _known_type(self, topic: str) -> str:
        if self._drive is not None and topic == self._drive.topic:
            return self._drive.type
        listened = self._listened.get(topic)
        if (ours := listened.message if listened else self._advertised.get(topic)) is not None:
            return ours.TYPE
        action, is_status, _ = topic.rpartition(_STATUS_OF_ACTION)
        if is_status and action in self._graph().actions:  # hidden, as all topics of actions
            return "action_msgs/msg/GoalStatusArray"
        return self._graph().topics.get(topic, "")

    def _declare(self, client: _Client, topic: str, message: type[Message], *, is_latched: bool = False) -> None:
        if topic in client.advertised:
            return
        if len(client.advertised) >= MOST_SUBSCRIPTIONS:
            raise BadFrameError(f"a client advertises at most {MOST_SUBSCRIPTIONS} topics")
        client.advertised[topic] = message
        if topic not in self._advertised:
            self._advertised[topic] = message
            self._requests.append(Advertise(topic, message, is_latched))

    def _unadvertise(self, topic: str) -> None:
        if not any(topic in client.advertised for client in self._clients.values()):
            del self._advertised[topic]
            self._requests.append(Withdraw(Advertise, topic))

    def _end_stream(self, client: _Client, name: str) -> None:
        stream = client.streams.pop(name)
        listened = self._listened[stream.topic]
        listened.streams = [(number, other) for number, other in listened.streams if other is not stream]
        if listened.streams:
            self._follow_windows(stream.topic)
            return
        del self._listened[stream.topic]
        if listened.message is not None:
            self._requests.append(Withdraw(Subscribe, stream.topic))
        elif stream.topic.startswith(WINDOWS):
            self._requests.append(Unwatch(stream.topic))

    def _follow_windows(self, topic: str) -> None:
        """Look through a window as often as the most curious of its clients wants."""
        listened = self._listened[topic]
        if listened.message is not None or (query := _QUERY.fullmatch(topic.removeprefix(WINDOWS))) is None:
            return
        period = max(LOOK, min(stream.throttle for _, stream in listened.streams))
        if period != listened.period:
            listened.period = period
            words = query["values"].split("/")[1:]
            fields = dict(zip(words[::2], words[1::2], strict=True))
            self._requests.append(Watch(topic, {"type": f"{query['about']}.{query['name']}", **fields}, period))

    def _show_holder(self) -> None:
        if DRIVE_WINDOW in self._listened:
            self.seen(DRIVE_WINDOW, {"holder": self.lease.holder}, self._now)

    def _halt_if(self, has_ended: bool) -> None:
        """Publish rest, once, if a drive lease has ended."""
        if has_ended and self._drive is not None:
            rest = from_json(registry.message(self._drive.type), {}, self._stamp)
            self._requests.append(Publish(self._drive.topic, rest))

    def _status(self, client: _Client, level: str, text: str, identity: object = None) -> None:
        if LEVELS.index(level) >= client.level:
            known = identity if isinstance(identity, str | int | float) else None
            self._send(client, {"op": "status", "level": level, "msg": text, **_identified(known)})

    def _respond(self, number: int, values: object, *, is_good: bool) -> None:
        if (waiting := self._calls.pop(number, None)) is None:
            return  # its client is gone
        client = self._clients[waiting.client]
        client.open_calls -= 1
        frame = {"service": waiting.service, "values": values, "result": is_good}
        self._send(client, {"op": "service_response", **_identified(waiting.id), **frame}, waiting.piece)

    def _send(self, client: _Client, frame: Mapping[str, object], piece: int = 0) -> None:
        client.frames.append((json.dumps(_finite(frame), separators=(",", ":")), piece))
        self.woken.add(client.number)

    def take_requests(self) -> list[BusRequest]:
        """Return what the bus has to do since the last time."""
        self._show_holder()
        requests, self._requests = self._requests, []
        return requests


_OPERATIONS: Mapping[str, tuple[Callable[[Bridge, _Client, Mapping[str, Any], OperationTarget], None], str]] = {
    "advertise": (Bridge._advertise, "topic"),
    "fragment": (Bridge._fragment, ""),
    "png": (Bridge._png, ""),
    "action_feedback": (Bridge._action_feedback, "action"),
    "action_result": (Bridge._action_result, "action"),
    "advertise_action": (Bridge._offer, "action"),
    "advertise_service": (Bridge._offer, "service"),
    "unadvertise_action": (Bridge._withdraw_offer, "action"),
    "unadvertise_service": (Bridge._withdraw_offer, "service"),
    "service_response": (Bridge._service_response, "service"),
    "cancel_action_goal": (Bridge._cancel_goal, "action"),
    "send_action_goal": (Bridge._send_goal, "action"),
    "auth": (Bridge._auth, ""),
    "unadvertise": (Bridge._unadvertise_op, "topic"),
    "publish": (Bridge._publish, "topic"),
    "subscribe": (Bridge._subscribe, "topic"),
    "unsubscribe": (Bridge._unsubscribe, "topic"),
    "call_service": (Bridge._call_service, "service"),
    "set_level": (Bridge._set_level, ""),
    "status": (Bridge._take_status, ""),
}
"""What carries out each operation, and the key that names what it is carried out on; no other key of a frame does."""
_LISTENS = frozenset({"subscribe", "unsubscribe"})
_KINDS = {"service": "srv", "action": "action"}
_CLASSES: Mapping[str, Callable[[str], Any]] = {
    "message": registry.message,
    "service": registry.service,
    "action": registry.action,
}
_ANSWERED = frozenset({"call_service", "send_action_goal"})  # operations whose refusal is an answer of their own


_EDITED: Mapping[str, type] = {"operation": dict, "path": list, "generation": int, "changes": list, "hashes": dict}
"""The types of those arguments of `EDITS` that are no texts."""
_OTHERWISE: Mapping[tuple[str, str], object] = {("robot/look", "hashes"): {}}
"""What stands for such an argument if it is missing."""
_WRITES = {
    "mission/new": "makes the mission {1}",
    "mission/save": "saves the mission {1}",
    "mission/test_new": "makes a test of the mission {1}",
    "robot/apply": "changes the robot to what its files say",
    "robot/revert": "takes back a change of the robot",
    "robot/save": "saves {1} of the robot",
}
"""What the log says of those of `EDITS` that change files or the robot; `{1}` is their first argument."""
_OWN: Mapping[str, Callable[[Bridge, _Client, Mapping[str, Any], int], dict[str, Any] | None]] = {
    "/console/ask": Bridge._ask_service,
    _DRIVES: Bridge._drive_service,
    "/console/log": Bridge._log_service,
    "/console/rates": Bridge._rates_service,
    "/console/release": Bridge._release_service,
    "/console/save": Bridge._save_service,
    "/console/stop": Bridge._stop_service,
    "/console/tested": Bridge._tested_service,
    **{f"/console/{name}": partial(Bridge._edit_service, name=name) for name in EDITS},
}
"""Services of the gateway: what answers, or None if the answer comes later."""
_PARAMETERS: Mapping[str, Callable[[Bridge, Mapping[str, Any], int], dict[str, Any] | None]] = {
    "get_param": Bridge._get_param,
    "get_param_names": Bridge._get_param_names,
    "has_param": Bridge._has_param,
    "set_param": Bridge._set_param,
}
"""Services of rosapi that ask nodes."""
_DRIVE_ARGUMENTS = ("take", "name")


def _parsed(frame: str | bytes) -> dict[str, Any]:
    if len(frame) > LARGEST:
        raise BadFrameError(f"a frame has at most {LARGEST // 2**20} MiB")
    try:
        text = frame if isinstance(frame, str) else frame.decode()
        if _values_in(text) > MOST_VALUES:
            raise BadFrameError(f"a frame has at most {MOST_VALUES} values; bytes are a single one in base64")
        data = _loaded(text)
    except BadFrameError:
        raise
    except ValueError as error:
        raise BadFrameError("the frame is not JSON") from error
    if not isinstance(data, dict):
        raise BadFrameError("a frame is a map with an 'op'")
    return data


def _values_in(text: str) -> int:
    """Return about how many values and keys a text in JSON has, much faster than it is read."""
    counted = sum(map(text.count, "[{,"))
    if counted > MOST_VALUES and (texts := (text.count('"') - text.count('\\"')) // 2) <= MOST_VALUES:
        outside = _TEXT.sub("", text)  # a text may have many commas
        return max(texts, sum(map(outside.count, "[{,")))
    return counted


def _loaded(text: str) -> Any:
    """Return what a JSON text says, so flat that whatever reads it may do so level by level.

    Raises:
        BadFrameError: if it is nested too deeply.
        ValueError: if it is not JSON.
    """
    try:
        found = json.loads(text)
    except RecursionError as error:
        raise BadFrameError(_TOO_DEEP) from error
    if text.count("[") + text.count("{") <= DEEPEST:
        return found  # without a look at each of a million numbers
    level: list[Any] = [[found]]
    for _ in range(DEEPEST + 1):
        inner = (value.values() if isinstance(value, dict) else value for value in level)
        if not (level := [value for values in inner for value in values if value and isinstance(value, _NESTS)]):
            return found
    raise BadFrameError(_TOO_DEEP)


def _read(value: object) -> Any:
    """Return what a text says in JSON; a text without its quotes, and what is no text, unchanged."""
    try:
        return _loaded(value) if isinstance(value, str) else value
    except BadFrameError:
        raise
    except ValueError:
        return value


def _within(frame: str) -> dict[str, Any]:
    """Return a frame that came in pieces or in a picture: neither holds another one."""
    data = _parsed(frame)
    if data.get("op") in ("fragment", "png"):
        raise BadFrameError("what comes in pieces or in a picture is a frame itself")
    return data


def _whole(name: str) -> str:
    """Return the action of which a topic or service is a part; other names unchanged."""
    return name.partition("/_action/")[0] or name


def _class_of(kind: str, type_: str, of: str = "") -> Any:
    """Return the class of a type of messages, services or actions; `of` are words behind its name.

    Raises:
        BadFrameError: if it is not known here.
    """
    try:
        return _CLASSES[kind](type_)
    except KeyError as error:
        raise BadFrameError(f"the type '{type_}'{of} is not known here") from error


def _is_name(name: str) -> bool:
    return len(name) <= _LONGEST_ROS_NAME and _NAME.fullmatch(name) is not None


def _key(data: Mapping[str, Any]) -> str | None:
    """Return what tells a subscription from others of the same topic."""
    identity = data.get("id")
    return None if identity is None else str(identity)


def _count(data: Mapping[str, Any], key: str, most: float = 2**31) -> int:
    value = data.get(key, 0)
    if value is None:
        return 0
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < min(most, 2**53):
        raise BadFrameError(f"'{key}' is a number that is not negative")
    return int(value)


def _piece(data: Mapping[str, Any]) -> int:
    """Return how many characters a piece of a frame shall have; 0 if it shall be sent as a whole."""
    return max(encodings.SMALLEST_PIECE, size) if (size := _count(data, "fragment_size")) else 0


def _named(given: object, names: Sequence[str]) -> dict[str, Any]:
    """Return arguments by name.

    Raises:
        WrongMessageError: if they are neither a map nor a list, or a text in them could not be written to a file.
    """
    try:
        json.dumps(given, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        raise WrongMessageError("a text in 'args' has half of a pair of surrogates, which is no character") from error
    if isinstance(given, list):
        return dict(zip(names, given, strict=False))
    if not isinstance(given, dict | None):
        raise WrongMessageError("'args' is a map or a list")
    return given or {}


def _identified(identity: object) -> dict[str, object]:
    """Return the id of a frame, if its client has given one."""
    return {} if identity is None else {"id": identity}


def _short(value: object) -> str:
    text = str(value) if isinstance(value, str | int | float | bool | None) else type(value).__name__
    return plain(text[:_SHOWN]) + ("..." if len(text) > _SHOWN else "")


def _finite(value: object) -> object:
    """Return data without numbers that JSON does not have: a client's own `id` may be one."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Mapping):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return value
