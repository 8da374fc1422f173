"""The reference of controllers: what each type is, its settings, its ports."""

from __future__ import annotations

import textwrap
from typing import Any

from docs.generating.components import DIRECTIONS, remarks
from docs.generating.markdown import about, code, example, example_of, indented, page, table
from docs.generating.robot import tables
from rbxcompose.domains.servos.controller import PLUGINS, controller_type
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import to_plain
from rbxcompose.sdk.ports import Port

HEAD = """A controller leads joints that servos drive, once in each cycle of their bus. It stands under
[`controllers`](robot.md#controllers), by a name of its own; its ports are those of the component of its bus.
"""


def whole_page() -> str:
    """Return the page."""
    return page("Controllers", HEAD, *(of_type(name) for name in sorted(PLUGINS.shipped)))


def of_type(name: str) -> str:
    """Return what is known of a type."""
    cls = controller_type(name)
    parts = [
        f"## {code(name)}\n{about(cls)}\n",
        f"{facts(cls)}\n",
        example(f"controllers:\n{indented(example_of(cls))}", "text"),
        *tables(cls.config_type(), ""),
        table(("port", "does", "what", "topic", "remarks"), [port_row(*pair) for pair in ports_of(name).items()]),
    ]
    return "\n".join(part for part in parts if part)


def facts(cls: Any) -> str:
    """Return what it gives to which joints."""
    given = "positions" if cls.interface == "position" else "velocities"
    kinds = f" It leads joints that are {' or '.join(code(kind) for kind in sorted(cls.kinds))}." if cls.kinds else ""
    mode = "" if cls.interface == "position" else " (`mode: velocity`)"
    return f"It gives {given} to its actuators{mode}.{kinds}"


def ports_of(name: str) -> dict[str, Port[Any]]:
    """Return the ports of a type, as its example has them."""
    cls = controller_type(name)
    node, _ = read_text(textwrap.dedent(example_of(cls)), name)
    if not isinstance(node, MappingNode):
        raise TypeError(f"the controller '{name}' has no example")
    [(own, entry)] = node.entries.items()
    return cls.ports(own, cls.config_type().model_validate(to_plain(entry.value)))


def port_row(name: str, port: Port[Any]) -> tuple[str, ...]:
    """Return the row of a port."""
    interface = port.interface.TYPE if port.interface else ""
    return code(name), DIRECTIONS[port.kind], code(interface), code(port.topic), remarks(port)
