"""Rules about the console."""

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, suggest
from rbxcompose.base.rules import WIRING
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.sdk.capabilities import ServesPage
from rbxcompose.sdk.ports import In, Qos


@check("RBX9602", closed=(WIRING,))
def drive_topic_without_a_reader(robot: Robot) -> Iterator[Finding]:
    """People drive by a topic that nothing reads."""
    for component, page in robot.declared(ServesPage):
        topic = page.commands.value.lstrip("/")
        if topic and f"/{topic}" not in robot.readers:
            ends = [end for end in robot.ends if isinstance(end.port, In) and end.port.qos is Qos.COMMAND]
            read = sorted({end.topic.lstrip("/") for end in ends})
            yield drive_topic_without_a_reader.at(
                robot.value(*component.path, "drive", "topic"),
                f"nothing reads '{topic}', so the console cannot drive",
                help=suggest(topic, read, "the topics for commands"),
            )
