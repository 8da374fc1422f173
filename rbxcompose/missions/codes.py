"""The kinds of findings about missions, with their docs pages."""

from __future__ import annotations

from rbxcompose.findings import Finding, Related, Severity, Span, kind

UNKNOWN_KEY = kind(
    "RBX4101",
    """Unknown kind, option or modifier in a mission

Every key of a mission node is a kind, an option of that kind, a modifier or a skill. Any other key would be ignored
silently, so it is refused.

Bad:

```yaml
do:
  repeat: 2
  untill: $battery < 20 %
  do: recharge
```

Good:

```yaml
do:
  repeat: 2
  until: $battery < 20 %
  do: recharge
```
""",
    is_fixable=True,
)
UNKNOWN_SKILL = kind(
    "RBX4102",
    """A mission uses a skill that the robot does not have

Skills are the actions that the robot's components serve. Nobody on this robot serves an action of this name.

Bad:

```yaml
do:
  goto: dock
```

Good:

```yaml
do:
  go_to: dock
```
""",
    is_fixable=True,
)
UNKNOWN_PLACE = kind(
    "RBX4103",
    """A mission names a place that the robot does not know

Places are declared in the robot's `places:`.

Bad:

```yaml
do:
  go_to: dok
```

Good:

```yaml
do:
  go_to: dock
```
""",
    is_fixable=True,
)
UNKNOWN_NAME = kind(
    "RBX4104",
    """A mission reads or sets a name that does not exist

`$name` is an input or a datum of the mission, a value of the robot, `$pose`, or the item of a loop around the node.
An interrupt does not see the items of loops. `set` writes data only.

Bad:

```yaml
do:
  wait_for: $batery > 90 %
```

Good:

```yaml
do:
  wait_for: $battery > 90 %
```
""",
    is_fixable=True,
)
WRONG_ARGUMENT = kind(
    "RBX4105",
    """Wrong, missing or unknown argument of a skill

A skill takes the fields of its action's goal as arguments; a single value is the main one.

Bad:

```yaml
do:
  go_to:
    plce: dock
```

Good:

```yaml
do:
  go_to:
    pose: dock
```
""",
    is_fixable=True,
)
WRONG_TYPE = kind(
    "RBX4106",
    """A condition or a value has the wrong type or dimension

Conditions are true or false, durations are times, and quantities are compared with quantities of the same dimension.

Bad:

```yaml
do:
  wait_for: $battery < 30 s
```

Good:

```yaml
do:
  wait_for: $battery < 30 %
```
""",
)
NEVER_WAITS = kind(
    "RBX4107",
    """A loop without an end never waits

Nothing in the body takes time, so that it would run as fast as it can; the engine slows it down to the mission's
rate.

Bad:

```yaml
do:
  repeat: forever
  do:
    check: $battery < 30 %
```

Good:

```yaml
do:
  repeat: forever
  every: 1 s
  do:
    check: $battery < 30 %
```
""",
    Severity.WARNING,
)
TWO_STEPS = kind(
    "RBX4108",
    """Two steps in one mapping

A node has exactly one kind or skill. Steps of a list begin with a dash each.

Bad:

```yaml
do:
  - go_to: dock
    recharge:
```

Good:

```yaml
do:
  - go_to: dock
  - recharge
```
""",
    is_fixable=True,
)
MISSING = kind(
    "RBX4109",
    """Something is missing in a mission

A loop needs a body, a list needs a step, a mission needs something to do.

Bad:

```yaml
do:
  repeat: 3
```

Good:

```yaml
do:
  repeat: 3
  do: recharge
```
""",
)
WRONG_SHAPE = kind(
    "RBX4110",
    """A part of a mission has the wrong form

A node is a word (a skill without arguments), a list (a sequence) or a mapping with one kind or skill. With settings
below it, a step needs a colon.

Bad:

```yaml
do:
  - recharge
    timeout
```

Good:

```yaml
do:
  - recharge:
    timeout: 30 s
```
""",
    is_fixable=True,
)
NO_EXPRESSION = kind(
    "RBX4111",
    """A condition or a value cannot be read

The caret stands where reading stopped. `$name` is looked up while the robot runs, numbers have units.

Bad:

```yaml
do:
  wait_for: $battery <
```

Good:

```yaml
do:
  wait_for: $battery < 30 %
```
""",
)
NAME_CLASH = kind(
    "RBX4112",
    """Two things in a mission have one name

Inputs, data, values of the robot and the items of loops share one scope, in which each name means one thing. A name
may not be that of a kind or a skill either.

Bad:

```yaml
data:
  repeat: 0
```

Good:

```yaml
data:
  round: 0
```
""",
)
WRONG_INPUT = kind(
    "RBX4113",
    """An input of a mission is missing, unknown or out of its range

`with:` gives values to the inputs that the mission declares.

Bad:

```yaml
missions:
  patrol:
    file: missions/patrol.yaml
    with:
      rounds: many
```

Good:

```yaml
missions:
  patrol:
    file: missions/patrol.yaml
    with:
      rounds: 3
```
""",
    is_fixable=True,
)
NOT_A_CHOICE = kind(
    "RBX4114",
    """Not one of the words that an option takes

Bad:

```yaml
do:
  for: corner
  in: [corner_1, corner_2]
  if_one_fails: skip
  do:
    go_to: $corner
```

Good:

```yaml
do:
  for: corner
  in: [corner_1, corner_2]
  if_one_fails: next
  do:
    go_to: $corner
```
""",
    is_fixable=True,
)
TOO_DEEP = kind(
    "RBX4115",
    """Mission nodes are nested too deeply

A mission has at most 40 levels of nodes: nobody could follow more. Give a part of it to a mission of its own.

Bad:

```yaml
do:
  - - - - - - recharge    # and so on, more than 40 levels
```

Good:

```yaml
do: recharge
```
""",
)
NOT_RESTARTABLE = kind(
    "RBX4116",
    """An interrupt may start a skill again that cannot be restarted

`afterwards: continue` starts what was cut short again from its beginning. The skill says that this does it no good.

Bad:

```yaml
interrupts:
  battery_low:
    when: $battery < 20 %
    do: recharge
    afterwards: continue
do: pour                # a skill that cannot be restarted
```

Good:

```yaml
do:
  - if: $battery < 20 %
    then: recharge
  - pour
```
""",
    Severity.WARNING,
)


def removed_place(span: Span, name: str, remover: Span) -> Finding:
    """Return the finding for a place that the robot had until a layer over it took it away."""
    return UNKNOWN_PLACE.at(span, f"there is no place '{name}' any more", related=[Related(remover, "removed here")])
