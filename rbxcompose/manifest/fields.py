"""Types of fields that several sections have."""

from __future__ import annotations

from typing import Annotated

from pydantic import StringConstraints

from rbxcompose.config import Name
from rbxcompose.references import COMPONENT, FILE, PORT, TOPIC, Refers

TopicPattern = StringConstraints(pattern=r"^/?[a-z][a-z0-9_]*(/[a-z][a-z0-9_]*)*$", max_length=255)
TopicName = Annotated[str, TopicPattern, Refers(TOPIC, is_told=True)]
InterfaceName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*(/(msg|srv|action))?/[A-Z][A-Za-z0-9]*$")]
DottedName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)?$", max_length=121)]
FieldPath = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)*$", max_length=255)]
PortName = Annotated[DottedName, Refers(PORT, is_told=True)]
ComponentName = Annotated[Name, Refers(COMPONENT, is_told=True)]
FileName = Annotated[str, Refers(FILE, is_told=True)]
