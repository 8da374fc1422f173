"""Nodes that are nested too deeply."""

from __future__ import annotations

from rbxcompose.findings import kind

TOO_DEEP = kind(
    "RBX4115",
    """Mission nodes are nested too deeply

A mission has at most 40 levels of nodes; more would be unreadable. Move some of it to a mission of its own.

Bad:

```yaml
do:
  - - - - - - recharge    # and so on, more than 40 levels
```

Good:

```yaml
do: recharge
```
""",
)
