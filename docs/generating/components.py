"""The reference of component types: what each is, its settings, its ports."""

from __future__ import annotations

from typing import Any

from docs.generating.markdown import about, code, example, example_of, indented, page, table
from docs.generating.shapes import keys_table
from rbxcompose.base.config import PLACE, Place
from rbxcompose.compiler.schema.robot import examples_of
from rbxcompose.manifest.section import ComponentOptions
from rbxcompose.missions.program.goals import typed_fields
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import In, Looks, Out, Port, Qos, ServesAction, ServesTopic
from rbxcompose.sdk.registry import PLUGINS, component_type

DIRECTIONS = {
    "in": "subscribes",
    "out": "publishes",
    "serves": "serves",
    "calls": "calls",
    "serves_action": "skill",
    "serves_topic": "skill",
    "calls_action": "sends goals",
    "looks": "looks up",
}
QOS = {
    Qos.COMMAND: "only the newest message counts; dropped rather than late",
    Qos.STATE: "the newest message counts, a few are kept",
    Qos.LATCHED: "the last message is kept for late subscribers",
    Qos.EVENT: "no message may be lost",
    Qos.BULK: "large, with the lowest priority",
}
PORTS = """## Ports
A port **publishes** on a topic or **subscribes** to one, **serves** or **calls** a service, **sends goals** to an
action of another component, or **looks up** a pose among the frames. A **skill** is an action, or a topic of orders,
that missions may use. Ports of the same topic and type are connected; `connect` gives a port another topic. A skill
that *claims* something has it to itself while it runs.

The class of a topic (QoS) says what matters:

"""


def whole_page() -> str:
    """Return the page."""
    classes = PORTS + table(("class", "what matters"), [(code(qos), words) for qos, words in QOS.items()])
    return page("Components", classes, *(of_type(name) for name in sorted(PLUGINS.shipped)))


def of_type(name: str) -> str:
    """Return what is known of a type."""
    cls = component_type(name)
    parts = [f"## {code(name)}\n{about(cls)}\n"]
    if cls.made_by:
        parts.append(f"{cls.made_by} It is not listed under `components`.\n")
    else:
        parts.append(f"{facts(cls)}\n")
        parts.append(example(f"components:\n{indented(example_of(cls))}", "yaml robot"))
        parts.append(keys_table(cls.config_type()))
    rows = [port_row(port) for port in ports_of(name).values()]
    parts.append(table(("port", "does", "what", "topic", "class", "unit", "remarks"), rows))
    return "\n".join(part for part in parts if part)


def facts(cls: type[Component[Any]]) -> str:
    """Return where and how often a type runs."""
    rate = f", at {cls.rate:g} Hz" if cls.rate else ""
    only = "; it exists only in simulation" if cls.simulated else ""
    return f"It runs in the process `{cls.process}`{rate}{only}."


def ports_of(name: str) -> dict[str, Port[Any]]:
    """Return the ports of a type, those that depend on the configuration as its example has them."""
    cls = component_type(name)
    options = {"type", *ComponentOptions.model_fields}
    settings = {key: value for key, value in entry_shown(name).items() if key not in options}
    config = cls.config_type().model_validate(settings, context={PLACE: {"dock": Place("dock", 0, 0, 0)}})
    return cls.ports(config)


def entry_shown(name: str) -> dict[str, object]:
    """Return the entry that the docstring of a type shows: for its ports also of one that a section makes.

    Raises:
        ValueError: if it does not show just one
    """
    match examples_of(component_type(name)):
        case [dict(entry)]:
            return entry
    raise ValueError(
        f"the docstring of the type '{name}' needs one 'Example:' with one entry, 'NAME: {{type: {name}, ...}}'; "
        "so does that of a type that a section makes"
    )


def port_row(port: Port[Any]) -> tuple[str, ...]:
    """Return the row of a port."""
    if isinstance(port, Looks):
        return code(port.name), DIRECTIONS[port.kind], f"{code(port.source)} in {code(port.target)}", "", "", "", ""
    interface = port.interface.TYPE if port.interface else ""
    flow = (str(port.qos), port.unit) if isinstance(port, In | Out) else ("", "")
    first = (code(port.name), DIRECTIONS[port.kind], code(interface), code(port.topic))
    return *first, code(flow[0]), code(flow[1]), remarks(port)


def remarks(port: Port[Any]) -> str:
    """Return what else is to be known of a port."""
    if isinstance(port, In) and port.is_open and not isinstance(port, ServesTopic):
        return "may be fed from outside the robot"
    if not isinstance(port, ServesAction | ServesTopic):
        return ""
    words = [f"takes {', '.join(map(code, arguments))}"] if (arguments := arguments_of(port)) else []
    words += [f"claims the {port.claims}"] if port.claims else []
    words += [] if port.restartable else ["cannot be restarted"]
    return "; ".join(words)


def arguments_of(port: ServesAction[Any, Any, Any] | ServesTopic[Any]) -> list[str]:
    """Return the arguments that a skill takes, the first one first."""
    message = port.interface.Goal if isinstance(port, ServesAction) and port.interface else port.interface
    return [*(port.entries.each if port.entries else ()), *(typed_fields(message) if message else ())]
