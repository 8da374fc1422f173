"""Topics in a recording: what it stores about them, their definitions, and their selection; what is found in one."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from fnmatch import fnmatchcase

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Severity, kind
from rbxcompose.bus.tokens import EndpointToken, EntityKind
from rbxcompose.bus.wire import ros_qos
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import DefinitionError, FieldType, Structures, parse_type, type_hash
from rbxcompose.msgs.packages import joined, parts, short
from rbxcompose.sdk.ports import Qos, name_problem

UNREADABLE = kind("RBX9201")
DAMAGED = kind("RBX9202", Severity.WARNING)
UNWRITABLE = kind("RBX9203")
RECOVERED = kind("RBX9204", Severity.WARNING)
NOTHING = kind("RBX9205")
NOT_REPLAYED = kind("RBX9206", Severity.WARNING)
SENT_ALREADY = kind("RBX9210")
NOT_ENOUGH = kind("RBX9208")
DIFFERENT = kind("RBX9209")
LOST = kind("RBX9207", Severity.WARNING)

CDR = "cdr"
HASH, CLASS, ROS_QOS = "topic_type_hash", "rbxcompose.class", "offered_qos_profiles"  # keys of a channel's metadata
NODE = "rbxcompose.node"

_DDS_TYPE = re.compile(r"(\w+)::(msg|srv|action)::dds_::(\w+)_", re.ASCII)
_TYPE = re.compile(r"\w+/(msg|srv|action)/\w+", re.ASCII)
_HASH = re.compile(r"\w{1,100}", re.ASCII)
_BETWEEN_TEXTS = re.compile(r"^={20,}+\s*?\n", re.MULTILINE)
_QOS = re.compile(r"(?P<reliability>\d?):(?P<durability>\d?):(?P<history>\d?),(?P<depth>\d{0,9}):.*")
_FOREVER = "{sec: 9223372036, nsec: 854775807}"  # how ROS writes "no limit"
_IS_LATCHED = re.compile(r"^[ \t-]*+durability: *+(1|transient_local)[ \t\r]*+$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class RecordedTopic:
    """A topic with one type; another type, or another publisher, under the same name is another topic."""

    name: str  # with its leading slash
    type: str  # `geometry_msgs/msg/Twist`
    hash: str  # of the type, as in the keys of the bus
    qos: Qos = Qos.STATE
    definition: str = ""  # text of the type and of all types inside it; empty if unknown
    encoding: str = CDR
    node: str = ""  # the publisher; empty if not recorded

    def metadata(self) -> dict[str, str]:
        """Return the metadata of a channel besides name and type: hash and quality of service, for ROS and for us."""
        qos = ros_qos(self.qos)
        profile = (
            f"- history: {2 if qos.keeps_all else 1}\n  depth: {qos.depth}\n"
            f"  reliability: {1 if qos.is_reliable else 2}\n  durability: {1 if qos.is_transient_local else 2}\n"
            f"  deadline: {_FOREVER}\n  lifespan: {_FOREVER}\n"
            f"  liveliness: 1\n  liveliness_lease_duration: {_FOREVER}\n  avoid_ros_namespace_conventions: false\n"
        )
        node = {NODE: self.node} if self.node else {}
        return {HASH: self.hash, CLASS: self.qos.value, ROS_QOS: profile, **node}


def qos_of_metadata(metadata: Mapping[str, str]) -> Qos:
    """Return the class of a recorded topic; recordings by other tools say at most whether it is latched."""
    written = metadata.get(CLASS, "")
    if written in set(Qos):
        return Qos(written)
    return Qos.LATCHED if _IS_LATCHED.search(metadata.get(ROS_QOS, "")) else Qos.STATE


def by_name(counts: Mapping[RecordedTopic, int]) -> dict[RecordedTopic, int]:
    """Return the numbers of messages, summed over all publishers of a topic."""
    found: dict[RecordedTopic, int] = {}
    for topic, count in counts.items():
        whole = replace(topic, node="")
        found[whole] = found.get(whole, 0) + count
    return found


def why_not_replayable(topic: RecordedTopic) -> str:
    """Return why a recorded topic cannot be published, or nothing: its names must be valid on the bus, which is CDR."""
    if topic.encoding != CDR:
        return f"the encoding is '{topic.encoding}', not '{CDR}'"
    if not (_TYPE.fullmatch(topic.type) and _HASH.fullmatch(topic.hash)):
        try:
            return f"the hash of the type is '{topic.hash}', not '{hash_of(topic.type, topic.definition)}'"
        except DefinitionError as error:
            return f"the type has no hash: {error}"
    return name_problem(topic.name)


def hash_of(name: str, definition: str) -> str:
    """Return the hash of a type from its definition; a type without a text in it is the known one of this name.

    Raises:
        DefinitionError: if a text is not valid, or a type is not known.
    """
    if not _TYPE.fullmatch(name):
        raise DefinitionError(f"'{name}' is no type of ROS 2")
    own, *inner = _BETWEEN_TEXTS.split(definition)
    texts = {name: own} if own.strip() else {}
    for head, _, text in (part.partition("\n") for part in inner):
        texts[registry.full_name(head.removeprefix("MSG:").strip(), "msg")] = text
    try:
        return type_hash(name, Structures(texts))
    except KeyError as error:
        raise DefinitionError(f"there is no definition of {error}") from error


def topic_of(token: EndpointToken) -> RecordedTopic | None:
    """Return the topic of a publisher, without a definition; None for other endpoints and for invalid names."""
    found = _DDS_TYPE.fullmatch(token.dds_type)
    if token.kind is not EntityKind.PUBLISHER or not found or name_problem(token.name):
        return None
    if not _HASH.fullmatch(token.type_hash):  # the hash becomes part of a key
        return None
    return RecordedTopic(token.name, "/".join(found.groups()), token.type_hash, qos_of_token(token.qos))


def qos_of_token(text: str) -> Qos:
    """Return the class nearest to the quality of service of a token."""
    found = _QOS.fullmatch(text)
    if not found:
        return Qos.STATE
    if found["durability"] == "1":
        return Qos.LATCHED
    if found["reliability"] == "2":
        return Qos.BULK
    if found["history"] == "2":
        return Qos.EVENT
    return Qos.COMMAND if found["depth"] == "1" else Qos.STATE


@dataclass(frozen=True, slots=True)
class Selection:
    """A selection of topics: by name (`odom`, `/camera/*`) and by class; an empty one means all."""

    patterns: Sequence[str] = ()
    classes: Sequence[Qos] = ()

    def takes(self, topic: RecordedTopic) -> bool:
        """Return whether a topic is selected."""
        return self.names(topic) and (not self.classes or topic.qos in self.classes)

    def names(self, topic: RecordedTopic) -> bool:
        """Return whether a topic has one of the selected names."""
        return not self.patterns or any(matches(topic.name, pattern) for pattern in self.patterns)


def matches(name: str, pattern: str) -> bool:
    """Return whether the name of a topic matches a pattern, both with or without their leading slash."""
    return fnmatchcase(name.lstrip("/"), pattern.lstrip("/"))


def definition_of(name: str) -> str:
    """Return the text of a type (`nav_msgs/msg/Odometry`), then those of the types in it, each below a line of `=`.

    It is empty for a type without a known definition.
    """
    try:
        return joined(name, parts(name, _types), _text)
    except KeyError:
        return ""


def _types(name: str) -> list[FieldType]:
    return [parse_type(text) for text in registry.message(name).FIELDS.values()]


def _text(name: str) -> str:
    if "/msg/" in name:
        with suppress(KeyError):  # a type of another package
            return registry.text_of(name)
    # Of a part of an action or such a type, its fields are what counts.
    return "".join(f"{_short_type(type_)} {field}\n" for field, type_ in registry.message(name).FIELDS.items())


def _short_type(text: str) -> str:
    base = parse_type(text).base
    return text.replace(base, short(base), 1) if "/" in base else text


@dataclass(frozen=True, slots=True)
class Recorded:
    """A message as bytes, with the times [ns since 1970] when it arrived and when it was published."""

    topic: RecordedTopic
    log_time: int
    publish_time: int
    sequence: int  # counted by its publisher; 0 if not counted
    payload: bytes
