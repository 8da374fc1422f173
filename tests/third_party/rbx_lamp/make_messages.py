"""Write `rbx_lamp/msgs.py` from the texts in `interfaces/`: `python make_messages.py`."""

from __future__ import annotations

from pathlib import Path

from rbxcompose.msgs.generate import all_structures, modules

HERE = Path(__file__).parent


def text() -> str:
    """Return the Python text of the package's own interfaces."""
    return modules({**all_structures(), **all_structures(HERE / "interfaces")})["rbx_lamp"]


if __name__ == "__main__":
    (HERE / "rbx_lamp/msgs.py").write_text(text(), encoding="utf-8")
