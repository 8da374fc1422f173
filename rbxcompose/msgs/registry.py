"""The packages of interfaces as Python modules, and their classes by ROS name.

`rbxcompose.msgs.geometry_msgs` has no file: it makes the class `Twist` from its text when it is first used. Classes of
other packages are found by name, too, once they have been imported.

A robot may have types of its own, from the texts of its manifest. `choose` says whose names count from then on: in
this thread or task, and, if it is the main thread, in all threads that have chosen nothing. Equal texts have the same
classes; those of different texts exist side by side, also under the same name.
"""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, lru_cache
from importlib.machinery import ModuleSpec
from threading import current_thread, main_thread
from types import ModuleType
from typing import Any, TypeVar, cast

from rbxcompose.msgs.classes import class_path, make_class
from rbxcompose.msgs.definitions import INTERFACES, KINDS, Structures, interface_names
from rbxcompose.msgs.types import Action, Message, Service, declared

T = TypeVar("T")
_WHAT = dict(zip(KINDS, ("message", "service", "action"), strict=True))


def message(name: str) -> type[Message]:
    """Return the message `geometry_msgs/msg/Twist`, also written `geometry_msgs/Twist`; parts of services are messages.

    Raises:
        KeyError: lists the existing names.
    """
    return _find(name, "msg", Message)


def service(name: str) -> type[Service[Any, Any]]:
    """Return the service `std_srvs/srv/SetBool`, also written `std_srvs/SetBool`.

    Raises:
        KeyError: lists the existing names.
    """
    return _find(name, "srv", Service)


def action(name: str) -> type[Action[Any, Any, Any]]:
    """Return the action `nav2_msgs/action/NavigateToPose`, also written `nav2_msgs/NavigateToPose`.

    Raises:
        KeyError: lists the existing names.
    """
    return _find(name, "action", Action)


def inside(holder: type[Message], name: str) -> type[Message]:
    """Return the class of a message that messages of the class `holder` contain."""
    return holder.CLASSES.get(name) or message(name)


def names(kind: str) -> list[str]:
    """Return the sorted full names of all interfaces of one kind: `msg`, `srv` or `action`."""
    known = (*declared, *chosen().texts)
    others = (name for name in known if name.split("/")[1] == kind and "_" not in name.split("/")[2])
    return sorted({*_shipped(kind), *others})


def full_name(name: str, kind: str) -> str:
    """Return `geometry_msgs/msg/Twist` for `geometry_msgs/Twist`; other names unchanged."""
    match name.split("/"):
        case [package, bare]:
            return f"{package}/{kind}/{bare}"
    return name


def _find(name: str, kind: str, base: type[T]) -> type[T]:
    full = full_name(name, kind)
    found = STANDARD.find(full) or chosen().find(full) or _imported_class(full)
    if found is None or not issubclass(found, base):
        raise KeyError(f"no {_WHAT[kind]} {name!r}; there are {', '.join(names(kind))}")
    return found


def _imported_class(full: str) -> type[Any] | None:
    """Return a class of another package, also that of a part, which may not be made yet."""
    whole, is_part, part = full.rpartition("_")
    if full in declared or not is_part:
        return declared.get(full)
    found = getattr(_imported_class(whole), part, None)
    return found if getattr(found, "TYPE", None) == full else None


@cache
def _shipped(kind: str) -> tuple[str, ...]:
    return tuple(interface_names(kind))


class Types:
    """Types by name: the standard ones, or those of one robot, whose texts are `texts`."""

    def __init__(
        self, texts: Mapping[str, str], interfaces: Callable[[str], Mapping[str, str]], classes: dict[str, type[Any]]
    ) -> None:
        self.texts = texts
        self.interfaces = interfaces
        """Returns the names of all interfaces of a package by those of their classes."""
        self.structures = Structures(texts)
        self._classes = classes

    def attribute(self, package: str, name: str) -> type[Any] | None:
        """Return the class of this name in the Python module of a package."""
        interface = self.interfaces(package).get(name)
        return make_class(interface, self.structures, classes=self._classes) if interface else None

    def find(self, full: str) -> type[Any] | None:
        """Return the class of a type, also that of a part: `std_srvs/srv/SetBool_Request`."""
        if full.count("/") != 2:
            return None
        package = full.split("/")[0]
        first, *rest = class_path(full, self.interfaces(package).values()).split(".")
        found: Any = self.attribute(package, first)
        for part in rest:
            found = getattr(found, part, None)
        return found if getattr(found, "TYPE", None) == full else None


class _OwnClasses(dict[str, type[Any]]):
    """The classes of a robot's types that have been made; the standard ones, which all share, are found here, too."""

    def get(self, name: str, default: Any = None) -> Any:
        return super().get(name) or STANDARD.find(name) or default


@cache
def _interfaces(package: str) -> Mapping[str, str]:
    found = (f"{package}/{path.parent.name}/{path.stem}" for path in (INTERFACES / package).glob("*/*"))
    return _by_class(frozenset(found))


def _by_class(names: frozenset[str]) -> dict[str, str]:
    return {class_path(name, names): name for name in names}


@lru_cache(64)
def _own(texts: tuple[tuple[str, str], ...]) -> Types:
    by_package = {
        package: _by_class(frozenset(name for name, _ in texts if name.split("/")[0] == package))
        for package in {name.split("/")[0] for name, _ in texts}
    }
    return Types(dict(texts), lambda package: by_package.get(package, {}), _OwnClasses())


STANDARD = Types({}, _interfaces, declared)
_NONE = _own(())
_everywhere = _NONE
_here: ContextVar[Types | None] = ContextVar("types of the robot", default=None)


def chosen() -> Types:
    """Return the types of the robot that names mean here."""
    return _here.get() or _everywhere


def types_of(texts: Mapping[str, str]) -> Types:
    """Return the types of a robot with these texts of its own."""
    return _own(tuple(sorted(texts.items())))


def choose(texts: Mapping[str, str]) -> None:
    """Let names mean the types of a robot from now on; `texts` are those of its own interfaces by full name."""
    global _everywhere
    types = types_of(texts)
    _here.set(types)
    if current_thread() is main_thread():
        _everywhere = types
    PACKAGES.update({name.split("/")[0] for name in texts} - TAKEN)


@contextmanager
def choosing(texts: Mapping[str, str]) -> Iterator[None]:
    """Let names mean the types of a robot meanwhile."""
    before = chosen().texts
    choose(texts)
    try:
        yield
    finally:
        choose(before)


def text_of(name: str) -> str:
    """Return the text of an interface, such as `std_srvs/srv/SetBool`.

    Raises:
        KeyError: if there is none.
    """
    found = chosen().texts.get(name, standard_text(name))
    if found is None:
        raise KeyError(name)
    return found


def standard_text(name: str) -> str | None:
    """Return the text of a standard interface, None if there is none of this name."""
    package, kind, bare = name.split("/")
    file = INTERFACES / package / kind / f"{bare}.{kind}"
    return file.read_text(encoding="utf-8") if file.is_file() else None


class _Package(ModuleType):
    """A ROS package as a Python module: its attributes are classes."""

    def __init__(self, package: str) -> None:
        super().__init__(f"{__package__}.{package}", f"ROS 2 interfaces of `{package}`.")

    def __getattr__(self, name: str) -> type[Any]:
        package = self.__name__.rpartition(".")[2]
        if (made := STANDARD.attribute(package, name)) is not None:
            setattr(self, name, made)
            return made
        if (made := chosen().attribute(package, name)) is not None:
            return made
        raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")

    def __dir__(self) -> list[str]:
        package = self.__name__.rpartition(".")[2]
        return sorted({*super().__dir__(), *STANDARD.interfaces(package), *chosen().interfaces(package)})


class _Packages:
    """Finds and loads packages of interfaces, which have no files; `importlib.abc` with its bases is slow to import."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        parent, _, package = fullname.rpartition(".")
        if parent != __package__ or package not in PACKAGES:
            return None
        return ModuleSpec(fullname, cast(Any, self), origin=str(INTERFACES / package))

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return _Package(spec.name.rpartition(".")[2])

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing: classes are made at first use."""


SHIPPED = STANDARD.structures
TAKEN = frozenset(path.stem for path in INTERFACES.parent.glob("*.py"))
"""Names that no package of interfaces can have: those of modules beside them."""
PACKAGES = {path.name for path in INTERFACES.iterdir()}
"""Packages of interfaces that can be imported."""
sys.meta_path.append(_Packages())
