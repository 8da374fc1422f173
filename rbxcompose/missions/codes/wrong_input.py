"""A value for an input that does not fit."""

from __future__ import annotations

from rbxcompose.findings import kind

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
