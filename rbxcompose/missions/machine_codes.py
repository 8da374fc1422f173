"""Findings about machines, parallels, other missions, and what is named across a mission."""

from __future__ import annotations

from rbxcompose.findings import Severity, kind

UNKNOWN_STATE = kind(
    "RBX4140",
    """A transition leads to a state that does not exist

States are declared under `states:`, ends under `ends:`; the ends `finished` and `failed` always exist.

Bad:

```yaml
machine:
  start: away
  states:
    away:
      do:
        go_to: corner_1
      next:
        success: finishd
        failure: failed
```

Good:

```yaml
machine:
  start: away
  states:
    away:
      do:
        go_to: corner_1
      next:
        success: finished
        failure: failed
```
""",
    is_fixable=True,
)
OPEN_OUTCOME = kind(
    "RBX4141",
    """An outcome of a state leads nowhere

Every way in which the body of a state may end needs a transition. An outcome without one of its own takes that of what
it counts as, `success` or `failure`. One word after `next` is enough where the body cannot fail.

Bad:

```yaml
machine:
  start: away
  states:
    away:
      do:
        go_to: corner_1
      next:
        success: finished
```

Good:

```yaml
machine:
  start: away
  states:
    away:
      do:
        go_to: corner_1
      next:
        success: finished
        failure: failed
```
""",
)
UNKNOWN_OUTCOME = kind(
    "RBX4142",
    """A transition for an outcome that cannot occur

The body of the state never ends in that way: it may be misspelt, or left over from an earlier version.

Bad:

```yaml
machine:
  start: talk
  states:
    talk:
      do:
        log: hello
      next:
        succes: finished
```

Good:

```yaml
machine:
  start: talk
  states:
    talk:
      do:
        log: hello
      next: finished
```
""",
    is_fixable=True,
)
UNREACHABLE_STATE = kind(
    "RBX4143",
    """A state that no way leads to

The machine begins in `start` and goes where `next` leads it; nothing leads to this state.

Bad:

```yaml
machine:
  start: talk
  states:
    talk:
      do:
        log: hello
      next: finished
    drive:
      do:
        go_to: dock
      next:
        success: finished
        failure: failed
```

Good:

```yaml
machine:
  start: talk
  states:
    talk:
      do:
        log: hello
      next: drive
    drive:
      do:
        go_to: dock
      next:
        success: finished
        failure: failed
```
""",
    Severity.WARNING,
)
UNKNOWN_MISSION = kind(
    "RBX4144",
    """A mission uses one that the robot does not have

`use` takes a name under the robot's `missions:`.

Bad:

```yaml
do:
  use: patrl
```

Good:

```yaml
do:
  use: patrol
```
""",
    is_fixable=True,
)
UNKNOWN_TARGET = kind(
    "RBX4145",
    """An interrupt restarts what does not exist

`afterwards: {restart: NAME}` takes the `name` of a node, a state, or the item of a loop.

Bad:

```yaml
interrupts:
  battery_low:
    when: $battery < 20 %
    do: recharge
    afterwards:
      restart: rooom
do:
  for: room
  in: [corner_1, corner_2]
  do:
    go_to: $room
```

Good:

```yaml
interrupts:
  battery_low:
    when: $battery < 20 %
    do: recharge
    afterwards:
      restart: room
do:
  for: room
  in: [corner_1, corner_2]
  do:
    go_to: $room
```
""",
    is_fixable=True,
)
