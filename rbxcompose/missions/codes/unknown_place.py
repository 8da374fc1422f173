"""A place that the robot does not have."""

from __future__ import annotations

from rbxcompose.findings import Finding, Related, Span, kind

UNKNOWN_PLACE = kind(
    "RBX4103",
    """A mission names a place that the robot does not know

Places are declared in the robot's `places:`.

Bad:

```yaml
do:
  go_to: dok
```

Good:

```yaml
do:
  go_to: dock
```
""",
    is_fixable=True,
)


def removed_place(span: Span, name: str, remover: Span) -> Finding:
    """Return the finding for a place that the robot had until a layer removed it."""
    return UNKNOWN_PLACE.at(span, f"there is no place '{name}' any more", related=[Related(remover, "removed here")])
