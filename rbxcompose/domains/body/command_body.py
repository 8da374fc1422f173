"""What a robot on the bus publishes about its body: the description, and the tree of frames."""

from __future__ import annotations

from rbxcompose.base.findings import Finding
from rbxcompose.base.geometry import Transform3
from rbxcompose.base.printable import plain
from rbxcompose.base.transforms import TransformTree
from rbxcompose.bus.graph import GraphName, WireType, find
from rbxcompose.bus.names import TRANSFORMS
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.guest import NO_NAME, NOBODY, Guest, ReceivedMessage
from rbxcompose.commands.messages import EchoReader
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import read_urdf
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import String
from rbxcompose.msgs.tf2_msgs import TFMessage

DESCRIPTION = "robot_description"


def described(guest: Guest, wanted: str | None) -> GraphName:
    """Return the topic with the URDF; with a namespace, it lies below that.

    Raises:
        NotDoneError: if there is none, or there are several and none is `wanted`.
    """
    given = [topic for topic in guest.graph().topics if topic.givers and String.TYPE in topic.types]
    names = (
        [f"/{wanted.lstrip('/')}"] if wanted else [item.name for item in given if item.name.endswith(f"/{DESCRIPTION}")]
    )
    if len(names) == 1 and (found := find(given, names[0])):
        return found
    if len(names) > 1:
        listed = ", ".join(map(plain, names))
        raise NotDoneError(NO_NAME.at(None, f"several topics have a URDF: {listed}", help="choose one with '--topic'"))
    if wanted is None:
        from rbxcompose.domains.body.source import NO_BODY  # the compiler, which nothing else here needs

        raise NotDoneError(NO_BODY.at(None, f"nothing publishes '{DESCRIPTION}': this robot has no body"))
    words = f"nothing publishes a URDF on '{plain(wanted)}'"
    raise NotDoneError(NO_NAME.misspelt(None, words, names[0], [topic.name for topic in given], "topics with texts"))


def described_body(guest: Guest, topic: GraphName, timeout: float) -> Body:
    """Return the body that a latched topic describes.

    Raises:
        NotDoneError: if none comes in time, or it is wrong.
    """
    texts: list[str] = []
    reader = EchoReader(topic)

    def received(one: ReceivedMessage) -> None:
        message = reader.read(one)
        texts.extend([message.data] if isinstance(message, String) else [])

    guest.listen(topic, received)
    if not guest.run(lambda: bool(texts), timeout):
        raise NotDoneError(NOBODY.at(None, f"no URDF comes on '{topic.name}'"))
    root = read_urdf(texts[-1], topic.name)
    body, findings = (Body(""), [root]) if isinstance(root, Finding) else read_body(root)
    if findings:
        raise NotDoneError(findings[0])
    return body


class ReceivedFrames:
    """The tree as received so far, and who has placed each frame."""

    def __init__(self, guest: Guest) -> None:
        self.tree = TransformTree()
        self.writers: dict[str, str] = {}  # names of nodes, by frame
        self._guest = guest
        self._topics = [graph_name for graph_name in guest.graph().topics if graph_name.name.endswith(TRANSFORMS)]
        self._nodes = {end.gid: end.node for topic in self._topics for end in topic.givers}
        self._waiting = set(self._nodes)
        for topic in self._topics:
            self._listen(topic)

    @property
    def is_whole(self) -> bool:
        """Return whether something has been received from every publisher."""
        return not self._waiting

    @property
    def kind(self) -> WireType | None:
        """Return the type that others use for transforms, None if nobody does."""
        kinds = (kind for topic in self._topics for kind in topic.kinds if kind.type == TFMessage.TYPE)
        return next(kinds, None)

    def _listen(self, topic: GraphName) -> None:
        reader, is_static = EchoReader(topic), topic.name.endswith("_static")
        self._guest.listen(topic, lambda received: self._receive(reader, received, is_static))

    def _receive(self, reader: EchoReader, received: ReceivedMessage, is_static: bool) -> None:
        self._waiting.discard(received.sender)
        message = reader.read(received)
        for link in message.transforms if isinstance(message, TFMessage) else ():
            parent, child, time = link.header.frame_id, link.child_frame_id, to_nanoseconds(link.header.stamp)
            moved, turned = link.transform.translation, link.transform.rotation
            pose = Transform3((moved.x, moved.y, moved.z), (turned.x, turned.y, turned.z, turned.w))
            measured = time or received.stamp or None
            answer = self.tree.set(parent, child, pose, stamp=received.time, static=is_static, measured=measured)
            if answer.accepted:
                self.writers[child] = self._nodes.get(received.sender, "")
