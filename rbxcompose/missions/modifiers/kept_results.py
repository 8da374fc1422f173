"""`save`: keep the result of a node in the mission's data."""

from __future__ import annotations

from rbxcompose.missions import sdk


class SaveTask(sdk.Decorator):
    """Keeps the result at the end."""

    __slots__ = ("name",)

    def __init__(self, site: sdk.Site, options: Save, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.name = options.kept_as.text

    def begin(self) -> int:
        """Start the task inside."""
        return self.proceed()

    def proceed(self) -> int:
        """Continue, and keep the result at the end."""
        status = self.advance(self.inner)
        if status != sdk.RUNNING and self.name:
            self.run.data[self.name] = self.inner.result()
        return status


@sdk.modifier("save", SaveTask)
@sdk.dataclass(frozen=True, slots=True)
class Save(sdk.Plain):
    """Keep the result of a skill or a `call`, the outputs of a `use`, or `{done, failed}` of a `for`.

    It is also kept after a failure.

    Example:
        do:
          - for: corner
            in: [corner_1, corner_2]
            if_one_fails: next
            do:
              go_to: $corner
            optional: true
            save: tour
          - log: $tour.failed could not be reached
    """

    kept_as: sdk.ScalarNode = sdk.new_name("a name for the result")

    value = None
    clause = sdk.says("keeping the result as {kept_as}")

    @property
    def saved(self) -> sdk.ScalarNode | None:
        """Return the name."""
        return self.kept_as if self.kept_as.text else None

    @property
    def said(self) -> str:
        """Return the name."""
        return self.kept_as.text
