"""Links to a robot's page: where it is in the network, the token within, and the picture for the camera of a phone."""

import socket
import sys

from rbxcompose.commands.console import emit
from rbxcompose.domains.console.access import LOCAL_NAMES, Role, own_secret, secret_path, token_of


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


def link(host: str, port: int, token: str = "") -> str:
    """Return the address of the page; what is behind `#` is not sent by browsers, and in no log of a server."""
    return f"http://{host}:{port}/" + (f"#token={token}" if token else "")


def network_address() -> str:
    """Return the address that others in the network reach this machine by; of this machine only, if there is none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as chosen:
        try:
            chosen.connect(("192.0.2.1", 9))  # documentation's network: nothing is sent
        except OSError:
            return LOCAL_NAMES[0]
        return str(chosen.getsockname()[0])
