"""The libraries of the extra `picture`, which may be missing."""

from __future__ import annotations

from importlib.util import find_spec

from rbxcompose.findings import Finding, kind

NOT_DRAWN = kind("RBX9042")


class MissingLibraryError(Exception):
    """Raised where a library is missing; the finding says which."""

    def __init__(self, finding: Finding) -> None:
        super().__init__(finding.message)
        self.finding = finding


def need(what: str, *names: str) -> None:
    """Require modules for `what`, a plural.

    Raises:
        MissingLibraryError: if one is not installed.
    """
    if missing := [name for name in names if find_spec(name) is None]:
        message = f"{what} need {' and '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} not installed"
        raise MissingLibraryError(NOT_DRAWN.at(None, message, help="pip install 'rbxcompose[picture]'"))
