"""A value of the wrong type."""

from __future__ import annotations

from rbxcompose.findings import kind

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
    is_fixable=True,
)
