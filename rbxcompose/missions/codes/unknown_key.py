"""A key that belongs to nothing."""

from __future__ import annotations

from rbxcompose.findings import kind

UNKNOWN_KEY = kind(
    "RBX4101",
    """Unknown kind, option or modifier in a mission

Every key of a mission node is a kind, an option of that kind, a modifier or a skill. Any other key would have no
effect, so it is refused.

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
