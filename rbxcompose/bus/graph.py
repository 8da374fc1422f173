"""Pure core: which nodes are on the bus and what they offer, read from liveliness tokens. ROS nodes look like ours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rbxcompose.bus.names import ros_type
from rbxcompose.bus.tokens import EndpointToken, EntityKind, NodeToken, gid, parse_token
from rbxcompose.bus.wire import RosQos, WireProfile
from rbxcompose.dataclass import dataclass

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
    return next((one for one in names if one.name == full), None)


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
        GraphName(one.name.removesuffix(_SEND_GOAL), _as_action(one.givers), _as_action(one.takers))
        for one in _named(sending, EntityKind.SERVER, EntityKind.CLIENT)
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
