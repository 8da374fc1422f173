"""Tags that xacro of ROS 1 read without a prefix: in the tree of each file, they are given the prefix `xacro:`.

Runs in the fenced process, while files are parsed. A file may call macros of files that are included later, so a tag
that may be a call waits until a macro of its name is known.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any
from xml.dom import minidom

from rbxcompose.body.xacro_answer import BareFile, BareTag

PREFIX = "xacro:"
PLACE = "rbx-place"  # an attribute of elements of the expansion: where they were written
_WORDS = {"macro": ("name",), "property": ("name",), "include": ("filename",), "if": ("value",), "unless": ("value",),
          "insert_block": ("name",), "arg": ("name", "default")}  # fmt: skip
"""The tags of xacro that ROS 1 knew, with the attributes that they need."""
_OPEN = {"link", "joint", "visual", "collision", "inertial", "geometry", "material"}  # macros may be called in these
_CLOSED = {"origin", "mass", "inertia", "box", "cylinder", "capsule", "sphere", "mesh", "color", "texture", "parent",
           "child", "axis", "calibration", "dynamics", "limit", "mimic", "safety_controller", "verbose",
           "collision_checking", "contact_coefficients", "robot", "gazebo", "transmission", "sensor", "ros2_control",
           "model_state", "group", "gripper_state"}  # fmt: skip
"""Tags that are no calls whatever macros there are; what is in them belongs to others, such as a simulator."""


class BareTags:
    """The bare tags of one expansion that xacro means, by file."""

    def __init__(self) -> None:
        self._files: dict[str, tuple[dict[tuple[int, int], BareTag], BareTag | None]] = {}
        self._macros: set[str] = set()
        self._waiting: dict[str, list[Any]] = defaultdict(list)
        self._pending: list[Any] = []

    def give_prefixes(self, document: minidom.Document, file: str) -> None:
        """Give bare tags of a file, and calls in earlier files of macros that it defines, their prefix."""
        root: Any = document.documentElement
        unbound = None if root.hasAttribute("xmlns:xacro") else _tag(root)
        self._files.setdefault(file, ({}, unbound))
        self._pending.append(root)
        while self._pending:
            for child in self._pending.pop().childNodes:
                if child.nodeType == child.ELEMENT_NODE:
                    self._look_at(child)

    def told(self) -> dict[str, BareFile]:
        """Return the files that have such tags."""
        found = {file: (tags, root) for file, (tags, root) in self._files.items() if tags}
        return {file: BareFile(tuple(tags[at] for at in sorted(tags)), root) for file, (tags, root) in found.items()}

    def _look_at(self, element: Any) -> None:
        name = element.tagName
        if name in _WORDS and all(map(element.hasAttribute, _WORDS[name])):
            self._give_prefix(element)
        elif name.startswith(PREFIX) or name in _OPEN:
            self._pending.append(element)
        elif name in self._macros:
            self._give_prefix(element)
        elif name not in _CLOSED and ":" not in name:
            self._waiting[name].append(element)
        if element.tagName == f"{PREFIX}macro":
            self._learn(element.getAttribute("name").removeprefix(PREFIX))

    def _give_prefix(self, element: Any) -> None:
        tag = _tag(element)
        tags, _ = self._files[element.place.rsplit("|", 3)[0]]
        tags[tag.line, tag.column] = tag
        element.tagName = element.nodeName = PREFIX + element.tagName
        element.removeAttribute(PLACE)
        self._pending.append(element)

    def _learn(self, macro: str) -> None:
        if macro not in self._macros and macro not in _OPEN | _CLOSED:
            self._macros.add(macro)
            for call in self._waiting.pop(macro, ()):
                self._give_prefix(call)


def _tag(element: Any) -> BareTag:
    _, line, column, _ = element.place.rsplit("|", 3)
    return BareTag(int(line), int(column), element.tagName, element.closed)
