"""Another form than the language has."""

from __future__ import annotations

from rbxcompose.findings import kind

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
