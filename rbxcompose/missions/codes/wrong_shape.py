"""A form that the language does not have."""

from __future__ import annotations

from rbxcompose.findings import kind

WRONG_SHAPE = kind(
    "RBX4110",
    """A part of a mission has the wrong form

A step is a word (a skill without arguments), a list of steps with dashes (a sequence), or a word with a colon and its
settings below it. Write several values in brackets: `[dock, window]`.

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
