"""Publishers in other processes, read from tokens, and reasons why nothing arrives. Pure: time is an argument."""

from __future__ import annotations

from rbxcompose.bus.local import Route
from rbxcompose.bus.names import ros_type
from rbxcompose.bus.tokens import EndpointToken, EntityKind, parse_token
from rbxcompose.dataclass import dataclass

SILENCE = 5.0  # [s] after which a publisher of a state or a latched topic should have published


@dataclass(frozen=True, slots=True)
class TopicWriter:
    """A publisher in another process, and since when it is known [s]."""

    token: EndpointToken
    since: float


@dataclass(frozen=True, slots=True)
class TopicReader:
    """What matters to writers about a subscription of this process; `arrived` [s] is when the last message came."""

    owner: str
    route: Route
    type_hash: str
    arrived: float
    expects_speech: bool  # an existing writer should publish before long, unlike one of events or commands
    is_latched: bool = False  # what came before the whole robot was active counts, too


class Writers:
    """The publishers of all other sessions, by topic."""

    def __init__(self, session: str) -> None:
        self._session = session
        self._by_topic: dict[str, dict[str, TopicWriter]] = {}

    def heard(self, key: str, now: float, *, is_there: bool) -> None:
        """Apply a token that appeared or went."""
        token = parse_token(key)
        if not isinstance(token, EndpointToken) or token.kind is not EntityKind.PUBLISHER:
            return
        if token.node.session == self._session:
            return
        known = self._by_topic.setdefault(token.name, {})
        if is_there:
            known.setdefault(key, TopicWriter(token, now))
        else:
            known.pop(key, None)
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
        since = max(started, known)
        # The only message of a latched topic may come while the robot starts, and before the token of its publisher.
        if reader.arrived >= (known - SILENCE if reader.is_latched else since) or now - since <= SILENCE:
            return ""
        names = " and ".join(dict.fromkeys(f"'{_name(writer)}'" for writer in writers))
        return f"'{reader.owner}' has received nothing on {topic} for {now - since:.0f} s, though {names} publishes it"

    def _of(self, topic: str) -> list[TopicWriter]:
        known = self._by_topic.get(topic, {})
        return [known[key] for key in sorted(known)]


def _name(writer: TopicWriter) -> str:
    return f"{writer.token.node.namespace}/{writer.token.node.name}".removeprefix("/")
