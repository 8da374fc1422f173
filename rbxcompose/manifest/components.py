"""The section `components`: each entry's type, options and configuration."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Mapping as AnyMapping
from dataclasses import replace
from difflib import get_close_matches

from rbxcompose.config import Place
from rbxcompose.findings import SIMILAR, Related, Report, kind
from rbxcompose.manifest.models import ALWAYS_THERE, DESCRIPTION, OPTIONS, SECTIONS, ComponentEntry, ComponentOptions
from rbxcompose.manifest.tree import Entry, Mapping, Scalar
from rbxcompose.manifest.validate import MISSING_KEY, UNKNOWN_KEY, WRONG_TYPE, is_broken, label_of, validate
from rbxcompose.plain import plain
from rbxcompose.plugins import BROKEN, LEFT_OUT, BrokenPluginError
from rbxcompose.sdk import registry

UNKNOWN_TYPE = kind(
    "RBX3004",
    """Unknown type of component

No component type has this name, neither of those that ship with the project nor of those that are installed.

Bad:
```yaml
components:
  base:
    type: diff_drive_simm
```
Good:
```yaml
components:
  base:
    type: diff_drive_sim
```
""",
    is_fixable=True,
)
TAKEN_NAME = kind(
    "RBX1007",
    """A name that is taken

Everything that runs has a name of its own. The names of sections, of muxes and of the components that every robot
runs cannot be given to a component.

Bad:
```yaml
components:
  diagnostics:
    type: battery_sim
    runtime: 45 s
```
Good:
```yaml
components:
  battery:
    type: battery_sim
    runtime: 45 s
```
""",
)


def read_component(
    name: str, entry: Entry, root: Mapping, places: AnyMapping[str, Place], report: Report
) -> ComponentEntry | None:
    """Return one component; None if it has no known type, without a `config` if there are mistakes in that."""
    _check_name(name, entry, root, report)
    node, path = entry.value, ("components", name)
    if is_broken(node):
        return None
    if not isinstance(node, Mapping):
        message = f"component '{name}' must be a map with a 'type:' and its configuration"
        report.add(WRONG_TYPE.at(node.span, message, label=label_of(node)))
        return None
    # A missing key is shown at the component's name, not at whatever its first key is.
    options_node = replace(_part(node, OPTIONS), span=entry.key.span)
    options = validate(ComponentOptions, options_node, path, report) or ComponentOptions()
    type_name = _type_name(name, entry, node, report)
    if type_name is None:
        return None
    model = registry.component_type(type_name).config_type()
    keys = [key for key in node.entries if key not in (*OPTIONS, "type")]
    config_node = replace(_part(node, keys), span=entry.key.span)
    config = validate(model, config_node, path, report, {"places": places}, also=[*OPTIONS, "type"])
    return ComponentEntry(name, type_name, options, config, entry.key.span)


def _part(node: Mapping, keys: Collection[str]) -> Mapping:
    return replace(node, entries={name: entry for name, entry in node.entries.items() if name in keys})


def _check_name(name: str, entry: Entry, root: Mapping, report: Report) -> None:
    muxes = root.get("muxes")
    if name in SECTIONS:
        report.add(TAKEN_NAME.at(entry.key.span, f"a component cannot be named like the section '{name}'"))
    elif name in ALWAYS_THERE:
        report.add(TAKEN_NAME.at(entry.key.span, f"every robot runs a component '{name}' already"))
    elif name == DESCRIPTION and "body" in root.entries:
        related = [Related(root.entries["body"].key.span, "the body")]
        report.add(TAKEN_NAME.at(entry.key.span, f"the body brings a component '{name}' already", related=related))
    elif isinstance(muxes, Mapping) and name in muxes:
        related = [Related(muxes.entries[name].key.span, "the mux")]
        report.add(TAKEN_NAME.at(entry.key.span, f"a component and a mux are both named '{name}'", related=related))


def _type_name(name: str, entry: Entry, node: Mapping, report: Report) -> str | None:
    """Return the type of a component, or None after a finding if there is none of that name."""
    written = node.get("type")
    if written is None:
        misspelt = get_close_matches("type", [key for key in node.entries if key not in OPTIONS], n=1, cutoff=SIMILAR)
        if misspelt:
            key, message = node.entries[misspelt[0]].key, f"unknown key '{misspelt[0]}' in component '{name}'"
            report.add(UNKNOWN_KEY.misspelt(key.span, message, key.text, ["type"]))
        else:
            report.add(MISSING_KEY.at(entry.key.span, f"component '{name}' needs the key 'type'"))
        return None
    if not isinstance(written, Scalar):
        report.add(WRONG_TYPE.at(written.span, "'type' must be the name of a type", label=label_of(written)))
        return None
    if is_broken(written):
        return None
    if told := registry.PLUGINS.overshadowed(written.text):
        report.add(LEFT_OUT.at(written.span, told))
    if written.text not in registry.component_names():
        message = f"component '{name}' is of a type that does not exist: '{plain(written.text, 60)}'"
        report.add(UNKNOWN_TYPE.misspelt(written.span, message, written.text, registry.component_names(), "types"))
        return None
    try:
        registry.component_type(written.text)
    except BrokenPluginError as error:
        report.add(BROKEN.at(written.span, str(error)))
        return None
    return written.text
