"""A relay as a node of dora, told by its environment which one it is; the first in the row hears a timer."""

from __future__ import annotations

import os

from dora import Node

from benchmarks.relay_nodes.mark import mark

SIZE = 52  # [bytes] of a twist


def main(number: int, folder: str) -> None:
    """Pass messages on until there are no more."""
    node, is_marked = Node(), False
    for event in node:
        if event["type"] != "INPUT":
            continue
        node.send_output("told", event["value"] if number else bytes(SIZE))
        if not is_marked:
            is_marked = True
            mark(folder, number)


if __name__ == "__main__":
    main(int(os.environ["RELAY_NUMBER"]), os.environ["RELAY_FOLDER"])
