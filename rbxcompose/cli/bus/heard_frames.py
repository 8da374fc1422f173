"""The tree of frames as a guest has heard it."""

from __future__ import annotations

from rbxcompose.body.transforms import TransformTree
from rbxcompose.bus.graph import GraphName, WireType
from rbxcompose.cli.bus.guest import Guest, HeardMessage
from rbxcompose.cli.bus.topic_echo import EchoReader
from rbxcompose.geometry import Transform3
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.tf2_msgs import TFMessage

_TOPICS = ("/tf", "/tf_static")


class HeardFrames:
    """The tree as received so far, and who has placed each frame."""

    def __init__(self, guest: Guest) -> None:
        self.tree = TransformTree()
        self.writers: dict[str, str] = {}  # names of nodes, by frame
        self._guest = guest
        self._topics = [one for one in guest.graph().topics if one.name.endswith(_TOPICS)]
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
        self._guest.listen(topic, lambda heard: self._heard(reader, heard, is_static))

    def _heard(self, reader: EchoReader, heard: HeardMessage, is_static: bool) -> None:
        self._waiting.discard(heard.sender)
        message = reader.read(heard)
        for link in message.transforms if isinstance(message, TFMessage) else ():
            parent, child, time = link.header.frame_id, link.child_frame_id, to_nanoseconds(link.header.stamp)
            moved, turned = link.transform.translation, link.transform.rotation
            pose = Transform3((moved.x, moved.y, moved.z), (turned.x, turned.y, turned.z, turned.w))
            measured = time or heard.stamp or None
            answer = self.tree.set(parent, child, pose, stamp=heard.time, static=is_static, measured=measured)
            if answer.accepted:
                self.writers[child] = self._nodes.get(heard.sender, "")
