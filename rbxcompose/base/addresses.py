"""Addresses of machines."""

import ipaddress
import re

_NUMBERS = re.compile(r"[0-9.]+|[0-9A-Fa-f:.]*:[0-9A-Fa-f:.]*")
"""What can be no name: only numbers, or colons between them."""


def require_possible(host: str) -> str:
    """Return a name or an address of a machine as it is.

    Raises:
        ValueError: if it looks like an address and is none, such as 10.42.0.300.
    """
    if _NUMBERS.fullmatch(host):
        try:
            ipaddress.ip_address(host)
        except ValueError as error:
            raise ValueError(
                f"'{host}' is no address: it has four numbers from 0 to 255, such as 10.42.0.2, or is one of IPv6"
            ) from error
    return host
