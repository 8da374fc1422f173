"""Kinds of findings about recordings."""

from rbxcompose.findings import Severity, kind

UNREADABLE = kind(
    "RBX9201",
    """The recording cannot be read

The file does not exist, may not be opened, or is not a recording. Recordings are MCAP files, as `rbxcompose record`,
`ros2 bag record -s mcap` and Foxglove write them.
""",
)
DAMAGED = kind(
    "RBX9202",
    """The recording is damaged

It was cut off, or some of its bytes have changed. Everything before that place is read, the rest is left out; the file
stays as it is.
""",
    Severity.WARNING,
)
UNWRITABLE = kind(
    "RBX9203",
    """The recording cannot be written

The file exists already, its folder is not writable, or the disk is full. The next `rbxcompose record` or `replay` in
that folder recovers a recording that was cut short by this.
""",
)
RECOVERED = kind(
    "RBX9204",
    """An unfinished recording was found

A recorder was killed or its computer lost power, and left a file whose name ends in `.mcap.part`. Its intact content is
copied to a new file with an index, under the intended name. If that is not possible, the message says why and the file
stays as it is.
""",
    Severity.WARNING,
)
NOTHING = kind(
    "RBX9205",
    """There is nothing to replay

The chosen topics have no messages in ROS 2's encoding (`cdr`) with a known type, or none after the time given by
`--from`. `rbxcompose replay FILE --info` shows what is in the recording.
""",
)
NOT_REPLAYED = kind(
    "RBX9206",
    """Some topics of the recording are not replayed

Topics of the class `command` make a robot move: they are replayed only if `--topics` names them. Topics in an encoding
other than `cdr`, or without a known type, cannot be published.
""",
    Severity.WARNING,
)
SENT_ALREADY = kind(
    "RBX9210",
    """Topics of the recording are being published now

Old messages would mix with new ones: an old `/tf` misleads a robot that drives, an old status hides what is wrong. A
stopped robot publishes too. Such topics are left out, and it is an error if nothing else is to be replayed. Use
`--namespace old` to see old messages beside new ones, `--alone` to replay them away from the robot, or `--over` to mix
them.

Bad: `rbxcompose replay run.mcap --topics odom` while the robot is up
Good: `rbxcompose replay run.mcap --topics odom --namespace old`
""",
)
NOT_ENOUGH = kind(
    "RBX9208",
    """The recording lacks what is needed to run a component again

`replay --into` needs all inputs of the component in their order, with the requests that it received and the responses
to its own. `rbxcompose up --rate max --record FILE` writes them; `rbxcompose record` sees only topics. The component
must belong to the robot. A secret in its configuration comes from the robot's file: `--robot PATH`.
""",
)
DIFFERENT = kind(
    "RBX9209",
    """A component does not send what was recorded

The message names the first difference: robot time, topic, field and both values. If you changed code or configuration
on purpose, this is the effect. If not, the component uses something that is not one of its inputs, such as a system
clock or a random number without a seed, or something outside published to the recorded run.
""",
)
LOST = kind(
    "RBX9207",
    """Messages are missing from the recording

They arrived faster than they could be written, so the oldest waiting ones were dropped.
""",
    Severity.WARNING,
)
