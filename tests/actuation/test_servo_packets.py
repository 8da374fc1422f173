"""The fake's packets, against the SDK's own and against garbage."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.dynamixel_port import PacketsOne, PacketsTwo
from rbxcompose.domains.servos.twins.servo_line import ServoPacket, crc_of, packet_one, packet_two, packets, status

IDS, CODES = st.integers(0, 252), st.integers(1, 0x9F)
STUFFY = st.lists(st.sampled_from([0xFF, 0xFD, 0x00, 0x55, 0x12]), max_size=30).map(bytes)
GIVEN = st.one_of(STUFFY, st.binary(max_size=30))
MAKERS: dict[int, Callable[[int, int, bytes], bytes]] = {1: packet_one, 2: packet_two}


class Tape:
    """What the SDK takes for a port: keeps what is sent, gives what is recorded."""

    def __init__(self, recorded: bytes = b"") -> None:
        self.is_using = False
        self.recorded, self.sent = bytearray(recorded), b""

    def clearPort(self) -> None:  # noqa: N802
        pass

    def writePort(self, packet: list[int]) -> int:  # noqa: N802
        self.sent = bytes(packet)
        return len(packet)

    def readPort(self, length: int) -> bytes:  # noqa: N802
        taken = bytes(self.recorded[:length])
        del self.recorded[:length]
        return taken

    def isPacketTimeout(self) -> bool:  # noqa: N802
        return not self.recorded


@given(st.sampled_from([1, 2]), IDS, CODES, GIVEN)
def test_a_packet_is_taken_as_it_was_made(protocol: int, id: int, code: int, given: bytes) -> None:
    buffer = bytearray(MAKERS[protocol](id, code, given))
    assert list(packets(buffer)) == [ServoPacket(protocol, id, code, given)]
    assert buffer == b""


@given(st.sampled_from([1, 2]), IDS, GIVEN, st.integers(1, 60))
def test_a_packet_in_pieces_is_taken_when_it_is_whole(protocol: int, id: int, given: bytes, cut: int) -> None:
    data = MAKERS[protocol](id, 3, given)
    buffer = bytearray(data[:cut])
    found = list(packets(buffer))
    buffer += data[cut:]
    assert [*found, *packets(buffer)] == [ServoPacket(protocol, id, 3, given)]


@given(st.binary(max_size=60))
def test_garbage_is_survived(data: bytes) -> None:
    buffer = bytearray(data)
    for packet in packets(buffer):
        assert packet.protocol in (1, 2)
    assert len(buffer) <= len(data)


@given(IDS, st.integers(0, 65535), GIVEN.filter(bool))
def test_what_the_sdk_writes_is_read(id: int, address: int, given: bytes) -> None:
    tape = Tape()
    PacketsTwo().writeTxOnly(tape, id, address, len(given), list(given))
    [packet] = packets(bytearray(tape.sent))
    assert packet == ServoPacket(2, id, 3, address.to_bytes(2, "little") + given)
    PacketsOne().writeTxOnly(tape, id, address % 256, len(given), list(given))
    [packet] = packets(bytearray(tape.sent))
    assert packet == ServoPacket(1, id, 3, bytes([address % 256]) + given)


@given(IDS, st.integers(0, 127), GIVEN)
def test_the_sdk_reads_a_status(id: int, error: int, given: bytes) -> None:
    found, result = PacketsOne().rxPacket(Tape(status(1, id, error, given)))
    assert (result, found[2], found[4], bytes(found[5:-1])) == (0, id, error, given)
    found, result = PacketsTwo().rxPacket(Tape(status(2, id, error, given)), False)
    length = found[5] + 256 * found[6]
    assert (result, found[4], found[8], bytes(found[9 : length + 5])) == (0, id, error, given)


def test_the_checksum_is_that_of_the_protocol() -> None:
    # the example of the e-manual: ping of id 1 in protocol 2.0
    assert packet_two(1, 1) == bytes.fromhex("FFFFFD000103000119 4E".replace(" ", ""))
    assert crc_of(b"") == 0
