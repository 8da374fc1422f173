"""The link of a robot's page, and its picture for the camera of a phone."""

import sys

from rbxcompose.commands.console import emit
from rbxcompose.domains.console.access import (
    LOCAL_NAMES,
    Role,
    link,
    network_address,
    own_secret,
    secret_path,
    token_of,
)


def show_link(robot: str, port: int, *, is_lan: bool, role: Role = Role.OPERATE) -> None:
    """Print the link to a robot's page; one for the network has a token, and in a terminal a QR code."""
    if not is_lan:
        emit(f"console: {link(LOCAL_NAMES[0], port)}")
        return
    try:
        token = token_of(own_secret(), robot, role)
    except OSError as error:
        emit(f"console: there is no link: {secret_path()}: {error.strerror}")
        return
    address = link(network_address(), port, token)
    emit(f"console, to {role.word}: {address}")
    if sys.stdout.isatty():
        import segno  # of the extra `console`, which a robot with a page has

        segno.make(address, error="l").terminal(compact=True, border=2)
