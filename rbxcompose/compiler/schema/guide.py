"""What can be at a place of a manifest, read from its JSON Schema and the text around the place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.base.units import DIMENSIONS, Dimension
from rbxcompose.compiler.schema.overlays import SECTION, WHOLE
from rbxcompose.compiler.schema.scalars import DIMENSION, Schema, referred
from rbxcompose.manifest.tree import KeyPath, MappingNode, TreeNode, at, text_at

_DEEPEST = 12  # nested references and choices


class Guide:
    """The schema of one kind of manifest.

    `types` are the types of the robot's components by name: an overlay does not repeat them.
    """

    def __init__(self, schema: Schema, root: MappingNode, types: Mapping[str, str]) -> None:
        self.schema = schema
        self.root = root
        self.types = types

    def keys(self, path: KeyPath) -> dict[str, Schema]:
        """Return the schemas of the keys that the map at `path` may have, without names chosen by the user."""
        shapes = [shape for shape in self._shapes(path) if "properties" in shape]
        closed = [shape for shape in shapes if shape.get("additionalProperties") is False]
        names = dict.fromkeys(name for shape in closed or shapes for name in shape["properties"])
        # A key that is only allowed here (`true`) is described in another schema.
        described = {
            name: schema
            for shape in [*shapes, *closed]
            for name, schema in shape["properties"].items()
            if schema is not True
        }
        return {name: self._whole(described.get(name, {})) for name in names}

    def _whole(self, schema: Schema) -> Schema:
        """Return a schema merged with those it refers to; its own statements take precedence."""
        whole: Schema = {}
        for one in self._opened(schema, None, ()):
            whole = {**one, **whole}
        return whole

    def describe(self, path: KeyPath) -> str:
        """Return the purpose of the value at `path`."""
        return next((schema["description"] for schema in self._last(path) if schema.get("description")), "")

    def value(self, path: KeyPath) -> GuidedValue:
        """Return what can be at `path`."""
        return GuidedValue([*self._shapes(path)])

    def _shapes(self, path: KeyPath) -> Iterator[Schema]:
        node = at(self.root, path)
        for schema in self._last(path):
            yield from self._opened(schema, node, path)

    def _last(self, path: KeyPath) -> list[Schema]:
        """Return the schemas of the place itself, before their references and choices are resolved."""
        found = [self.schema]
        for length, key in enumerate(path):
            above = path[:length]
            node = at(self.root, above)
            opened = [one for schema in found for one in self._opened(schema, node, above)]
            found = [self._meant(inner) for schema in opened for inner in _below(schema, key)]
        return found

    def _meant(self, schema: Schema) -> Schema:
        """Return the key of a definition that a schema refers to, or the schema itself."""
        is_key = any(part in schema.get("$ref", "") for part in ("/properties/", f"/{SECTION}", f"/{WHOLE}{SECTION}"))
        return referred(schema, self.schema) if is_key else schema

    def _opened(self, schema: Schema, node: TreeNode | None, path: KeyPath, depth: int = 0) -> Iterator[Schema]:
        """Yield a schema, and all those it refers to or combines."""
        if depth > _DEEPEST:
            return
        yield schema
        inner = [*schema.get("allOf", ()), *schema.get("anyOf", ())]
        if "$ref" in schema:
            inner.append(referred(schema, self.schema))
        if "if" in schema:
            branch = "then" if self._holds(schema["if"], node, path) else "else"
            inner.extend([schema[branch]] if branch in schema else [])
        for one in inner:
            yield from self._opened(one, node, path, depth + 1)

    def _holds(self, condition: Schema, node: TreeNode | None, path: KeyPath) -> bool:
        if "not" in condition:
            return not any(self._holds(one, node, path) for one in condition["not"]["anyOf"])
        wanted = {name: entry.get("const") for name, entry in condition.get("properties", {}).items()}
        if not isinstance(node, MappingNode):
            return False
        if any(name not in node and name not in wanted for name in condition.get("required", ())):
            return False
        return all(self._word(node, name, path) == const for name, const in wanted.items())

    def _word(self, node: MappingNode, name: str, path: KeyPath) -> str:
        value = node.get(name)
        if value is None and name == "type" and path:
            return self.types.get(str(path[-1]), "")
        return text_at(value)


def _below(schema: Schema, key: str | int) -> Iterator[Schema]:
    items, others = schema.get("items"), schema.get("additionalProperties")
    if isinstance(key, int):
        if isinstance(items, dict):
            yield items
    elif key in schema.get("properties", {}):
        if schema["properties"][key] is not True:
            yield schema["properties"][key]
    elif isinstance(others, dict):
        yield others


class GuidedValue:
    """What can be at one place."""

    def __init__(self, shapes: list[Schema]) -> None:
        self.shapes = shapes

    def _first(self, key: str) -> Any:
        return next((shape[key] for shape in self.shapes if key in shape), None)

    @property
    def dimension(self) -> Dimension | None:
        """Return the dimension of a quantity here."""
        name = self._first(DIMENSION)
        return DIMENSIONS[name] if name else None

    @property
    def names(self) -> str:
        """Return the kind of thing whose name is expected here, such as `place`; empty if none is."""
        return str(self._first("x-names") or "")

    @property
    def default(self) -> object:
        """Return the default."""
        return self._first("default")

    @property
    def examples(self) -> list[str]:
        """Return examples that are one word or number."""
        found = [sample for shape in self.shapes for sample in shape.get("examples", ())]
        return list(dict.fromkeys(str(sample) for sample in found if isinstance(sample, str | int | float)))

    @property
    def words(self) -> dict[str, str]:
        """Return the words possible here, each with its meaning."""
        found: dict[str, str] = {}
        for shape in self.shapes:
            about = shape.get("enumDescriptions") or [""] * len(shape.get("enum", ()))
            found |= {str(word): text for word, text in zip(shape.get("enum", ()), about, strict=True) if word}
            if "const" in shape:
                found.setdefault(str(shape["const"]), shape.get("description", ""))
            if "boolean" in shape.get("type", ()) and "number" not in shape.get("type", ()):
                found |= {"true": "", "false": ""} if "minLength" not in shape else {}
        return found
