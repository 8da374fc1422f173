"""A language server that has one thing to say, and starts at once: for tests of when and from where it is started."""

from __future__ import annotations

import json
import sys
from typing import Any

SAID = "it was opened"


def send(**message: Any) -> None:
    body = json.dumps({"jsonrpc": "2.0", **message}).encode()
    sys.stdout.buffer.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
    sys.stdout.buffer.flush()


def main() -> None:
    """Answer all questions with nothing; say of each document that it was opened."""
    sizes: list[int] = []
    while line := sys.stdin.buffer.readline():
        if line.strip():
            sizes += [int(line.partition(b":")[2])] if line.lower().startswith(b"content-length") else []
            continue
        message = json.loads(sys.stdin.buffer.read(sizes.pop()))
        match message["method"]:
            case "initialize":
                send(id=message["id"], result={"capabilities": {"textDocumentSync": 1}})
            case "textDocument/didOpen":
                spot = {"line": 0, "character": 0}
                found = {"range": {"start": spot, "end": spot}, "message": SAID, "severity": 1}
                given = {"uri": message["params"]["textDocument"]["uri"], "diagnostics": [found]}
                send(method="textDocument/publishDiagnostics", params=given)
            case "exit":
                return
            case _ if "id" in message:
                send(id=message["id"], result=None)


if __name__ == "__main__":
    main()
