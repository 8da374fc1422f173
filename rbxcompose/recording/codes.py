"""Kinds of findings about recordings."""

from rbxcompose.findings import Severity, kind

UNREADABLE = kind(
    "RBX9201",
    """The recording cannot be read

There is no such file, it may not be opened, or it is no recording: those are MCAP files, as `rbxcompose record`,
`ros2 bag record -s mcap` and Foxglove write them.
""",
)
DAMAGED = kind(
    "RBX9202",
    """The recording is damaged

It was cut off, or some of its bytes have changed. What comes before that place is read, the rest is left out; the file
stays as it is.
""",
    Severity.WARNING,
)
UNWRITABLE = kind(
    "RBX9203",
    """The recording cannot be written

The file is there already, its folder may not be written to, or the disk is full. A recording that was cut short by this
is recovered at the next `rbxcompose record` or `replay` in its folder.
""",
)
RECOVERED = kind(
    "RBX9204",
    """An unfinished recording was found

A recorder was killed, or its computer lost power: a file whose name ends in `.mcap.part` was left. What is whole in it
is copied to a new file with an index, which gets the name that was meant. If that is not possible, the message says why
and the file stays as it is.
""",
    Severity.WARNING,
)
NOTHING = kind(
    "RBX9205",
    """There is nothing to replay

The recording has no messages in ROS 2's encoding (`cdr`) with a known type on the topics that were chosen, or none
after the time given by `--from`. `rbxcompose replay FILE --info` shows what is in it.
""",
)
NOT_REPLAYED = kind(
    "RBX9206",
    """Some topics of the recording are not replayed

Topics of the class `command` make a robot move: they are replayed only if `--topics` names them. Topics in another
encoding than `cdr`, or without a known type, cannot be published.
""",
    Severity.WARNING,
)
SENT_ALREADY = kind(
    "RBX9210",
    """The recording has topics that somebody sends now

Messages of then would stand beside those of now: an old `/tf` leads a robot astray that drives, an old status hides
what is wrong. A stopped robot sends too. Choose other topics with `--topics` or `--class`, replay where no robot is, or
take `--over` if old and new messages side by side are what you want.

Bad: `rbxcompose replay run.mcap` while the robot is up
Good: `rbxcompose replay run.mcap --topics '/camera/*'`
""",
)
NOT_ENOUGH = kind(
    "RBX9208",
    """The recording has not enough to run a component again

`replay --into` needs all inputs of the component, in their order, with the requests that it got and the replies to its
own. Those are in what `rbxcompose up --rate max --record FILE` writes; `rbxcompose record` sees the topics only. The
component must be one of the robot, and a secret of its configuration comes from the robot's file: `--robot PATH`.
""",
)
DIFFERENT = kind(
    "RBX9209",
    """A component does not send what it sent when it was recorded

The message names the first difference: the robot time, the topic, the field and both values. If code or configuration
have changed on purpose, that is what they changed. If not, the component asks for something that is no input of it,
such as a clock of the system or a random number without a seed, or somebody published to the recorded run from outside.
""",
)
LOST = kind(
    "RBX9207",
    """Messages are missing from the recording

They came faster than they could be written, so that the oldest of those that waited were left out.
""",
    Severity.WARNING,
)
