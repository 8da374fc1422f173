"""Secrets: text that a manifest refers to but never contains, `${secret.NAME}`."""

import errno
import os
import stat
from collections.abc import Mapping
from itertools import islice
from pathlib import Path

from rbxcompose.base.config import Secret
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import NotRegularError, open_regular
from rbxcompose.base.findings import DID_YOU_MEAN, nearest
from rbxcompose.manifest.tree import SECRET

FOLDER = "secrets"
VARIABLE = "RBX_SECRET_"
_MOST_NAMES = 1000


class NoSecretError(Exception):
    """Raised when a secret is not available; `help` says what to do, `near` is a secret with a similar name."""

    def __init__(self, message: str, help: str, near: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.help = help
        self.near = near


@dataclass(frozen=True, slots=True)
class Secrets:
    """The sources of secrets: the environment (`RBX_SECRET_NAME`), else the files `secrets/NAME` of a project."""

    project: Path
    environment: Mapping[str, str]

    def get(self, name: str) -> Secret:
        """Return a secret.

        Raises:
            NoSecretError: if it does not exist, or others could read it.
        """
        value = self.environment.get(f"{VARIABLE}{name.upper()}")
        return Secret(value if value is not None else self._read(name), name)

    def _read(self, name: str) -> str:
        shown = f"{FOLDER}/{name}"
        try:
            with open_regular(self.project / FOLDER / name, follow=False) as file:  # a link could lead anywhere
                status = os.fstat(file.fileno())
                if stat.S_IMODE(status.st_mode) & 0o077 or status.st_uid != os.getuid():
                    raise NoSecretError(f"others may read the secret in '{shown}'", f"chmod 600 {shown}")
                data = file.read(SECRET + 1)
        except NotRegularError:
            message = f"'{shown}' is not a regular file"
            raise NoSecretError(message, f"put the secret into the file '{shown}'") from None
        except OSError as error:
            is_missing = error.errno in (errno.ENOENT, errno.ENOTDIR)
            reason = "does not exist" if is_missing else f"cannot be read: {os.strerror(error.errno or 0)}"
            message = f"the secret '{name}' is not available: the file '{shown}' {reason}"
            near = next(iter(nearest(name, self._names())), "") if is_missing else ""
            there = f"put it into '{shown}' with mode 0600, or into the variable {VARIABLE}{name.upper()}; a value "
            there += "that is no secret is written here, or filled in by '${args.NAME}'"
            raise NoSecretError(message, f"{DID_YOU_MEAN} '{near}'?" if near else there, near) from None
        if len(data) > SECRET:
            raise NoSecretError(f"'{shown}' is larger than {SECRET:,} bytes", "a secret is one short text")
        return _text(data, shown)

    def _names(self) -> list[str]:
        """Return the names of the secrets that there are."""
        given = [name.removeprefix(VARIABLE).lower() for name in self.environment if name.startswith(VARIABLE)]
        try:
            with os.scandir(self.project / FOLDER) as entries:
                return sorted([*given, *(entry.name for entry in islice(entries, _MOST_NAMES))])
        except OSError:
            return given


def _text(data: bytes, shown: str) -> str:
    try:
        return data.decode("utf-8").removesuffix("\n").removesuffix("\r")
    except UnicodeDecodeError:
        raise NoSecretError(f"'{shown}' is not UTF-8 text", "write it as text, such as base64") from None
