"""Liveliness tokens: how ROS 2 participants find each other on Zenoh, and the GIDs that follow from them."""

from enum import StrEnum

import xxhash

from rbxcompose.base.dataclass import dataclass

SPACE = "@ros2_lv"


class EntityKind(StrEnum):
    """The kind of entity that a token represents."""

    NODE = "NN"
    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVER = "SS"
    CLIENT = "SC"


@dataclass(frozen=True, slots=True)
class NodeToken:
    """A ROS node: one component of ours. `namespace` has its leading slash, or is empty."""

    domain: int
    session: str  # Zenoh's id of the session
    id: int
    name: str
    namespace: str = ""
    enclave: str = ""

    @property
    def key(self) -> str:
        """Return the token's text."""
        return f"{SPACE}/{self.domain}/{self.session}/{self.id}/{self.id}/{EntityKind.NODE}/{self._place()}"

    def endpoint_key(self, kind: EntityKind, id: int, name: str, dds_type: str, type_hash: str, qos: str) -> str:
        """Return the token text of one of the node's endpoints."""
        start = f"{SPACE}/{self.domain}/{self.session}/{self.id}/{id}/{kind}/{self._place()}"
        return f"{start}/{mangle(name)}/{dds_type}/{type_hash}/{qos}"

    def _place(self) -> str:
        return f"{mangle(self.enclave)}/{mangle(self.namespace)}/{self.name}"


@dataclass(frozen=True, slots=True)
class EndpointToken:
    """A publisher, subscription, server or client of a node. `name` has its leading slash."""

    node: NodeToken
    id: int
    kind: EntityKind
    name: str
    dds_type: str
    type_hash: str
    qos: str

    @property
    def key(self) -> str:
        """Return the token's text."""
        return self.node.endpoint_key(self.kind, self.id, self.name, self.dds_type, self.type_hash, self.qos)


def parse_token(key: str) -> NodeToken | EndpointToken | None:
    """Read a token; None if it is unknown. Parts that newer versions append are ignored."""
    chunks = key.split("/")
    try:
        space, domain, session, node_id, id_, kind, enclave, namespace, name, *endpoint = chunks
        node = NodeToken(int(domain), session, int(node_id), name, _demangle(namespace), _demangle(enclave))
        if space != SPACE:
            return None
        if EntityKind(kind) is EntityKind.NODE:
            return node
        full_name, dds_type, type_hash, qos, *_ = endpoint
        return EndpointToken(node, int(id_), EntityKind(kind), _demangle(full_name), dds_type, type_hash, qos)
    except ValueError:
        return None


def endpoint_pattern(domain: int, kind: EntityKind, name: str, dds_type: str, type_hash: str) -> str:
    """Return the key expression that matches all endpoints of one kind for one name and type."""
    # `**` also matches what newer versions append after the quality of service.
    return f"{SPACE}/{domain}/*/*/*/{kind}/*/*/*/{mangle(name)}/{dds_type}/{type_hash}/**"


def publishers_pattern(domain: int) -> str:
    """Return the key expression that matches all publishers of a domain."""
    return f"{SPACE}/{domain}/*/*/*/{EntityKind.PUBLISHER}/**"


def session_of(key: str) -> str:
    """Return the Zenoh id of the session that declared the token `key`."""
    return key.split("/", 3)[2]


def gid(key: str) -> bytes:
    """Return the 16 bytes that identify an endpoint, derived from the text of its token."""
    return xxhash.xxh3_128_intdigest(key.encode()).to_bytes(16, "little")


def mangle(name: str) -> str:
    """Return a name as one chunk of a token's key."""
    return name.replace("/", "%") or "%"  # no chunk of a key may be empty


def _demangle(chunk: str) -> str:
    return "" if chunk == "%" else chunk.replace("%", "/")
