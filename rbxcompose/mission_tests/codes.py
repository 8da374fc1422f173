"""Possible errors in the file of a test."""

from __future__ import annotations

from rbxcompose.findings import Severity, kind

UNKNOWN = kind(
    "RBX4201",
    """A test names something that does not exist

Everything that a test mocks, sets, expects or counts must exist: a skill of the robot, a value, a step of the mission,
a datum. A step that the mission does not have could never be found, and a `never` for it would always pass.

Bad:
```yaml
mocks:
  recharg:
    takes: 5 s
```
Good:
```yaml
mocks:
  recharge:
    takes: 5 s
```
""",
    is_fixable=True,
)
WRONG_VALUE = kind(
    "RBX4202",
    """A value of a test has the wrong type

A value that a test sets or expects has a different type or unit than its target.

Bad:
```yaml
events:
  - at: 4 s
    set:
      battery: 20 m
```
Good:
```yaml
events:
  - at: 4 s
    set:
      battery: 20 %
```
""",
)
NEVER = kind(
    "RBX4203",
    """Something in a test is impossible

It cannot happen, whatever the mission does: an event or a step after the end of the test, a mission that continues
while the robot is stopped, a call number 0, `running` without the time to watch.

Bad:
```yaml
events:
  - at: 90 s
    stop: true
expect:
  outcome: running
  for: 60 s
```
Good:
```yaml
events:
  - at: 30 s
    stop: true
expect:
  outcome: running
  for: 60 s
```
""",
)
NO_STEP = kind(
    "RBX4204",
    """A step of a test is written wrongly

A step is the name of a skill, a node or a state. A skill may be followed by the value of its main argument, or by a
map of its arguments below it. `ended` and `at` go beside it.

Bad:
```yaml
expect:
  steps:
    - ended: success
```
Good:
```yaml
expect:
  steps:
    - go_to: corner_1
      ended: success
```
""",
)
UNUSED_MOCK = kind(
    "RBX4205",
    """A mock of a skill that the mission does not use

The test mocks a skill that is never called. It may be left over, or the wrong skill.

Bad: a mock of `recharge`, in a test of a mission that never recharges.
Good: mocks of the skills that the mission uses.
""",
    Severity.WARNING,
)
