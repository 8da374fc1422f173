"""YAML text -> PyYAML's node tree, by its C parser, with limits enforced while the tree is being built."""

from typing import Any

import yaml

from rbxcompose.base.findings import Finding, Report, Span, kind
from rbxcompose.manifest.tree import DATA_NODES, DEPTH, NODES, MappingNode, TreeNode, is_larger
from rbxcompose.manifest.yaml_errors import explain

TOO_LARGE = kind("RBX1103")


class _LimitError(Exception):
    """Raised inside the parser to stop it; carries the place and the message."""

    def __init__(self, mark: Any, message: str) -> None:
        super().__init__(message)
        self.mark = mark


class _LimitedLoader(yaml.CSafeLoader):
    """Composes without resolving tags; counts nodes and depth in the callbacks that the C code makes for each node."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.nodes = 0
        self.depth = 0

    def descend_resolver(self, current_node: Any, current_index: Any) -> None:
        self.nodes += 1
        self.depth += 1
        if self.depth > DEPTH:
            raise _LimitError(current_node.start_mark, f"values are nested more than {DEPTH} levels deep")
        if self.nodes > NODES:
            siblings = current_node.value
            last = siblings[-1] if siblings else current_node
            last = last[1] if isinstance(last, tuple) else last
            raise _LimitError(last.start_mark, f"more than {NODES:,} values in one file")

    def ascend_resolver(self) -> None:
        self.depth -= 1

    def resolve(self, kind: Any, value: Any, implicit: Any) -> str:
        return ""  # an explicit tag does not come through here


def compose(text: str, file: str) -> tuple[yaml.Node | None, Finding | None]:
    """Return the node tree of one document, or the finding that says why there is none; both None if it is empty."""
    loader = _LimitedLoader(text)
    try:
        return loader.get_single_node(), None
    except _LimitError as error:
        line, column = error.mark.line + 1, error.mark.column + 1
        return None, TOO_LARGE.at(Span(file, line, column, line, column + 1), str(error))
    except yaml.YAMLError as error:
        return None, explain(error, text, file)
    finally:
        loader.dispose()


def is_moderate(section: TreeNode | None, what: str, report: Report) -> bool:
    """Return whether every entry of a section is small enough for a mission, after a finding for each that is not."""
    entries = section.entries.values() if isinstance(section, MappingNode) else ()
    large = [entry for entry in entries if is_larger(entry.value, DATA_NODES)]
    for entry in large:
        message = f"the {what} '{entry.key.text}' holds more than {DATA_NODES:,} values"
        report.add(TOO_LARGE.at(entry.key.span, message, help="a mission reads, checks and copies all of them at once"))
    return not large
