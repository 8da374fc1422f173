"""Entries that are written for what is plugged in mean it, and nothing else."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.devices.serial_ports import SerialPort, UsbDevice
from rbxcompose.domains.devices.udev import names_of, proposed, same_serials

PLACES = st.tuples(st.sampled_from(["1-1", "1-1.2", "2-1"]), st.integers(0, 2))
KINDS = st.tuples(st.sampled_from(["0403", "1a86"]), st.sampled_from(["6001", "6014"]), st.sampled_from(["", "1", "2"]))


@st.composite
def machines(draw: st.DrawFn) -> list[SerialPort]:
    """Ports of devices: what is at one USB port is one device, with several interfaces."""
    places = sorted(draw(st.sets(PLACES, min_size=1)))
    kinds = {place: draw(KINDS) for place, _ in places}
    return [
        SerialPort(f"/dev/ttyUSB{number}", (), UsbDevice(*kinds[place], place, part))
        for number, (place, part) in enumerate(places)
    ]


@given(machines())
def test_an_entry_means_its_port_alone(ports: list[SerialPort]) -> None:
    for port in ports:
        keys = dict(proposed(port, ports))
        interface = int(keys.pop("interface")) if "interface" in keys else None
        wanted = UsbDevice(**keys, interface=interface, name="it")
        assert [serial_port for serial_port in ports if names_of(serial_port, [wanted])] == [port]


def test_adapters_with_one_serial_number_are_found_and_several_ports_of_one_are_not() -> None:
    ports = [
        SerialPort(f"/dev/ttyUSB{number}", (), UsbDevice("10c4", "ea60", serial, place, part))
        for number, (serial, place, part) in enumerate(
            [("0001", "1-1", 0), ("0001", "1-2", 0), ("F4", "1-3", 0), ("F4", "1-3", 1), ("", "1-4", 0), ("", "1-5", 0)]
        )
    ]
    assert [[port.path for port in group] for group in same_serials(ports)] == [["/dev/ttyUSB0", "/dev/ttyUSB1"]]


def test_a_port_without_a_device_is_meant_by_its_link() -> None:
    port = SerialPort("/dev/pts/0", ("/dev/arm", "/dev/serial/by-id/leg"))
    assert names_of(port, [UsbDevice("0403", "6014", name="arm"), UsbDevice("0403", "6014", name="leg")]) == ["arm"]
