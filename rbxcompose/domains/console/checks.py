"""Rules about the console."""

from collections.abc import Iterator

from rbxcompose.base.findings import WIRING, Finding, suggest
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.sdk.capabilities import ServesPage
from rbxcompose.sdk.ports import In, Out, Qos

PICTURES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")


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


@check("RBX9603", closed=(WIRING,))
def camera_without_pictures(robot: Robot) -> Iterator[Finding]:
    """The camera that drivers are to see publishes no pictures."""
    for component, page in robot.declared(ServesPage):
        shown = page.camera.value
        if shown and not any(end.type_name in PICTURES for end in robot.writers.get(shown, ())):
            ends = [end for end in robot.ends if isinstance(end.port, Out) and end.type_name in PICTURES]
            names = sorted({end.instance for end in ends} | {end.topic.lstrip("/") for end in ends})
            written = shown.lstrip("/")
            yield camera_without_pictures.at(
                robot.value(*component.path, "drive", "camera"),
                f"nothing publishes pictures on '{written}', and no camera has this name",
                help=suggest(written, names, "the cameras and their topics"),
            )
