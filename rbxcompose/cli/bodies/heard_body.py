"""The body that a robot on the bus describes."""

from __future__ import annotations

from rbxcompose.body.model import Body
from rbxcompose.body.urdf import read_body
from rbxcompose.body.xml_reader import read_urdf
from rbxcompose.bus.graph import GraphName, find
from rbxcompose.cli.bodies.actions import NO_BODY
from rbxcompose.cli.bus.entities import NO_NAME, NOBODY
from rbxcompose.cli.bus.guest import Guest, HeardMessage
from rbxcompose.cli.bus.topic_echo import EchoReader
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.findings import Finding
from rbxcompose.msgs.std_msgs import String
from rbxcompose.printable import plain

DESCRIPTION = "robot_description"


def described(guest: Guest, wanted: str | None) -> GraphName:
    """Return the topic with the URDF; with a namespace, it lies below that.

    Raises:
        NotDoneError: if there is none, or there are several and none is `wanted`.
    """
    given = [one for one in guest.graph().topics if one.givers and String.TYPE in one.types]
    names = (
        [f"/{wanted.lstrip('/')}"] if wanted else [one.name for one in given if one.name.endswith(f"/{DESCRIPTION}")]
    )
    if len(names) == 1 and (found := find(given, names[0])):
        return found
    if len(names) > 1:
        listed = ", ".join(map(plain, names))
        raise NotDoneError(NO_NAME.at(None, f"several topics have a URDF: {listed}", help="choose one with '--topic'"))
    if wanted is None:
        raise NotDoneError(NO_BODY.at(None, f"nothing publishes '{DESCRIPTION}': this robot has no body"))
    words = f"nothing publishes a URDF on '{plain(wanted)}'"
    raise NotDoneError(NO_NAME.misspelt(None, words, names[0], [one.name for one in given], "topics with texts"))


def described_body(guest: Guest, topic: GraphName, timeout: float) -> Body:
    """Return the body that a latched topic describes.

    Raises:
        NotDoneError: if none comes in time, or it is wrong.
    """
    texts: list[str] = []
    reader = EchoReader(topic)

    def heard(one: HeardMessage) -> None:
        message = reader.read(one)
        texts.extend([message.data] if isinstance(message, String) else [])

    guest.listen(topic, heard)
    if not guest.run(lambda: bool(texts), timeout):
        raise NotDoneError(NOBODY.at(None, f"no URDF comes on '{topic.name}'"))
    root = read_urdf(texts[-1], topic.name)
    body, findings = (Body(""), [root]) if isinstance(root, Finding) else read_body(root)
    if findings:
        raise NotDoneError(findings[0])
    return body
