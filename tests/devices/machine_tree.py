"""A made tree of a machine: its serial ports and USB devices, in the layout in which Linux lists them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class MachineTree:
    """The root folder of a machine that is made up."""

    root: Path

    def plug(
        self,
        name: str,
        vendor: str = "0403",
        product: str = "6014",
        *,
        serial: str = "",
        latency: int | None = None,
        usb_port: str = "",
        interface: int = 0,
        about: tuple[str, str] = ("", ""),
        driver: str = "ftdi_sio",
    ) -> Path:
        """Connect a USB adapter as the tty `name`, with a latency timer [ms]; return the file of its port.

        The same USB port again is one more interface of the device there.
        """
        bus = self.root / "sys/bus"
        devices = bus / "usb/devices"
        place = usb_port or f"1-{len([one for one in devices.glob('*') if ':' not in one.name]) + 1}"
        folder = self.root / f"sys/devices/pci0000:00/0000:00:14.0/usb1/{place}"
        own = folder / f"{place}:1.{interface}"
        (own / "tty" / name if name.startswith("ttyACM") else own / name / "tty" / name).mkdir(parents=True)
        (own / "bInterfaceNumber").write_text(f"{interface:02x}\n", encoding="ascii")
        self._link(own / "driver", bus / f"usb-serial/drivers/{driver}")
        for path in (folder, own):
            self._link(devices / path.name, path)
        told = {"idVendor": vendor, "idProduct": product, "serial": serial, "manufacturer": about[0]}
        for key, text in {**told, "product": about[1]}.items():
            if text:
                (folder / key).write_text(f"{text}\n", encoding="utf-8")
        if latency is not None:
            timer = bus / f"usb-serial/devices/{name}/latency_timer"
            timer.parent.mkdir(parents=True)
            timer.write_text(f"{latency}\n", encoding="ascii")
        port = self.root / "dev" / name
        port.parent.mkdir(exist_ok=True)
        port.touch()
        if serial:
            self._link(self.root / f"dev/serial/by-id/usb-{serial}-if{interface:02x}-port0", port)
        return port

    def link(self, name: str, target: str) -> Path:
        """Make the link `/dev/NAME`, as a udev rule does."""
        link = self.root / "dev" / name
        link.parent.mkdir(exist_ok=True)
        link.symlink_to(target)
        return link

    @staticmethod
    def _link(link: Path, target: Path) -> None:
        link.parent.mkdir(parents=True, exist_ok=True)
        if not link.is_symlink():
            link.symlink_to(os.path.relpath(target, link.parent))
