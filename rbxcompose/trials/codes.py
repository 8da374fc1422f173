"""What can be wrong with the file of a test."""

from __future__ import annotations

from rbxcompose.findings import Severity, kind

UNKNOWN = kind(
    "RBX4201",
    """A test names what is not there

What a test mocks, sets, looks for or counts must exist: a skill of the robot, a value, a step of the mission, a datum.
A step that the mission does not have could not be found, and one that must never be done would never be.

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

A value that a test sets or expects is of another type or unit than what it belongs to.

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
    """Something in a test can never be

What is written cannot happen, whatever the mission does: an event or a step after the end of the test, a mission that
goes on while the robot is stopped, a call number 0, `running` without the time for which it is watched.

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

A step is the name of a skill, a node or a state. The value of a skill's main argument may stand behind it, or a map of
its arguments below it, and `ended` and `at` beside it.

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

The test answers for a skill that is never asked. It may be a leftover, or the wrong skill.

Bad: a mock of `recharge`, in a test of a mission that never recharges.
Good: mocks of the skills that the mission uses.
""",
    Severity.WARNING,
)
