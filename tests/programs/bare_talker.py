"""A program that does not do what its manifest says: it publishes what that does not have, or as another type.

It also serves a service, the key of which its environment names, and says by a liveliness token that it is ready.
"""

import os
import signal
import struct
import sys
import threading
from typing import Any

import zenoh


def main() -> None:
    over = threading.Event()
    signal.signal(signal.SIGTERM, lambda number, frame: over.set())
    key, gid = os.environ["RBXCOMPOSE_KEY_WAVE"], os.urandom(16)

    def answer(query: Any) -> None:
        sys.stdout.write("waved\n")
        attachment = struct.pack("<qqB", 1, 0, 16) + gid
        query.reply(key, b"\0\1\0\0" + struct.pack("<?3xI", True, 1) + b"\0", attachment=attachment)

    with zenoh.open(zenoh.Config.from_env()) as session:
        session.declare_queryable(key, answer, complete=True)  # clients ask only complete ones
        rogue = session.declare_publisher(os.environ["RBXCOMPOSE_KEY_CHATTER"].replace("/chatter/", "/rogue/"))
        chatter = session.declare_publisher(os.environ["RBXCOMPOSE_KEY_CHATTER"].replace("String", "Empty"))
        token = session.liveliness().declare_token("talker/ready")
        while not over.wait(0.1):
            rogue.put(b"")
            chatter.put(b"")
        del token  # kept until here: without a reference, it would be undeclared


if __name__ == "__main__":
    main()
