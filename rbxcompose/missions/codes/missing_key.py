"""Something required that is missing."""

from __future__ import annotations

from rbxcompose.findings import kind

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
