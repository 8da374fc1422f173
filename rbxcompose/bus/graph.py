"""Which publishers, servers and clients are on the bus, read from liveliness tokens."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.local import Route
from rbxcompose.bus.names import ros_type
from rbxcompose.bus.tokens import EndpointToken, EntityKind, NodeToken, gid, parse_token
from rbxcompose.bus.wire import RosQos, WireProfile

_SEND_GOAL = "/_action/send_goal"
_WIRE = WireProfile("tokens")


@dataclass(frozen=True, slots=True, order=True)
class WireType:
    """What the two ends of a wire must agree in: the ROS type and its hash."""

    type: str
    hash: str


@dataclass(frozen=True, slots=True)
class GraphEnd:
    """A publisher, subscription, server or client. `qos` is None if its token has one that we cannot read."""

    node: str
    kind: WireType
    gid: bytes
    qos: RosQos | None


@dataclass(frozen=True, slots=True)
class GraphName:
    """A topic, service or action: its givers (publishers, servers) and takers (subscriptions, clients)."""

    name: str
    givers: tuple[GraphEnd, ...]
    takers: tuple[GraphEnd, ...]

    @property
    def kinds(self) -> list[WireType]:
        """Return all types with their hashes: those of the givers first, since they count more."""
        given = sorted({end.kind for end in self.givers})
        return given + sorted({end.kind for end in self.takers} - set(given))

    @property
    def types(self) -> list[str]:
        """Return the names of its types."""
        return list(dict.fromkeys(kind.type for kind in self.kinds))

    @property
    def is_hidden(self) -> bool:
        """Return whether ROS tools leave it out of lists: a part of the name begins with `_`."""
        return "/_" in self.name

    @property
    def clash(self) -> str:
        """Return why some of its ends never meet, or nothing if all agree."""
        if len(self.types) > 1:
            return f"different types: {', '.join(self.types)}"
        if len(self.kinds) > 1:
            return f"different definitions of {self.types[0]}: {', '.join(kind.hash for kind in self.kinds)}"
        return ""


@dataclass(frozen=True, slots=True)
class Graph:
    """Everything on the bus at one moment, sorted by name. The parts of actions are also topics and services."""

    nodes: Sequence[str]
    topics: Sequence[GraphName]
    services: Sequence[GraphName]
    actions: Sequence[GraphName]

    @classmethod
    def of(cls, keys: Iterable[str]) -> Graph:
        """Read tokens and skip unknown ones."""
        tokens = [token for key in sorted(set(keys)) if (token := parse_token(key)) is not None]
        ends = [token for token in tokens if isinstance(token, EndpointToken)]
        return cls(
            nodes=sorted(_node(token) for token in tokens if isinstance(token, NodeToken)),
            topics=_named(ends, EntityKind.PUBLISHER, EntityKind.SUBSCRIPTION),
            services=_named(ends, EntityKind.SERVER, EntityKind.CLIENT),
            actions=_actions(ends),
        )


def find(names: Iterable[GraphName], wanted: str) -> GraphName | None:
    """Return the entry of that name, given with or without its leading slash."""
    full = f"/{wanted.lstrip('/')}"
    return next((graph_name for graph_name in names if graph_name.name == full), None)


def _named(ends: Iterable[EndpointToken], giving: EntityKind, taking: EntityKind) -> list[GraphName]:
    givers: dict[str, list[GraphEnd]] = {}
    takers: dict[str, list[GraphEnd]] = {}
    for token in ends:
        if token.kind in (giving, taking):
            (givers if token.kind is giving else takers).setdefault(token.name, []).append(_end(token))
    return [
        GraphName(name, tuple(givers.get(name, ())), tuple(takers.get(name, ()))) for name in sorted({*givers, *takers})
    ]


def _actions(ends: Iterable[EndpointToken]) -> list[GraphName]:
    """Return the actions: each is recognised by the service that takes its goals."""
    sending = [token for token in ends if token.name.endswith(_SEND_GOAL)]
    return [
        GraphName(
            graph_name.name.removesuffix(_SEND_GOAL), _as_action(graph_name.givers), _as_action(graph_name.takers)
        )
        for graph_name in _named(sending, EntityKind.SERVER, EntityKind.CLIENT)
    ]


def _as_action(ends: Iterable[GraphEnd]) -> tuple[GraphEnd, ...]:
    return tuple(
        GraphEnd(end.node, WireType(end.kind.type.removesuffix("_SendGoal"), end.kind.hash), end.gid, end.qos)
        for end in ends
    )


def _end(token: EndpointToken) -> GraphEnd:
    try:
        qos = _WIRE.read_qos(token.qos)
    except ValueError:
        qos = None
    return GraphEnd(_node(token.node), WireType(ros_type(token.dds_type), token.type_hash), gid(token.key), qos)


def _node(token: NodeToken) -> str:
    return f"{token.namespace}/{token.name}"


_MOST_GONE = 1000  # publishers that are gone and remembered
SILENCE = 5.0  # [s] after which a publisher of a state or a latched topic should have published


@dataclass(frozen=True, slots=True)
class TopicWriter:
    """A publisher in another process, since when it is known [s], and since when but for cuts of a link."""

    token: EndpointToken
    since: float
    first: float


@dataclass(frozen=True, slots=True)
class TopicReader:
    """What matters to writers about a subscription of this process; `arrived` [s] is when the last message came, and
    `begun` [s] when it began to listen."""

    owner: str
    route: Route
    type_hash: str
    arrived: float
    expects_speech: bool  # an existing writer should publish before long, unlike one of events or commands
    is_latched: bool = False  # what came before the whole robot was active counts, too
    begun: float = 0.0


class Writers:
    """The publishers of all other sessions, by topic."""

    def __init__(self, session: str) -> None:
        self._session = session
        self._by_topic: dict[str, dict[str, TopicWriter]] = {}
        self._gone: dict[str, float] = {}  # [s] when those were known first that a link may bring back

    def apply(self, key: str, now: float, *, is_there: bool) -> None:
        """Apply a token that appeared or went."""
        token = parse_token(key)
        if not isinstance(token, EndpointToken) or token.kind is not EntityKind.PUBLISHER:
            return
        if token.node.session == self._session:
            return
        known = self._by_topic.setdefault(token.name, {})
        if is_there:
            known.setdefault(key, TopicWriter(token, now, self._gone.pop(key, now)))
        elif (writer := known.pop(key, None)) is not None:
            self._gone[key] = writer.first
            if len(self._gone) > _MOST_GONE:
                del self._gone[next(iter(self._gone))]
        if not known:
            del self._by_topic[token.name]

    def trouble(self, reader: TopicReader, now: float, started: float) -> str:
        """Return why `reader` receives nothing at `now` from a writer of its topic; empty if all is well.

        Silence counts from `started` [s], when the whole robot became active.
        """
        (topic, message), writers = reader.route, self._of(reader.route[0])
        for writer in writers:
            theirs = ros_type(writer.token.dds_type)
            if theirs != message:
                return f"'{_name(writer)}' publishes {theirs} on {topic}, '{reader.owner}' reads {message}"
            if writer.token.type_hash != reader.type_hash:
                version = f"another version of {message} on {topic}"
                return f"'{_name(writer)}' publishes {version} than '{reader.owner}' reads"
        if not writers or not reader.expects_speech:
            return ""
        known = min(writer.since for writer in writers)
        since = max(started, known, reader.begun)
        # The only message of a latched topic may come while the robot starts, and before the token of its publisher. It
        # does not come again when the link to its publisher does.
        latched = min(writer.first for writer in writers) - SILENCE
        if reader.arrived >= (latched if reader.is_latched else since) or now - since <= SILENCE:
            return ""
        names = " and ".join(dict.fromkeys(f"'{_name(writer)}'" for writer in writers))
        return f"'{reader.owner}' has received nothing on {topic} for {now - since:.0f} s, though {names} publishes it"

    def _of(self, topic: str) -> list[TopicWriter]:
        known = self._by_topic.get(topic, {})
        return [known[key] for key in sorted(known)]


def _name(writer: TopicWriter) -> str:
    return f"{writer.token.node.namespace}/{writer.token.node.name}".removeprefix("/")
