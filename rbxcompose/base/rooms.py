"""Where plug-ins stand: modules are found by their folders, without a list and without importing them.

Each room of the package, that is each package at its top and each domain, may have a folder for each family of plug-ins
(`components/`, `sections/`, `commands/`, ...): a file is a plug-in, and its name is that of the plug-in. Rules are an
exception: all of them run, so a room has them in `checks.py` or in files of `checks/`, many in one, whatever its name.
"""

import os
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from types import ModuleType

_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
_NAME, _DOMAINS, _RULES = "rbxcompose", "domains", "checks"


@cache
def modules_of(folder: str) -> dict[str, str]:
    """Return the modules of a family by the names of their plug-ins, sorted; those of rules by their own names."""
    return dict(sorted(_found(folder)))


def file_of(module: str) -> str:
    """Return the file of one of these modules."""
    return os.path.join(_PACKAGE, *module.split(".")[1:]) + ".py"


def domain_of(module: str) -> str:
    """Return the domain of a module, by its name; empty for modules of other rooms and of other packages."""
    package, _, below = module.partition(f".{_DOMAINS}.")
    return below.partition(".")[0] if package == _NAME else ""


def package_of(domain: str) -> ModuleType:
    """Return the package of a domain."""
    return import_module(f"{_NAME}.{_DOMAINS}.{domain}")


def _found(folder: str) -> Iterator[tuple[str, str]]:
    for room, path in _rooms():
        try:
            files = os.listdir(os.path.join(path, folder))
        except FileNotFoundError:
            if folder == _RULES and os.path.exists(os.path.join(path, f"{folder}.py")):
                yield f"{room}.{folder}", f"{room}.{folder}"
            continue
        for stem in (file.removesuffix(".py") for file in files if file.endswith(".py") and file != "__init__.py"):
            module = f"{room}.{folder}.{stem}"
            yield (module if folder == _RULES else stem), module


@cache
def _rooms() -> tuple[tuple[str, str], ...]:
    """Return the packages that may have plug-ins, each by its name and its folder."""
    tops = _below(_NAME, _PACKAGE)
    return (*tops, *_below(f"{_NAME}.{_DOMAINS}", os.path.join(_PACKAGE, _DOMAINS)))


def _below(package: str, path: str) -> list[tuple[str, str]]:
    with os.scandir(path) as entries:
        names = sorted(entry.name for entry in entries if "." not in entry.name and not entry.name.startswith("_"))
    return [(f"{package}.{name}", os.path.join(path, name)) for name in names]
