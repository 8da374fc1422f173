"""Runs a launch file in Python in a process of its own, within a fence, and answers with what it declares.

Stand-ins for the modules that such files import only note that: an action becomes an entity as XML and YAML have it,
and a substitution the same piece of a text. There is no ROS here.
"""

from __future__ import annotations

import builtins
import importlib
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

from rbxcompose.base.processes import answer_all, fence
from rbxcompose.domains.programs.launch_files.substitutions import (
    LaunchText,
    SubstitutionCall,
    SubstitutionContext,
    UnknownValueError,
    read_launch_text,
)

MODULES = (
    "launch", "launch.actions", "launch.conditions", "launch.event_handlers", "launch.events", "launch.events.process",
    "launch.frontend", "launch.launch_context", "launch.launch_description", "launch.launch_description_sources",
    "launch.substitutions", "launch.utilities", "launch_ros", "launch_ros.actions", "launch_ros.descriptions",
    "launch_ros.event_handlers", "launch_ros.events", "launch_ros.events.lifecycle",
    "launch_ros.parameter_descriptions", "launch_ros.substitutions", "launch_xml",
    "launch_xml.launch_description_sources", "launch_yaml", "launch_yaml.launch_description_sources",
    "ament_index_python", "ament_index_python.packages", "ament_index_python.resources", "lifecycle_msgs",
    "lifecycle_msgs.msg", "nav2_common", "nav2_common.launch",
)  # fmt: skip
Data = dict[str, Any]
FILE = "__launch_file__"  # a global name of a launch file, by which its frames are known
LET = "let"
_OF_PACKAGE = re.compile(r"\$\(find-pkg-(share|prefix) [A-Za-z][\w-]*\)", re.ASCII)
_NAMES = {
    "default_value": "default",
    "package": "pkg",
    "executable": "exec",
    "node_name": "name",
    "node_namespace": "namespace",
    "node_executable": "exec",
    "node_plugin": "plugin",
    "prefix": "launch-prefix",
    "src": "from",
    "dst": "to",
    "msg": "message",
    "target_container": "target",
}
"""Names of arguments in Python, and what XML and YAML call them."""
Part = Callable[[Any], Iterable[Data]]
_OFFERED = (
    "argparse", "ast", "collections", "collections.abc", "contextlib", "copy", "dataclasses", "datetime", "enum",
    "errno", "functools", "getpass", "glob", "inspect", "io", "itertools", "json", "logging", "math", "multiprocessing",
    "operator", "os", "os.path", "pathlib", "platform", "pprint", "random", "re", "shlex", "shutil", "signal", "socket",
    "string", "subprocess", "sys", "tempfile", "textwrap", "threading", "time", "traceback", "types", "typing", "uuid",
    "warnings", "xml", "xml.dom", "xml.dom.minidom", "xml.etree", "xml.etree.ElementTree", "yaml", "__future__",
)  # fmt: skip
"""Modules that a file may import: much of what they do is refused, but not their names."""
_REMOVED = ("rbxcompose", "ctypes", "_ctypes", "resource", "gc")
Errors = list[tuple[str, int]]
_HARMLESS = ("sys._getframe", "os.putenv", "os.unsetenv")


def line_here() -> int:
    """Return the line of the launch file that is being carried out."""
    frame = sys._getframe(1)
    while frame.f_back is not None and FILE not in frame.f_globals:
        frame = frame.f_back
    return frame.f_lineno if FILE in frame.f_globals else 1


def text_of(value: Any) -> LaunchText:
    """Return what Python code gives for a text: words, a substitution, or several of them that follow each other."""
    match value:
        case None:
            return ()
        case Substitution():
            return value.text
        case bool():
            return ("true" if value else "false",)
        case list() | tuple():
            return tuple(piece for each in value for piece in text_of(each))
    return read_launch_text(str(value)) if _OF_PACKAGE.search(str(value)) else (str(value),)


class LaunchContext:
    """What functions of a launch file get: the values of arguments up to there, and the means to fill texts in."""

    def __init__(self, context: SubstitutionContext) -> None:
        self._context = context
        self.launch_configurations = context.values
        self.environment = context.environment

    def perform_substitution(self, substitution: Any) -> str:
        """Return a text with all of it filled in."""
        return self._context.perform(text_of(substitution))


class Substitution:
    """A piece of a text that is filled in later."""

    def __init__(self, *pieces: str | SubstitutionCall) -> None:
        self.text: LaunchText = pieces

    def perform(self, context: LaunchContext) -> str:
        """Return what it becomes."""
        return context.perform_substitution(self)

    def __truediv__(self, other: Any) -> Substitution:
        return Substitution(SubstitutionCall("join-path", (self.text, text_of(other))))


def _substitution(call: str, *names: str, is_list: bool = False) -> type[Substitution]:
    """Return a class of substitutions whose arguments have these names; others say nothing of the value."""

    def begin(self: Substitution, *given: Any, **named: Any) -> None:
        values = {**dict(zip(names, given, strict=False)), **named}
        listed = [values[name] for name in names if values.get(name) is not None]
        if is_list:
            listed = [each for value in given or named.values() for each in (value if _is_list(value) else [value])]
        Substitution.__init__(self, SubstitutionCall(call, tuple(map(text_of, listed))))

    return type("Substitution", (Substitution,), {"__init__": begin})


def _found(call: str) -> type[Substitution]:
    """Return a class of folders of packages; `find` gives words that `text_of` knows again."""
    names = {"find": lambda self, name: f"$({call} {name})"}
    return type("Substitution", (_substitution(call, "package"),), names)


class TextSubstitution(Substitution):
    """Words as they are."""

    def __init__(self, *, text: str) -> None:
        super().__init__(str(text))


class LaunchCondition:
    """When an action is carried out: `name` is `if` or `unless`."""

    def __init__(self, name: str, text: LaunchText) -> None:
        self.name, self.text = name, text


def _condition(name: str, call: str = "") -> Callable[..., LaunchCondition]:
    def make(*given: Any, **named: Any) -> LaunchCondition:
        texts = [*map(text_of, (*given, *named.values()))]
        if not call:
            return LaunchCondition(name, texts[0])
        return LaunchCondition(name, (SubstitutionCall(call, (((SubstitutionCall("var", (texts[0],)),)), *texts[1:])),))

    return make


class IncludedSource:
    """The file of an include."""

    def __init__(self, location: Any = None, **named: Any) -> None:
        self.text = text_of(location if location is not None else next(iter(named.values()), None))


class ParameterValue:
    """The value of a parameter, with a type."""

    def __init__(self, value: Any, *, value_type: Any = None, **_: Any) -> None:
        self.value, self.type = value, getattr(value_type, "__name__", "auto" if value_type is None else "list")


class ParameterFile:
    """A file of parameters."""

    def __init__(self, param_file: Any, *, allow_substs: Any = False, **_: Any) -> None:
        self.entity = entity("param", {"from": param_file, "allow_substs": allow_substs or None})


def entity(kind: str, given: Mapping[str, Any], children: Iterable[Data] = ()) -> Data:
    """Return an entity as plain data; attributes that are None are not given."""
    attributes = {name: text_of(value) for name, value in given.items() if value is not None}
    return {"kind": kind, "line": line_here(), "attributes": attributes, "children": [*children]}


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _listed(value: Any) -> Sequence[Any]:
    return value if _is_list(value) else [] if value is None else [value]


def _valued(kind: str, value: Any, **given: Any) -> Data:
    """Return an entity with the value of a parameter."""
    type_ = None
    if isinstance(value, ParameterValue):
        type_, value = value.type, value.value
    if isinstance(value, Mapping):
        return entity(kind, given, [_valued("param", below, name=name) for name, below in value.items()])
    if _is_list(value) and not any(isinstance(each, Substitution) for each in value):
        return entity(kind, given, [_valued("item", each) for each in value])
    if type_ is None and isinstance(value, bool | int | float | str):
        type_ = type(value).__name__
    return entity(kind, {**given, "value": value, "type": type_})


def _parameters(parameters: Any) -> Iterator[Data]:
    for each in [parameters] if isinstance(parameters, Mapping) else _listed(parameters):
        if isinstance(each, Mapping):
            yield from (_valued("param", value, name=name) for name, value in each.items())
        elif isinstance(each, ParameterFile):
            yield each.entity
        else:
            yield entity("param", {"from": each})


def _pairs(kind: str, first: str, second: str) -> Part:
    def parts(value: Any) -> Iterator[Data]:
        for each, other in value.items() if isinstance(value, Mapping) else value or ():
            yield entity(kind, {first: each, second: other})

    return parts


_PARTS: dict[str, Part] = {
    "parameters": _parameters,
    "remappings": _pairs("remap", "from", "to"),
    "env": _pairs("env", "name", "value"),
    "additional_env": _pairs("env", "name", "value"),
    "launch_arguments": _pairs("arg", "name", "value"),
    "launch_configurations": _pairs(LET, "name", "value"),
    "arguments": lambda value: (entity("argument", {"value": each}) for each in _listed(value)),
    "cmd": lambda value: (entity("argument", {"value": each}) for each in _listed(value)),
    "choices": lambda value: (entity("choice", {"value": each}) for each in value or ()),
    "composable_node_descriptions": lambda value: (each.entity for each in value or ()),
}
"""Arguments that become children."""


class DeclaredAction:
    """An action of a launch file; `actions` are those in it, `function` calls for more of them."""

    kind = ""
    names: tuple[str, ...] = ()

    def __init__(self, *given: Any, **named: Any) -> None:
        self.named = {**dict(zip(self.names, given, strict=False)), **named}
        condition = self.named.pop("condition", None)
        self.condition = condition if isinstance(condition, LaunchCondition) else None
        if condition is not None and self.condition is None:
            self.condition = LaunchCondition("if", text_of(condition))
        self.actions: Sequence[Any] = self.named.pop("actions", ())
        self.function = self.named.pop("function", None)
        self.entity = self._entity()
        if self.condition is not None:
            self.entity["attributes"][self.condition.name] = self.condition.text

    def _entity(self) -> Data:
        given = {_NAMES.get(name, name): value for name, value in self.named.items() if name not in _PARTS}
        children = [child for name, value in self.named.items() if name in _PARTS for child in _PARTS[name](value)]
        if "ros_arguments" in given:
            given["ros_args"] = " ".join(map(str, _listed(given.pop("ros_arguments"))))
        if isinstance(source := given.pop("launch_description_source", None), IncludedSource):
            given["file"] = [Substitution(*source.text)]
        return entity(self.kind, given, children)


class SetParameter(DeclaredAction):
    """A parameter of all nodes that follow."""

    kind, names = "set_parameter", ("name", "value")

    def _entity(self) -> Data:
        return _valued(self.kind, self.named.get("value"), name=self.named.get("name"))


class UnknownStandIn(DeclaredAction, Substitution):
    """Whatever else a module of ROS has: an action, a substitution, or a part of one."""

    def __init__(self, *given: Any, **named: Any) -> None:
        Substitution.__init__(self, SubstitutionCall(type(self).__name__))
        self.given = (*given, *named.values())
        DeclaredAction.__init__(self, condition=named.get("condition"))

    def __bool__(self) -> bool:
        raise UnknownValueError(f"'{type(self).__name__}' is not known here")

    def _entity(self) -> Data:
        started = ", ".join(dict.fromkeys(_started(self.given)))
        return entity(type(self).__name__, {"name": started or None})


def _started(values: Iterable[Any], depth: int = 0) -> Iterator[str]:
    """Yield the executables of the actions in some values."""
    for value in values if depth < 8 else ():
        if isinstance(value, UnknownStandIn):
            yield from _started(value.given, depth + 1)
        elif isinstance(value, DeclaredAction):
            found = value.entity["attributes"].get("exec", ())
            yield "".join(each for each in found if isinstance(each, str)) or value.kind
        elif isinstance(value, list | tuple):
            yield from _started(value, depth + 1)


class LaunchDescription:
    """The actions of a launch file."""

    def __init__(self, initial_entities: Iterable[Any] | None = None, **_: Any) -> None:
        self.entities = [*(initial_entities or ())]

    def add_action(self, action: Any) -> None:
        """Add an action."""
        self.entities.append(action)

    add_entity = add_action


class PackageNotFoundError(KeyError):
    """Raised for a package that is not installed."""

    __str__ = Exception.__str__


def _action(kind: str, *names: str) -> type[DeclaredAction]:
    return type("Action", (DeclaredAction,), {"kind": kind, "names": names})


_NAMESAKES: dict[str, Any] = {
    "LaunchDescription": LaunchDescription,
    "LaunchContext": LaunchContext,
    "LaunchConfiguration": _substitution("var", "variable_name", "default"),
    "EnvironmentVariable": _substitution("env", "name", "default_value"),
    "LaunchConfigAsBool": _substitution("as-flag", "name"),
    "FindPackageShare": _found("find-pkg-share"),
    "FindPackagePrefix": _found("find-pkg-prefix"),
    "FindPackage": _found("find-pkg-prefix"),
    "FindExecutable": _substitution("find-exec", "name"),
    "ExecutableInPackage": _substitution("exec-in-pkg", "executable", "package"),
    "PythonExpression": _substitution("eval", "expression"),
    "Command": _substitution("command", "command"),
    "ThisLaunchFile": _substitution("filename"),
    "ThisLaunchFileDir": _substitution("dirname"),
    "AnonName": _substitution("anon", "name"),
    "NotSubstitution": _substitution("not", "value"),
    "AndSubstitution": _substitution("and", "left", "right"),
    "OrSubstitution": _substitution("or", "left", "right"),
    "AllSubstitution": _substitution("and", is_list=True),
    "AnySubstitution": _substitution("or", is_list=True),
    "EqualsSubstitution": _substitution("equals", "left", "right"),
    "NotEqualsSubstitution": _substitution("not-equals", "left", "right"),
    "IfElseSubstitution": _substitution("if", "condition", "if_value", "else_value"),
    "PathJoinSubstitution": _substitution("join-path", is_list=True),
    "PathSubstitution": _substitution("join-path", is_list=True),
    "RewrittenYaml": _substitution("rewritten", "source_file"),
    "TextSubstitution": TextSubstitution,
    "IfCondition": _condition("if"),
    "UnlessCondition": _condition("unless"),
    "LaunchConfigurationEquals": _condition("if", "equals"),
    "LaunchConfigurationNotEquals": _condition("if", "not-equals"),
    "ParameterValue": ParameterValue,
    "ParameterFile": ParameterFile,
    "SetParameter": SetParameter,
    "DeclareLaunchArgument": _action("arg", "name", "default_value", "description"),
    "SetLaunchConfiguration": _action(LET, "name", "value"),
    "SetEnvironmentVariable": _action("set_env", "name", "value"),
    "UnsetEnvironmentVariable": _action("unset_env", "name"),
    "PushRosNamespace": _action("push_ros_namespace", "namespace"),
    "PushROSNamespace": _action("push_ros_namespace", "namespace"),
    "SetRemap": _action("set_remap", "src", "dst"),
    "LogInfo": _action("log", "msg"),
    "Node": _action("node"),
    "LifecycleNode": _action("lifecycle_node"),
    "ComposableNodeContainer": _action("node_container"),
    "ComposableNode": _action("composable_node"),
    "LoadComposableNodes": _action("load_composable_node", "composable_node_descriptions", "target_container"),
    "ExecuteProcess": _action("executable"),
    "ExecuteLocal": _action("executable"),
    "IncludeLaunchDescription": _action("include", "launch_description_source"),
    "GroupAction": _action("group", "actions"),
    "TimerAction": _action("timer"),
    "OpaqueFunction": _action("function"),
    **{f"{name}LaunchDescriptionSource": IncludedSource for name in ("Python", "XML", "YAML", "Any", "Frontend")},
}


def install(context: SubstitutionContext) -> None:
    """Put the modules where imports find them; packages are those that the context knows."""

    def prefix(package_name: str) -> str:
        return _known(f"$(find-pkg-prefix {package_name})", lambda: context.prefix_of(package_name))

    def share(package_name: str) -> str:
        return _known(f"$(find-pkg-share {package_name})", lambda: context.share_of(package_name))

    names = {
        **_NAMESAKES,
        "PackageNotFoundError": PackageNotFoundError,
        "get_package_prefix": prefix,
        "get_package_share_directory": share,
        "get_package_share_path": lambda package_name: Path(share(package_name)),
        "perform_substitutions": lambda context, subs: context.perform_substitution(subs),
    }
    for module in MODULES:
        made = ModuleType(module)
        made.__dict__.update(names, __path__=[], __getattr__=_unknown)
        sys.modules[module] = made
        parent, _, name = module.rpartition(".")
        if parent:
            setattr(sys.modules[parent], name, made)


def _known(words: str, find: Callable[[], Path]) -> str:
    """Return a path, or words that `text_of` knows again: only what needs an unknown one is left out."""
    try:
        return str(find())
    except UnknownValueError as error:
        if _OF_PACKAGE.fullmatch(words):
            return words
        raise PackageNotFoundError(str(error)) from None


def _unknown(name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(name)
    return type(name, (UnknownStandIn,), {})


def main() -> None:
    """Answer requests."""
    answer_all(_answer)


def _answer(request: Data, start: float) -> Data:
    context = SubstitutionContext(Path(request["file"]), [*map(Path, request["prefixes"])], request["values"])
    for name in _OFFERED:
        importlib.import_module(name)

    context.environment = dict(os.environ)
    install(context)
    for name in [name for name in sys.modules if name.partition(".")[0] in _REMOVED]:
        del sys.modules[name]
    fence(request["roots"], set(), start, "a launch file", _HARMLESS)
    builtins.__import__ = _limited(builtins.__import__)
    errors: Errors = []
    entities: list[Data] = []
    try:
        entities += _entities(_run(request["text"], request["file"]), context, errors)
    except BaseException as error:  # it may raise anything
        errors.append((_words(error), _line(error)))
    return {"errors": errors, "entities": entities}


def _limited(load: Callable[..., ModuleType]) -> Callable[..., ModuleType]:
    """Return what imports only modules that are here: others would have to be read."""
    here = frozenset((*sys.modules, *MODULES))

    def limited(name: str, *rest: Any, **named: Any) -> ModuleType:
        level = named.get("level", rest[3] if len(rest) > 3 else 0)
        if not level and name not in here:
            raise ModuleNotFoundError(f"it imports '{name}', which is not there", name=name)
        return load(name, *rest, **named)

    return limited


def _run(text: str, file: str) -> Iterable[Any]:
    names: Data = {"__name__": "launch_file", "__file__": file, FILE: True}
    exec(compile(text, file, "exec"), names)  # noqa: S102  (within the fence)
    if "generate_launch_description" not in names:
        raise LookupError("it has no function 'generate_launch_description'")
    found = names["generate_launch_description"]()
    if not isinstance(found, LaunchDescription):
        raise TypeError("'generate_launch_description' returns no LaunchDescription")
    return found.entities


def _entities(actions: Iterable[Any], context: SubstitutionContext, errors: Errors) -> Iterator[Data]:
    """Yield what actions declare; functions among them are called with the values that arguments have up to there."""
    for action in actions:
        if isinstance(action, LaunchDescription):
            yield entity("group", {"scoped": "false"}, _entities(action.entities, context, errors))
        elif not isinstance(action, DeclaredAction):
            raise TypeError(f"a {type(action).__name__} is no action")
        else:
            if isinstance(action, UnknownStandIn) or _holds(action, context):
                _set(action.entity, context)
                action.entity["children"] += _below(action, context, errors)
            if action.kind == "function":
                action.entity |= {"kind": "group"}
                action.entity["attributes"] = {**_condition_of(action), "scoped": ("false",)}
            yield action.entity


def _condition_of(action: DeclaredAction) -> Data:
    return {} if action.condition is None else {action.condition.name: action.condition.text}


def _below(action: DeclaredAction, context: SubstitutionContext, errors: Errors) -> list[Data]:
    if action.kind == "function":
        named = action.named
        try:
            found = action.function(LaunchContext(context), *named.get("args") or (), **named.get("kwargs") or {})
            return [*_entities(found or (), context, errors)]
        except BaseException as error:  # the others may be fine
            errors.append((_words(error), _line(error, 1)))
            return []
    is_scoped = action.entity["attributes"].get("scoped") != ("false",)
    inner = replace(context, values=dict(context.values)) if is_scoped else context
    for child in action.entity["children"] if action.kind == "group" else ():
        _set(child, inner)
    return [*_entities(action.actions, inner, errors)]


def _holds(action: DeclaredAction, context: SubstitutionContext) -> bool:
    """Return whether an action is carried out; one whose condition is not known may be."""
    if action.condition is None:
        return True
    try:
        return context.holds(action.condition.text) is (action.condition.name == "if")
    except UnknownValueError:
        return True


def _set(found: Data, context: SubstitutionContext) -> None:
    """Give an argument its value, for the functions that ask for it."""
    given = found["attributes"]
    try:
        if found["kind"] in ("arg", LET) and (value := given.get("default", given.get("value"))) is not None:
            name = context.perform(given["name"])
            if found["kind"] == LET or name not in context.values:
                context.values[name] = context.perform(value)
    except UnknownValueError:  # which is reported where it counts
        return


def _words(error: BaseException) -> str:
    match error:
        case MemoryError() | RecursionError():
            return "it needs more memory or deeper calls than a launch file may"
        case ModuleNotFoundError() | UnknownValueError() | PermissionError():
            return str(error)
        case SystemExit():
            return "it ends the process"
    return f"{type(error).__name__}: {error}"


def _line(error: BaseException, above: int = 2) -> int:
    """Return the line in the file that an error comes from: below this module's own, the first that is no stand-in."""
    if isinstance(error, SyntaxError):
        return error.lineno or 1
    trace = error.__traceback__
    for _ in range(above):
        trace = trace.tb_next if trace is not None else None
    return trace.tb_lineno if trace is not None else line_here()
