"""Names of message types, and of their fields, in configurations."""

import re
from functools import partial
from typing import Annotated

from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from rbxcompose.base.findings import nearest
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import FieldShape
from rbxcompose.msgs.fields import NoFieldError, field_type

_BETWEEN = re.compile(r"[/.:]+")  # the names in that of a type: `.` in Python, `::` in C++


_FIND = {"msg": registry.message, "srv": registry.service, "action": registry.action}
_WHAT = {"msg": "message", "srv": "service", "action": "action"}


def _known(kind: str, name: str) -> str:
    try:
        return _FIND[kind](name).TYPE
    except KeyError:
        known, what = tuple(registry.names(kind)), _WHAT[kind]
        short = _BETWEEN.split(name)[-1]
        near = nearest(short, {text.rpartition("/")[-1]: text for text in known})
        alike = tuple(text for text in known if near and text.rpartition("/")[-1] == near[0])
        if alike and short == name:
            full = " or ".join(f"'{item}'" for item in alike)
            details = {"name": name, "kind": what, "help": f"write it with its package: {full}"}
            raise PydanticCustomError("message", "there is no {kind} type '{name}'", details) from None
        context = {"name": name, "kind": what, "valid": alike or known, "what": f"{what} types"}
        raise PydanticCustomError("message", "there is no {kind} type '{name}'", context) from None


MessageName = Annotated[str, AfterValidator(partial(_known, "msg"))]
"""The ROS name of a message type: `std_msgs/Float32`; read as its full name, `std_msgs/msg/Float32`."""
ServiceName = Annotated[str, AfterValidator(partial(_known, "srv"))]
"""The ROS name of a service type: `std_srvs/SetBool`; read as its full name."""
ActionName = Annotated[str, AfterValidator(partial(_known, "action"))]
"""The ROS name of an action type: `nav2_msgs/NavigateToPose`; read as its full name."""


def number_field(message: str, path: str) -> str:
    """Return `path` if it names a number in messages of type `message`.

    Raises:
        PydanticCustomError: if it does not; for use in validators of configurations.
    """
    try:
        found = field_type(message, path)
    except NoFieldError as error:
        context = {"name": error.name, "valid": tuple(error.fields), "what": f"'message' is {message}, with the fields"}
        raise PydanticCustomError("field", f"{error.message} has no field '{{name}}'", context) from None
    if found.is_message or found.shape is not FieldShape.SINGLE or found.base in ("string", "bool"):
        raise PydanticCustomError("field", "'{path}' is a {type}, not a number", {"path": path, "type": str(found)})
    return path
