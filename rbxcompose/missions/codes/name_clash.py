"""One name for two things."""

from __future__ import annotations

from rbxcompose.findings import kind

NAME_CLASH = kind(
    "RBX4112",
    """Two things in a mission have one name

Inputs, data, values of the robot and the items of loops share one scope, in which each name has one meaning. The name
of a kind or a skill cannot be used either.

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
