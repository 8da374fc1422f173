"""The kinds of findings about what missions send, about branches at the same time, and about cases."""

from __future__ import annotations

from rbxcompose.findings import Severity, kind

UNKNOWN_CHANNEL = kind(
    "RBX4150",
    """A mission publishes or calls what the robot does not have

`publish` takes a topic of the robot, `call` one of its services, both by the name that the components use.

Bad:

```yaml
do:
  publish: cmd_vel/telop
```

Good:

```yaml
do:
  publish: cmd_vel/teleop
```
""",
    is_fixable=True,
)
WRONG_FIELD = kind(
    "RBX4151",
    """A message of a mission does not fit its type

The fields of a message are those of its ROS type, and each has a type of its own. `rbxcompose msg show TYPE` lists
them.

Bad:

```yaml
do:
  publish: cmd_vel/teleop
  message:
    liner:
      x: 0.1
```

Good:

```yaml
do:
  publish: cmd_vel/teleop
  message:
    linear:
      x: 0.1
```
""",
    is_fixable=True,
)
SAME_CLAIM = kind(
    "RBX4152",
    """Two branches of a parallel need the same part of the robot

A skill claims what it needs for itself, such as the base. Two that claim the same at the same time work against each
other: the robot would drive to two places at once.

Bad:

```yaml
do:
  parallel:
    - go_to: corner_1
    - go_to: corner_2
```

Good:

```yaml
do:
  - go_to: corner_1
  - go_to: corner_2
```
""",
    Severity.WARNING,
)
TOO_MANY = kind(
    "RBX4153",
    """A parallel counts more branches than it has

`succeed_when: 3` of two branches can never come about.

Bad:

```yaml
do:
  parallel:
    - wait: 1 s
    - wait: 2 s
  succeed_when: 3
```

Good:

```yaml
do:
  parallel:
    - wait: 1 s
    - wait: 2 s
  succeed_when: 2
```
""",
)
SAME_CASE = kind(
    "RBX4154",
    """A case that is never taken

The first case that is equal to the value is taken. A second one that is equal to it, or one of a value that the choice
cannot have, is never taken.

Bad:

```yaml
data:
  rounds: 1
do:
  choose: $rounds
  cases:
    1:
      log: one
    1.0:
      log: one again
```

Good:

```yaml
data:
  rounds: 1
do:
  choose: $rounds
  cases:
    1:
      log: one
    2:
      log: two
```
""",
    Severity.WARNING,
)
