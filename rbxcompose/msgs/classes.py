"""Make the Python classes of interfaces from their definitions."""

from collections.abc import Callable, Container, Mapping
from dataclasses import field
from functools import partial
from threading import RLock
from types import new_class
from typing import Any, ClassVar, ForwardRef

from rbxcompose.base.dataclass import dataclass
from rbxcompose.msgs import definitions
from rbxcompose.msgs.arrays import ArrayMessage, filled, holds_numbers, zeros
from rbxcompose.msgs.types import Action, Message, Service, declared

_ZEROS: Mapping[str, Any] = {
    "string": "",
    "bool": False,
    **dict.fromkeys(definitions.FLOATS, 0.0),
}  # other numbers are integers
_lock = RLock()  # two threads must not make two classes of one interface


def class_path(name: str, known: Container[str]) -> str:
    """Return the path of a structure in its module: `SetBool.Request` for `std_srvs/srv/SetBool_Request`.

    A message that shares its name with an action among the `known` of its package is told apart:
    `GripperCommandMessage`.
    """
    package, kind, bare = name.split("/")
    is_shared = kind == "msg" and f"{package}/action/{bare}" in known
    return f"{bare}Message" if is_shared else bare.replace("_", ".")


def make_class(
    name: str,
    structures: Mapping[str, definitions.Structure],
    home: str = "rbxcompose.msgs",
    classes: dict[str, type[Any]] = declared,
) -> type[Any]:
    """Return the class of an interface, such as `std_srvs/srv/SetBool`; made at the first call.

    `structures` has those of the interface and of all messages inside it, whose classes are made as well. A class
    belongs to the Python module of its ROS package in `home`, and is kept in `classes`.

    Raises:
        KeyError: if `structures` lacks one.
    """
    with _lock:
        return classes.get(name) or _Maker(name, structures, home, classes).interface()


class _Maker:
    """Makes the classes of one interface."""

    def __init__(
        self, name: str, structures: Mapping[str, definitions.Structure], home: str, classes: dict[str, type[Any]]
    ) -> None:
        self._name = name
        self._classes = classes
        self._structures = structures
        self._home = home
        self._module = f"{home}.{name.split('/')[0]}"

    def interface(self) -> type[Any]:
        name = self._name
        match name.split("/")[1]:
            case "msg":
                return self._message(name, self._structures[name].comment or f"The message `{name}`.")
            case "srv":
                return self._service(name, self._structures[f"{name}_Request"].comment or f"The service `{name}`.")
            case _:
                return self._action(name)

    def _action(self, name: str) -> type[Any]:
        path = self._path(name)
        three = {
            part: self._message(f"{name}_{part}", f"{part} of `{path}`.") for part in ("Goal", "Result", "Feedback")
        }
        others = {
            "SendGoal": _Part(partial(self._service, f"{name}_SendGoal", f"Sends a goal of `{path}`.")),
            "GetResult": _Part(
                partial(self._service, f"{name}_GetResult", f"Waits for the result of a goal of `{path}`.")
            ),
            "FeedbackMessage": _Part(
                partial(
                    self._message, f"{name}_FeedbackMessage", f"Feedback of `{path}` and the goal that it is about."
                )
            ),
        }
        doc = self._structures[f"{name}_Goal"].comment or f"The action `{name}`."
        return self._class(name, doc, Action[tuple(three.values())], {**three, **others})  # type: ignore[misc]

    def _service(self, name: str, doc: str) -> type[Any]:
        path = self._path(name)
        both = {part: self._message(f"{name}_{part}", f"{part} of `{path}`.") for part in ("Request", "Response")}
        return self._class(name, doc, Service[tuple(both.values())], both)  # type: ignore[misc]

    def _message(self, name: str, doc: str) -> type[Any]:
        structure = self._structures[name]
        fields = {definitions.attribute(definition.name): self._field(definition) for definition in structure.fields}
        constants = {definitions.attribute(constant.name): constant.value for constant in structure.constants}
        has_arrays = any(holds_numbers(definition.type) for definition in structure.fields)
        annotations = {
            **{name: ClassVar[type(value)] for name, value in constants.items()},
            **{name: type_ for name, (type_, _) in fields.items()},
        }
        made = self._class(
            name,
            doc,
            ArrayMessage if has_arrays else Message,
            {
                "FIELDS": {definition.name: str(definition.type) for definition in structure.fields},
                "__annotations__": annotations,
                **constants,
                **{name: default for name, (_, default) in fields.items()},
            },
        )
        return dataclass(frozen=True, slots=True, eq=not has_arrays)(made)

    def _class(self, name: str, doc: str, base: Any, body: Mapping[str, Any]) -> type[Any]:
        path = self._path(name)
        head = {
            "__module__": self._module,
            "__qualname__": path,
            "__doc__": doc,
            "TYPE": name,
            "HASH": _TypeHash(self._structures),
            **({} if self._classes is declared else {"CLASSES": self._classes}),
        }
        return new_class(path.split(".")[-1], (base,), exec_body=lambda namespace: namespace.update(head, **body))

    def _path(self, name: str) -> str:
        return class_path(name, self._structures)

    def _field(self, definition: definitions.FieldDefinition) -> tuple[Any, Any]:
        """Return the annotation and the default value of a field."""
        type_ = definition.type
        least = type_.length if type_.shape is definitions.FieldShape.ARRAY else 0
        given = definition.default
        if holds_numbers(type_):
            # Not the type itself, since numpy is imported when the first array is made.
            array: Any = ForwardRef(f"NDArray[np.{type_.base}]")
            make = partial(filled, type_.base, given) if isinstance(given, tuple) else partial(zeros, type_.base, least)
            return array, field(default_factory=make)
        if type_.shape is not definitions.FieldShape.SINGLE and type_.base in definitions.OCTETS:
            return bytes, bytes(given) if isinstance(given, tuple) else bytes(least)  # type: ignore[arg-type]
        if type_.is_message:
            return self._nested(type_, least)
        zero = _ZEROS.get(type_.base, 0)
        if type_.shape is definitions.FieldShape.SINGLE:
            return type(zero), zero if given is None else given
        return tuple[type(zero), ...], (zero,) * least if given is None else given  # type: ignore[misc]

    def _nested(self, type_: definitions.FieldType, least: int) -> tuple[Any, Any]:
        # A part of a service or an action is made before what holds it.
        made: Any = self._classes.get(type_.base) or make_class(type_.base, self._structures, self._home, self._classes)
        if type_.shape is definitions.FieldShape.SINGLE:
            return made, field(default_factory=made)
        repeated: Callable[[], Any] = lambda: (made(),) * least  # noqa: E731
        return tuple[made, ...], field(default_factory=repeated) if least else ()


class _Part:
    """A class inside that of an action, made when it is first asked for: a check needs none of them."""

    def __init__(self, make: Callable[[], type[Any]]) -> None:
        self._make = make

    def __set_name__(self, owner: Any, name: str) -> None:
        self._name = name

    def __get__(self, instance: object, owner: Any) -> type[Any]:
        with _lock:
            if vars(owner)[self._name] is self:
                setattr(owner, self._name, self._make())
            made: type[Any] = vars(owner)[self._name]
            return made


class _TypeHash:
    """The type hash of a class, computed when it is first read."""

    def __init__(self, structures: Mapping[str, definitions.Structure]) -> None:
        self._structures = structures

    def __get__(self, instance: object, owner: Any) -> str:
        owner.HASH = definitions.type_hash(owner.TYPE, self._structures)
        return str(owner.HASH)
