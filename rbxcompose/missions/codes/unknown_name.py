"""A `$name` that means nothing."""

from __future__ import annotations

from rbxcompose.findings import kind

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
