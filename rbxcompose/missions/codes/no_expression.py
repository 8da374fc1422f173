"""A condition or a value that cannot be read."""

from __future__ import annotations

from rbxcompose.findings import kind

NO_EXPRESSION = kind(
    "RBX4111",
    """A condition or a value cannot be read

The caret marks where reading stopped. `$name` is looked up while the robot runs; numbers have units.

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
