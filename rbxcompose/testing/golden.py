"""Golden files: output for users, kept as text beside the tests and compared exactly."""

from pathlib import Path

from rbxcompose.base.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Golden:
    """A folder of golden files; `update` writes them instead of comparing (`pytest --update-golden`)."""

    folder: Path
    update: bool = False

    def check(self, name: str, text: str) -> None:
        """Compare `text` with the golden file `name`.

        Raises:
            AssertionError: if they differ, or the file does not exist.
        """
        path = self.folder / name
        if self.update:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        assert path.exists(), f"no golden file {path.name}: run pytest --update-golden and read what it wrote"  # noqa: S101
        assert text == path.read_text(encoding="utf-8"), f"{path.name} differs"  # noqa: S101
