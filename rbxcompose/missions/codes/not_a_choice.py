"""A word that an option does not take."""

from __future__ import annotations

from rbxcompose.findings import kind

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
