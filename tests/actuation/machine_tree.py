"""A made tree of a machine: its serial ports and USB devices, as the kernel lists them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class MachineTree:
    """The root folder of a machine that is made up."""

    root: Path

    def plug(
        self, name: str, vendor: str = "0403", product: str = "6014", *, serial: str = "", latency: int | None = None
    ) -> Path:
        """Connect a USB adapter as the tty `name`, with a latency timer [ms]; return the file of its port."""
        bus = self.root / "sys/bus"
        number = len(list((bus / "usb/devices").glob("*"))) + 1
        folder = bus / f"usb/devices/1-{number}"
        own = folder / f"1-{number}:1.0"
        (own / "tty" / name if name.startswith("ttyACM") else own / name / "tty" / name).mkdir(parents=True)
        for key, text in {"idVendor": vendor, "idProduct": product, "serial": serial}.items():
            if text:
                (folder / key).write_text(f"{text}\n", encoding="ascii")
        if latency is not None:
            timer = bus / f"usb-serial/devices/{name}/latency_timer"
            timer.parent.mkdir(parents=True)
            timer.write_text(f"{latency}\n", encoding="ascii")
        port = self.root / "dev" / name
        port.parent.mkdir(exist_ok=True)
        port.touch()
        if serial:
            link = self.root / f"dev/serial/by-id/usb-{serial}-if00-port0"
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(f"../../{name}")
        return port
