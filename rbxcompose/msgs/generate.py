"""Write the classes of interfaces as Python modules, for what reads code: type checkers, editors, other packages.

`python -m rbxcompose.msgs.generate` writes the stubs of all interfaces in `interfaces/`, which are not committed.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from rbxcompose.msgs import definitions
from rbxcompose.msgs.arrays import holds_numbers
from rbxcompose.msgs.classes import class_path

INDENT = "    "
LONGEST = 120  # letters of a line
TYPES = "rbxcompose.msgs.types"
DATACLASS = "rbxcompose.base.dataclass"
ARRAYS = "rbxcompose.msgs.arrays"


def all_structures(root: Path = definitions.INTERFACES) -> dict[str, definitions.Structure]:
    """Return every structure that the texts below `root` define, by name."""
    names = [name for kind in definitions.KINDS for name in definitions.interface_names(kind, root)]
    return {
        part: structure
        for name in names
        for part, structure in definitions.parts(name, definitions.read(name, root)).items()
    }


def modules(structures: Mapping[str, definitions.Structure]) -> dict[str, str]:
    """Return the Python text of each package."""
    packages = sorted({name.split("/")[0] for name in structures})
    return {package: _Module(package, structures).text() for package in packages}


class _Module:
    """Writes the module of one package and tracks its imports."""

    def __init__(self, package: str, structures: Mapping[str, definitions.Structure]) -> None:
        self.package = package
        self.structures = structures
        self.packages: set[str] = set()
        self.imports: dict[str, set[str]] = {}

    def text(self) -> str:
        classes = ["\n".join(self._interface(name)) for name in self._in_order()]
        return "\n\n\n".join(["\n".join(self._head()), *classes]) + "\n"

    def _in_order(self) -> list[str]:
        """Return the interfaces of the package in an order in which each one follows the messages inside it."""
        names = sorted(
            name for name in self.structures if name.startswith(f"{self.package}/") and "_" not in name.split("/")[2]
        )
        ordered: dict[str, None] = {}

        def visit(name: str) -> None:
            whole = (
                structure for part, structure in self.structures.items() if part == name or part.startswith(f"{name}_")
            )
            for base in (field.type.base for structure in whole for field in structure.fields):
                if base in names:
                    visit(base)
            ordered[name] = None

        for name in names:
            visit(name)
        return list(ordered)

    def _head(self) -> Iterator[str]:
        yield f'"""ROS 2 interfaces of `{self.package}`.'
        yield ""
        yield f"Generated from the texts of `{self.package}`: do not edit."
        yield from ('"""', "", "from __future__ import annotations", "")
        yield from self._import_lines("dataclasses", "typing")
        yield ""
        yield from self._import_lines(DATACLASS)
        if self.packages:
            line = f"from rbxcompose.msgs import {', '.join(sorted(self.packages))}"
            each = [f"{INDENT}{package}," for package in sorted(self.packages)]
            yield from [line] if len(line) <= LONGEST else ["from rbxcompose.msgs import (", *each, ")"]
        yield from self._import_lines(ARRAYS, TYPES)
        if ARRAYS in self.imports:
            yield from ("", "if TYPE_CHECKING:", "    import numpy as np", "    from numpy.typing import NDArray")

    def _import_lines(self, *modules: str) -> Iterator[str]:
        for module in modules:
            if module in self.imports:
                # Constants, then classes, then functions, as imports are sorted elsewhere.
                names = sorted(self.imports[module], key=lambda name: (not name.isupper(), name[0].islower(), name))
                yield f"from {module} import {', '.join(names)}"

    def _use(self, name: str, module: str) -> str:
        self.imports.setdefault(module, set()).add(name)
        return name

    def _interface(self, name: str) -> Iterator[str]:
        match name.split("/")[1]:
            case "msg":
                return self._message(name, self.structures[name].comment or f"The message `{name}`.")
            case "srv":
                return self._service(name, self.structures[f"{name}_Request"].comment or f"The service `{name}`.")
            case _:
                return self._action(name)

    def _action(self, name: str) -> Iterator[str]:
        path = self._path(name)
        base = self._use("Action", TYPES)
        yield f'class {path}({base}["{path}.Goal", "{path}.Result", "{path}.Feedback"]):'
        yield from _indented(self._heading(name, self.structures[f"{name}_Goal"].comment or f"The action `{name}`."))
        for part in ("Goal", "Result", "Feedback"):
            yield from _indented(["", *self._message(f"{name}_{part}", f"{part} of `{path}`.")])
        yield from _indented(["", *self._service(f"{name}_SendGoal", f"Sends a goal of `{path}`.")])
        yield from _indented(["", *self._service(f"{name}_GetResult", f"Waits for the result of a goal of `{path}`.")])
        feedback = self._message(f"{name}_FeedbackMessage", f"Feedback of `{path}` and the goal that it is about.")
        yield from _indented(["", *feedback])

    def _service(self, name: str, doc: str) -> Iterator[str]:
        path = self._path(name)
        base = self._use("Service", TYPES)
        yield f'class {path.split(".")[-1]}({base}["{path}.Request", "{path}.Response"]):'
        yield from _indented(self._heading(name, doc))
        for part in ("Request", "Response"):
            yield from _indented(["", *self._message(f"{name}_{part}", f"{part} of `{path}`.")])

    def _path(self, name: str) -> str:
        return class_path(name, self.structures)

    def _message(self, name: str, doc: str) -> Iterator[str]:
        structure = self.structures[name]
        has_arrays = any(holds_numbers(field.type) for field in structure.fields)
        base = self._use("ArrayMessage", ARRAYS) if has_arrays else self._use("Message", TYPES)
        options = "frozen=True, slots=True" + (", eq=False" if has_arrays else "")
        yield f"@{self._use('dataclass', DATACLASS)}({options})"
        yield f"class {self._path(name).split('.')[-1]}({base}):"
        yield from _indented(self._heading(name, doc))
        yield from _indented(self._fields_by_name(structure))
        for group in (map(self._constant, structure.constants), map(self._field, structure.fields)):
            if lines := list(group):
                yield from _indented(["", *lines])

    def _heading(self, name: str, doc: str) -> Iterator[str]:
        yield f'"""{doc}"""'
        yield ""
        yield f'TYPE: {self._use("ClassVar", "typing")}[str] = "{name}"'
        yield f'HASH: ClassVar[str] = "{definitions.type_hash(name, self.structures)}"'

    def _fields_by_name(self, structure: definitions.Structure) -> Iterator[str]:
        start = f"FIELDS: ClassVar[{self._use('Fields', TYPES)}] = {{"
        if not structure.fields:
            yield start + "}"
            return
        yield start
        yield from _indented(f'"{field.name}": "{field.type}",' for field in structure.fields)
        yield "}"

    def _constant(self, constant: definitions.Constant) -> str:
        value = _literal(constant.value)
        name = definitions.attribute(constant.name)
        return _commented(f"{name}: ClassVar[{type(constant.value).__name__}] = {value}", constant.comment)

    def _field(self, field: definitions.FieldDefinition) -> str:
        python_type, default = self._python(field.type)
        if field.default is not None:
            default = self._default(field.type, field.default)
        line = _commented(f"{definitions.attribute(field.name)}: {python_type} = {default}", field.comment)
        if len(line) <= LONGEST - len(INDENT) or field.comment:
            return line
        return line.replace("field(", f"field(\n{INDENT}{INDENT}").removesuffix(")") + f"\n{INDENT})"

    def _default(self, type_: definitions.FieldType, value: definitions.Default) -> str:
        if not isinstance(value, tuple):
            return _literal(value)
        if type_.base in definitions.OCTETS:
            return repr(bytes(value))  # type: ignore[arg-type]
        if holds_numbers(type_):
            return self._made_by(f'lambda: {self._use("filled", ARRAYS)}("{type_.base}", {value!r})')
        return repr(value)

    def _python(self, type_: definitions.FieldType) -> tuple[str, str]:
        """Return the annotation and the default value of a field."""
        if holds_numbers(type_):
            self._use("TYPE_CHECKING", "typing")
            zeros = f'{self._use("zeros", ARRAYS)}("{type_.base}", {_least(type_)})'
            return f"NDArray[np.{type_.base}]", self._made_by(f"lambda: {zeros}")
        if type_.shape is not definitions.FieldShape.SINGLE and type_.base in definitions.OCTETS:
            return "bytes", f"bytes({_least(type_)})" if _least(type_) else 'b""'
        text, default = self._python_single(type_)
        if type_.shape is definitions.FieldShape.SINGLE:
            return text, self._made_by(default) if type_.is_message else default
        if not _least(type_):
            return f"tuple[{text}, ...]", "()"
        if type_.is_message:
            return f"tuple[{text}, ...]", self._made_by(
                f"lambda: ({default.removeprefix('lambda: ')}(),) * {type_.length}"
            )
        return f"tuple[{text}, ...]", f"({default},) * {type_.length}"

    def _python_single(self, type_: definitions.FieldType) -> tuple[str, str]:
        """Return the annotation of one value and its zero; for a message, a factory."""
        match type_.base:
            case "string":
                return "str", '""'
            case "bool":
                return "bool", "False"
            case number if not type_.is_message:
                return ("float", "0.0") if number in definitions.FLOATS else ("int", "0")
        package = type_.base.split("/")[0]
        path = self._path(type_.base)
        if package != self.package:
            self.packages.add(package)
            return f"{package}.{path}", f"{package}.{path}"
        # A part of an action is used while the action's own class is still being created.
        return path, f"lambda: {path}()" if "." in path else path

    def _made_by(self, factory: str) -> str:
        return f"{self._use('field', 'dataclasses')}(default_factory={factory})"


def _least(type_: definitions.FieldType) -> int:
    return type_.length if type_.shape is definitions.FieldShape.ARRAY else 0


def _literal(value: definitions.Value) -> str:
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def _commented(line: str, comment: str) -> str:
    return f"{line}  # {comment}" if comment else line


def _indented(lines: Iterable[str]) -> Iterator[str]:
    return (INDENT + line if line else line for line in lines)


def main() -> None:
    """Write all stubs beside this file."""
    for package, text in modules(all_structures()).items():
        Path(__file__).with_name(f"{package}.pyi").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
