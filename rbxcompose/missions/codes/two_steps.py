"""Two steps where only one is allowed."""

from __future__ import annotations

from rbxcompose.findings import kind

TWO_STEPS = kind(
    "RBX4108",
    """Two steps in one mapping

A node has exactly one kind or skill. In a list, each step begins with a dash.

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
