"""Run by the Python of a ROS 2: its types with their hashes and random samples of each, then its view of ours.

It writes a line of JSON, reads one, and answers with another.
"""

from __future__ import annotations

import importlib
import json
import random
import re
import string
import sys
from pathlib import Path
from typing import Any

SAMPLES = 4  # of each type
_BITS = re.compile(r"(u?)int(\d+)")
rclpy = importlib.import_module("rclpy.serialization")


def structures(share: Path) -> dict[str, str]:
    """Return the hash of each structure by name."""
    found = {}
    for path in (path for path in sorted(share.glob("*/*/*.json")) if path.parts[-3] != "test_msgs"):
        for one in json.loads(path.read_text()).get("type_hashes", ()):
            found[one["type_name"]] = one["hash_string"]
    return found


def class_of(name: str) -> Any:
    """Return the class of a message or of a part of a service."""
    package, kind, bare = name.split("/")
    whole, is_part, part = bare.partition("_")
    found = getattr(importlib.import_module(f"{package}.{kind}"), whole)
    return getattr(found, part) if is_part else found


def some(cls: Any, dice: random.Random) -> Any:
    """Return a message with random values."""
    made = cls()
    for field, text in cls.get_fields_and_field_types().items():
        setattr(made, field, value(text, dice))
    return made


def value(text: str, dice: random.Random) -> Any:
    """Return a random value of a field of this type."""
    if fixed := re.fullmatch(r"(.+)\[(\d+)\]", text):
        return [value(fixed[1], dice) for _ in range(int(fixed[2]))]
    if many := re.fullmatch(r"sequence<(.+?)(?:, (\d+))?>", text):
        return [value(many[1], dice) for _ in range(dice.randint(0, min(3, int(many[2] or 3))))]
    if bits := _BITS.fullmatch(text):
        least, size = (0, int(bits[2])) if bits[1] else (-(2 ** (int(bits[2]) - 1)), int(bits[2]))
        return least + dice.randrange(2**size)
    if text in ("boolean", "octet", "float", "double"):
        return {
            "boolean": dice.random() < 0.5,
            "octet": bytes([dice.randrange(256)]),
            "float": dice.randrange(-1000, 1000) / 8,
            "double": dice.uniform(-1e9, 1e9),
        }[text]
    if text.startswith("string"):
        return "".join(dice.choices(string.ascii_letters + "äßλ…", k=dice.randrange(8)))
    package, bare = text.split("/")
    return some(class_of(f"{package}/msg/{bare}"), dice)


def tell(answer: object) -> None:
    """Write a line."""
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


def main() -> None:
    """Answer."""
    dice, hashes = random.Random(1), structures(Path(sys.prefix, "share"))
    names = [name for name in hashes if "/msg/" in name or name.endswith(("_Request", "_Response"))]
    samples = {name: [some(class_of(name), dice) for _ in range(SAMPLES)] for name in names}
    written = {name: [rclpy.serialize_message(one).hex() for one in ones] for name, ones in samples.items()}
    tell({"hashes": hashes, "samples": written})
    asked = json.loads(sys.stdin.readline())
    read = {
        name: [rclpy.deserialize_message(bytes.fromhex(one), class_of(name)) for one in ones]
        for name, ones in asked["again"].items()
    }
    theirs = {
        name: [
            rclpy.serialize_message(rclpy.deserialize_message(bytes.fromhex(one), class_of(name))).hex() for one in ones
        ]
        for name, ones in asked["ours"].items()
    }
    tell({"differing": [name for name in read if read[name] != samples[name]], "theirs": theirs})


if __name__ == "__main__":
    main()
