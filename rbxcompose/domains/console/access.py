"""Who may do what by the console: roles, the tokens that give them, and which pages may talk to it.

A console of this machine trusts its users, as the bus does. One that is open to the network gives each visitor the
role of the token that it shows: by a link, the cookie that the page got for it, a header `Authorization`, or the
operation `auth`.
"""

import base64
import errno
import hashlib
import hmac
import ipaddress
import os
import secrets
import socket
from collections.abc import Collection, Mapping
from contextlib import suppress
from enum import IntEnum
from fnmatch import fnmatchcase
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import replace_file, state_folder

LOCAL_NAMES = ("127.0.0.1", "localhost", "[::1]")  # of this machine
_SECRET_BYTES = 32


class Role(IntEnum):
    """What a visitor may do; each role may do what those before it may."""

    NOBODY = 0
    VIEW = 1
    OPERATE = 2
    CONFIGURE = 3

    @property
    def word(self) -> str:
        """Return its name for people."""
        return self.name.lower()


_ROLES = {
    "subscribe": Role.VIEW,
    "unsubscribe": Role.VIEW,
    "set_level": Role.VIEW,
    "status": Role.VIEW,
    "fragment": Role.VIEW,  # what is within is judged by itself
    "png": Role.VIEW,
    "auth": Role.NOBODY,
    "advertise_service": Role.CONFIGURE,  # others would believe its answers
    "advertise_action": Role.CONFIGURE,
}
EDITS: Mapping[str, tuple[Role, tuple[str, ...]]] = {
    "mission/aloud": (Role.VIEW, ("mission", "text")),
    "mission/check": (Role.VIEW, ("mission", "text")),
    "mission/edit": (Role.VIEW, ("mission", "text", "operation")),
    "mission/form": (Role.VIEW, ("mission", "text", "path")),
    "mission/list": (Role.VIEW, ()),
    "mission/look": (Role.VIEW, ("mission", "text")),
    "mission/new": (Role.CONFIGURE, ("mission", "template")),
    "mission/palette": (Role.VIEW, ("mission",)),
    "mission/read": (Role.VIEW, ("mission",)),
    "mission/save": (Role.CONFIGURE, ("mission", "text", "hash")),
    "mission/templates": (Role.VIEW, ("mission",)),
    "mission/test": (Role.OPERATE, ("mission", "text")),
    "mission/test_new": (Role.CONFIGURE, ("mission",)),
    "mission/try": (Role.OPERATE, ("mission", "text")),
    "robot/apply": (Role.CONFIGURE, ("generation",)),
    "robot/compare": (Role.VIEW, ()),
    "robot/look": (Role.VIEW, ("subject", "changes", "hashes")),
    "robot/palette": (Role.VIEW, ()),
    "robot/revert": (Role.CONFIGURE, ("generation",)),
    "robot/save": (Role.CONFIGURE, ("subject", "changes", "hashes")),
}
"""What can be asked about a mission, and about what the robot is, as services below `/console`: the role that it needs,
and its arguments. Of texts and changes that nobody else sees, all who look may ask."""
_SERVICES = {
    "/console/stop": Role.VIEW,  # whoever sees that something goes wrong
    "/console/ask": Role.VIEW,  # the request decides
    "/console/log": Role.VIEW,
    "/console/rates": Role.VIEW,
    "/console/tested": Role.VIEW,
    "/console/save": Role.CONFIGURE,
    **{f"/console/{name}": least for name, (least, _) in EDITS.items()},
    "/rosapi/set_param": Role.CONFIGURE,
    "/rosapi/delete_param": Role.CONFIGURE,
}
OF_PARAMETERS = {
    "rcl_interfaces/srv/DescribeParameters": Role.VIEW,
    "rcl_interfaces/srv/GetParameters": Role.VIEW,
    "rcl_interfaces/srv/GetParameterTypes": Role.VIEW,
    "rcl_interfaces/srv/ListParameters": Role.VIEW,
    "rcl_interfaces/srv/SetParameters": Role.CONFIGURE,
    "rcl_interfaces/srv/SetParametersAtomically": Role.CONFIGURE,
    "rbxcompose_parameters/srv/ChangeParameters": Role.CONFIGURE,
}
"""The roles for the services that nodes have for their parameters, by type: any service may have their names."""


@dataclass(frozen=True, slots=True)
class OperationTarget:
    """An operation and what it is carried out on: all that is asked when it is checked, noted and done."""

    op: str
    name: str = ""
    """The full name of the topic, service or action; empty if the operation has none."""
    written: str = ""
    """That name as the client writes it."""
    others: tuple[str, ...] = ()
    """Other names by which a guard may mean it."""
    type: str = ""
    """The type of a service of the bus; empty for those of the gateway."""
    old: tuple[str, str, str] | None = None
    """Of a topic that actions have in ROS 1: the name that it gives the action, the action, and which topic it is."""


def needed(target: OperationTarget, guarded: Mapping[str, Role]) -> Role:
    """Return the least role that may have an operation of rosbridge carried out.

    Args:
        target: the operation, and what it is carried out on.
        guarded: least roles by patterns of names of topics, services and actions: `/arm/*`.
    """
    least = _ROLES.get(target.op, Role.OPERATE)
    if target.op == "call_service" and target.type:
        least = OF_PARAMETERS.get(target.type, Role.OPERATE)
    elif target.op == "call_service":
        least = _SERVICES.get(target.name, Role.VIEW if target.name.startswith("/rosapi/") else Role.OPERATE)
    elif least <= Role.VIEW:
        return least  # looking harms nobody
    names = target.name, *target.others
    return max([least, *(guarded[each] for each in guarded if any(fnmatchcase(name, each) for name in names))])


# Tokens


def secret_path() -> Path:
    """Return the file of which the tokens of this user's robots are made."""
    return state_folder() / "console_secret"


def own_secret() -> bytes:
    """Return the secret of this user; made, for nobody else to read, if there is none.

    Raises:
        OSError: if it can neither be read nor written, or is damaged.
    """
    path = secret_path()
    if not path.exists():
        made = path.with_name(f"{path.name}.{os.getpid()}")
        _write_secret(made)
        with suppress(FileExistsError):  # another process was first: its links are out
            os.link(made, path)
        made.unlink()
    secret = path.read_bytes()
    if len(secret) != _SECRET_BYTES:  # tokens of a known secret could be guessed
        raise OSError(errno.EINVAL, "it is damaged: 'rbxcompose console --renew' makes another", str(path))
    return secret


def renew_secret() -> None:
    """Make another secret: no link that was given away opens anything any more.

    Raises:
        OSError: if it cannot be written.
    """
    _write_secret(secret_path())


def _write_secret(path: Path) -> None:
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    replace_file(path, secrets.token_bytes(_SECRET_BYTES), mode=0o600)


def token_of(secret: bytes, robot: str, role: Role) -> str:
    """Return the token that gives a role at a robot."""
    digest = hmac.digest(secret, f"{robot}\n{role.word}".encode(), hashlib.sha256)
    return base64.urlsafe_b64encode(digest).decode().rstrip("=")


def role_of(secret: bytes, robot: str, token: str) -> Role:
    """Return the role that a token gives at a robot; it takes as long for a wrong one as for a right one."""
    given = token.encode(errors="replace")
    found = Role.NOBODY
    for role in (Role.VIEW, Role.OPERATE, Role.CONFIGURE):
        if hmac.compare_digest(token_of(secret, robot, role).encode(), given):
            found = role
    return found


# Pages


@dataclass(frozen=True, slots=True)
class Door:
    """Which pages may talk to the console: its own, those of its system, and those that the manifest names.

    A name that others may point to this machine is none of its own: a page of theirs would pass as one of the robot.
    """

    port: int
    is_lan: bool
    names: tuple[str, ...] = ()
    """Of this machine in the network."""
    origins: frozenset[str] = frozenset()
    """Of other pages: `http://localhost:8181`."""
    fleet: Collection[str] = ()
    """Where pages of its system are: `ADDRESS:PORT`, without an address on this machine."""

    def lets_in(self, host: str, origin: str) -> bool:
        """Return whether a request with these headers comes from a page that may, or from no page."""
        (name, port), origin = self._place(host), origin.lower()
        if port != str(self.port) or not self._is_own(name):
            return False
        if not origin or origin in self.origins:
            return True
        scheme, _, shown = origin.partition("://")
        page, port = _split(shown, "80")
        is_same = page == name or {page, name} <= {*LOCAL_NAMES}
        is_near = is_same and (port == str(self.port) or f":{port}" in self.fleet)
        return scheme == "http" and (is_near or f"{page}:{port}" in self.fleet)

    def sources(self, host: str) -> str:
        """Return what a page that was opened by this header may connect to, as a policy has it.

        A policy cannot name addresses of IPv6.
        """
        name = self._place(host)[0]
        places = (f"{name}{place}" if place.startswith(":") else place for place in self.fleet)
        shown = sorted(place for place in places if place.count(":") == 1) if self._is_own(name) else ()
        return " ".join(("'self'", *(f"ws://{place}" for place in shown)))

    def _place(self, host: str) -> tuple[str, str]:
        return _split(host.lower(), str(self.port))

    def _is_own(self, name: str) -> bool:
        if name in LOCAL_NAMES:
            return True
        if not self.is_lan:
            return False
        try:
            ipaddress.ip_address(name.strip("[]"))
        except ValueError:
            return name in self.names
        return True


def _split(place: str, port: str) -> tuple[str, str]:
    """Return the name and the port of a place: this one if it has none."""
    name, _, number = place.rpartition(":")
    return (name, number) if number.isdecimal() else (place, port)


def network_names() -> tuple[str, ...]:
    """Return the names by which others in the network know this machine."""
    name = socket.gethostname().lower()
    return tuple(dict.fromkeys((name, f"{name.partition('.')[0]}.local")))
