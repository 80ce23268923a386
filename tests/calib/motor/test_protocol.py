from __future__ import annotations

import random

import pytest
from dynamixel_sdk import Protocol2PacketHandler
from hypothesis import given
from hypothesis import strategies as st

from calib.capture.emulator import HEADER, BusPacket, PacketReader, crc16, encode

DOCUMENTED = [  # ROBOTIS e-manual, Protocol 2.0, "Instruction Details"
    (BusPacket(0xFE, 0x01), "FFFFFD00 FE 0300 01 3142"),
    (BusPacket(1, 0x02, b"\x84\x00\x04\x00"), "FFFFFD00 01 0700 02 84000400 1D15"),
    (BusPacket(1, 0x03, b"\x74\x00\x00\x02\x00\x00"), "FFFFFD00 01 0900 03 740000020000 CA89"),
    (BusPacket(2, 0x55, b"\x00\x1f\x08\x00\x00"), "FFFFFD00 02 0800 55 001F080000 BABE"),
]


@pytest.mark.parametrize(("packet", "documented"), DOCUMENTED)
def test_packets_are_the_bytes_of_the_manual(packet: BusPacket, documented: str) -> None:
    assert encode(packet) == bytes.fromhex(documented)
    assert PacketReader().push(bytes.fromhex(documented)) == [packet]


def test_the_crc_is_that_of_the_sdk() -> None:
    data = random.Random(3).randbytes(300)

    assert crc16(data) == Protocol2PacketHandler().updateCRC(0, data, len(data))


@given(st.lists(st.lists(st.sampled_from([0xFF, 0xFD, 0, 7]), max_size=60), max_size=5), st.integers(1, 13))
def test_packets_are_found_whatever_is_between_and_however_they_arrive(contents: list[list[int]], piece: int) -> None:
    packets = [BusPacket(1, 0x02, bytes(params)) for params in contents]
    stream = b"".join(b"\xff\xfd\xff" + encode(packet) for packet in packets)
    reader = PacketReader()

    found = [one for at in range(0, len(stream), piece) for one in reader.push(stream[at : at + piece])]

    assert found == packets
    assert all(HEADER not in encode(packet)[7:-2] for packet in packets)


@pytest.mark.parametrize("at", range(4, 14))
def test_a_flipped_bit_is_never_taken_for_a_packet(at: int) -> None:
    sent = bytearray(encode(DOCUMENTED[1][0]))
    sent[at] ^= 0x10

    assert not any(packet.intact for packet in PacketReader().push(bytes(sent)))


@pytest.mark.parametrize("length", [b"\x00\x00", b"\x02\x00", b"\xff\xff"])
def test_a_length_that_cannot_be_does_not_hold_up_what_follows(length: bytes) -> None:
    ping = BusPacket(1, 0x01)

    assert PacketReader().push(HEADER + b"\x01" + length + encode(ping)) == [ping]
