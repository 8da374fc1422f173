"""Dataclasses as those of the standard library, made in a tenth of the time; frozen ones are also created faster.

The standard library writes and compiles up to six methods for each class, which was a third of the time of `check`.
Here classes share all methods but `__init__`, which is compiled when the first object is made. To type checkers and to
`fields`, `replace` and the like they are dataclasses as any other; one with another option is left to the standard
library.
"""

import dataclasses
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from functools import cache
from operator import attrgetter
from reprlib import recursive_repr
from types import MemberDescriptorType
from typing import TYPE_CHECKING, Any, ClassVar, get_origin

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, **options):
        """Make a class a dataclass: `@dataclass(frozen=True, slots=True)`. It takes all options, but no `InitVar`."""
        return _made(cls, **options) if cls is not None else lambda one: _made(one, **options)


if sys.version_info >= (3, 14):
    from annotationlib import Format, get_annotations

    def _annotations(cls: Any) -> Any:
        """Return the annotations of a class itself; names that only type checkers know stay references."""
        return get_annotations(cls, format=Format.FORWARDREF)

else:

    def _annotations(cls: Any) -> Any:
        """Return the annotations of a class itself."""
        return vars(cls).get("__annotations__", {})


@dataclasses.dataclass
class _Sample:
    field: int


_Fields = Sequence[dataclasses.Field[Any]]
_MISSING = dataclasses.MISSING
_standard: Any = dataclasses.dataclass  # also while `dataclasses` lends its name to ours
_SAMPLE: Any = _Sample  # for what only the standard library can make
_FIELD_TYPE = _SAMPLE.__dataclass_fields__["field"]._field_type


def _made(
    cls: type, *, frozen: bool = False, slots: bool = False, eq: bool = True, kw_only: bool = False, **others: Any
) -> type:
    if others:
        return _standard(frozen=frozen, slots=slots, eq=eq, kw_only=kw_only, **others)(cls)  # type: ignore[no-any-return]
    own = dict(vars(cls))
    declared = _fields(cls, kw_only)
    fields = tuple(declared.values())
    init = _Init(fields, frozen and slots, frozen)
    methods = {
        "__init__": init,
        "__repr__": _repr([field.name for field in fields if field.repr]),
        "__match_args__": tuple(field.name for field in fields if field.init and not field.kw_only),
        **(_comparing(fields, frozen) if eq else {}),
    }
    added = {name: method for name, method in methods.items() if own.get(name) is None}
    added |= {"__dataclass_fields__": declared, "__dataclass_params__": _params(eq, frozen)}
    made = _with_slots(cls, list(declared), {**own, **added}) if slots else _with_defaults(cls, fields, added)
    init.owner = made
    if frozen:
        _freeze(made, list(declared), slots)
    return made


@cache
def _params(eq: bool, frozen: bool) -> object:
    """Return what the standard library asks for when a class inherits from one of these."""
    params = copy(_SAMPLE.__dataclass_params__)
    params.eq, params.frozen = eq, frozen
    return params


def _fields(cls: type, kw_only: bool) -> dict[str, dataclasses.Field[Any]]:
    """Return the fields of a class by name, inherited ones first."""
    found: dict[str, Any] = {}
    for base in cls.__mro__[-1:0:-1]:
        found |= getattr(base, "__dataclass_fields__", {})
    for name, annotation in _annotations(cls).items():
        if annotation in ("KW_ONLY", dataclasses.KW_ONLY):
            kw_only = True
        elif not _is_class_variable(annotation):
            default = getattr(cls, name, _MISSING)
            if isinstance(default, MemberDescriptorType):  # the slot of an inherited field
                default = _MISSING
            field: Any = default if isinstance(default, dataclasses.Field) else dataclasses.field(default=default)
            field.name, field.type, field._field_type = name, annotation, _FIELD_TYPE
            field.kw_only = kw_only if field.kw_only is _MISSING else field.kw_only
            found[name] = field
    return found


def _is_class_variable(annotation: object) -> bool:
    if isinstance(annotation, str):
        return annotation.startswith("ClassVar")
    return annotation is ClassVar or get_origin(annotation) is ClassVar


def _with_slots(cls: type, names: Sequence[str], contents: dict[str, Any]) -> type:
    """Return a class with these contents and slots for its fields, because an existing one cannot get slots."""
    inherited = {slot for base in cls.__mro__[1:-1] for slot in vars(base).get("__slots__", ())}
    left_out = {*names, "__dict__", "__weakref__"}
    left = {name: value for name, value in contents.items() if name not in left_out}
    left["__slots__"] = tuple(name for name in names if name not in inherited)
    left["__qualname__"] = cls.__qualname__
    return type(cls)(cls.__name__, cls.__bases__, left)


def _with_defaults(cls: type, fields: _Fields, added: Mapping[str, Any]) -> type:
    """Return the class itself, with what was added, and with the default itself where a field stood for it."""
    for name, value in added.items():
        setattr(cls, name, value)
    for field in fields:
        if vars(cls).get(field.name) is field:
            if field.default is _MISSING:
                delattr(cls, field.name)
            else:
                setattr(cls, field.name, field.default)
    return cls


class _Init:
    """`__init__` of a class until it is first asked for; then it is made, and takes this place."""

    __slots__ = ("_fields", "_frozen", "_has_setters", "owner")

    def __init__(self, fields: _Fields, has_setters: bool, frozen: bool) -> None:
        self._fields, self._has_setters, self._frozen = fields, has_setters, frozen
        self.owner: Any = None

    def __get__(self, instance: object, cls: type) -> Any:
        made: Any = _init(self.owner, self._fields, self._has_setters, self._frozen)
        self.owner.__init__ = made
        return made.__get__(instance, cls)


def _init(cls: Any, fields: _Fields, has_setters: bool, frozen: bool) -> Callable[..., None]:
    """Return `__init__`. What is frozen is set by the descriptors of its slots, faster than by `object.__setattr__`."""
    scope: dict[str, Any] = {"_missing": _MISSING, "_set": object.__setattr__}
    lines = []
    for field in fields:
        if has_setters:
            scope[f"_set_{field.name}"] = getattr(cls, field.name).__set__
        value = _value(field, scope)
        if value and has_setters:
            lines.append(f" _set_{field.name}(self, {value})")
        elif value:
            lines.append(f" _set(self, {field.name!r}, {value})" if frozen else f" self.{field.name} = {value}")
    if hasattr(cls, "__post_init__"):
        lines.append(" self.__post_init__()")
    taken = [one for one in fields if one.init]
    text = f"def __init__(self{''.join(_parameters(taken))}):\n" + "\n".join(lines or [" pass"])
    exec(text, scope)  # noqa: S102 - of names of fields, as the standard library does
    made: Any = scope["__init__"]
    made.__qualname__ = f"{cls.__qualname__}.__init__"
    made.__annotations__ = {**{one.name: one.type for one in taken}, "return": None}
    return made  # type: ignore[no-any-return]


def _value(field: dataclasses.Field[Any], scope: dict[str, Any]) -> str:
    """Return the expression for the value of a new object's field, empty for none; `scope` receives what it needs."""
    name = field.name
    if field.default_factory is not _MISSING:
        scope[f"_make_{name}"] = field.default_factory
        return f"_make_{name}() if {name} is _missing else {name}" if field.init else f"_make_{name}()"
    if field.default is not _MISSING:
        scope[f"_default_{name}"] = field.default
        return name if field.init else f"_default_{name}"
    return name if field.init else ""


def _parameters(fields: _Fields) -> Iterator[str]:
    ordered = sorted(fields, key=lambda one: bool(one.kw_only))
    for number, field in enumerate(ordered):
        if field.kw_only and not (number and ordered[number - 1].kw_only):
            yield ", *"
        default = "_missing" if field.default_factory is not _MISSING else f"_default_{field.name}"
        has_default = field.default_factory is not _MISSING or field.default is not _MISSING
        yield f", {field.name}={default}" if has_default else f", {field.name}"


def _repr(names: Sequence[str]) -> Callable[[Any], str]:
    @recursive_repr()
    def __repr__(self: Any) -> str:  # noqa: N807
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return __repr__


def _comparing(fields: _Fields, frozen: bool) -> dict[str, Any]:
    """Return `__eq__` and `__hash__`; what can change has no hash."""
    compared = _values_of([field.name for field in fields if field.compare])
    hashed = _values_of([field.name for field in fields if (field.compare if field.hash is None else field.hash)])

    def __eq__(self: Any, other: object) -> bool:  # noqa: N807
        return compared(self) == compared(other) if other.__class__ is self.__class__ else NotImplemented

    def __hash__(self: Any) -> int:  # noqa: N807
        return hash(hashed(self))

    return {"__eq__": __eq__, "__hash__": __hash__ if frozen else None}


def _values_of(names: Sequence[str]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a function that returns the values of these attributes."""
    if len(names) > 1:
        return attrgetter(*names)
    if not names:
        return lambda one: ()
    only = attrgetter(names[0])
    return lambda one: (only(one),)


def _freeze(cls: Any, names: Sequence[str], slots: bool) -> None:
    """Forbid changes; a copy of what has slots must be able to set them all the same."""

    def __setattr__(self: Any, name: str, value: object) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    def __getstate__(self: Any) -> list[object]:  # noqa: N807
        return [getattr(self, name) for name in names]

    def __setstate__(self: Any, state: list[object]) -> None:  # noqa: N807
        for name, value in zip(names, state, strict=True):
            object.__setattr__(self, name, value)

    cls.__setattr__, cls.__delattr__ = __setattr__, __delattr__
    if slots:
        cls.__getstate__, cls.__setstate__ = __getstate__, __setstate__
