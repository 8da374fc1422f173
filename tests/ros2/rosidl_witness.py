"""Run by the Python of a ROS 2 with the folder of a package: the hashes that rosidl gives to its types, as JSON."""

from __future__ import annotations

import contextlib
import importlib
import json
import sys
import tempfile
from pathlib import Path


def main(package: Path) -> None:
    """Answer."""
    adapter = importlib.import_module("rosidl_adapter")
    generator = importlib.import_module("rosidl_generator_type_description")
    share = Path(sys.prefix, "share")
    with tempfile.TemporaryDirectory() as made:
        texts = [path.relative_to(package) for path in sorted(package.glob("*/*")) if path.suffix[1:] in path.parts]
        with contextlib.redirect_stdout(sys.stderr):
            for text in texts:
                adapter.convert_to_idl(package, package.name, text, Path(made))
        arguments = {
            "package_name": package.name,
            "output_dir": made,
            "idl_tuples": [f"{made}:{text.with_suffix('.idl')}" for text in texts],
            "include_paths": [f"{other.name}:{other}" for other in share.iterdir()],
        }
        Path(made, "arguments.json").write_text(json.dumps(arguments))
        generator.generate_type_hash(f"{made}/arguments.json")
        hashes: dict[str, str] = {}
        for path in Path(made).glob("*/*.json"):
            hashes |= {one["type_name"]: one["hash_string"] for one in json.loads(path.read_text())["type_hashes"]}
    sys.stdout.write(json.dumps({name: one for name, one in hashes.items() if name.startswith(f"{package.name}/")}))


if __name__ == "__main__":
    main(Path(sys.argv[1]).absolute())
