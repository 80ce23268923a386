from __future__ import annotations

import random

import pytest
from dynamixel_sdk import Protocol2PacketHandler
from hypothesis import given
from hypothesis import strategies as st

from calib.motor.protocol import HEADER, Packet, PacketReader, crc16, encode

DOCUMENTED = [  # ROBOTIS e-manual, Protocol 2.0, "Instruction Details"
    (Packet(1, 0x01), "FFFFFD00 01 0300 01 194E"),
    (Packet(0xFE, 0x01), "FFFFFD00 FE 0300 01 3142"),
    (Packet(1, 0x02, b"\x84\x00\x04\x00"), "FFFFFD00 01 0700 02 84000400 1D15"),
    (Packet(1, 0x03, b"\x74\x00\x00\x02\x00\x00"), "FFFFFD00 01 0900 03 740000020000 CA89"),
    (Packet(1, 0x04, b"\x68\x00\xc8\x00\x00\x00"), "FFFFFD00 01 0900 04 6800C8000000 AE8E"),
    (Packet(1, 0x05), "FFFFFD00 01 0300 05 02CE"),
    (Packet(1, 0x06, b"\x01"), "FFFFFD00 01 0400 06 01 A1E6"),
    (Packet(1, 0x08), "FFFFFD00 01 0300 08 2F4E"),
    (Packet(1, 0x10, b"\x01\x44\x58\x4c\x22"), "FFFFFD00 01 0800 10 0144584C22 B1DC"),
    (Packet(0xFE, 0x82, b"\x84\x00\x04\x00\x01\x02"), "FFFFFD00 FE 0900 82 840004000102 CEFA"),
    (Packet(1, 0x55, b"\x00\x06\x04\x26"), "FFFFFD00 01 0700 55 00060426 655D"),
    (Packet(2, 0x55, b"\x00\x1f\x08\x00\x00"), "FFFFFD00 02 0800 55 001F080000 BABE"),
]


@pytest.mark.parametrize(("packet", "documented"), DOCUMENTED)
def test_packets_are_the_bytes_of_the_manual(packet: Packet, documented: str) -> None:
    assert encode(packet) == bytes.fromhex(documented)
    assert PacketReader().push(bytes.fromhex(documented)) == [packet]


def test_the_crc_is_that_of_the_sdk() -> None:
    data = random.Random(3).randbytes(300)

    assert crc16(data) == Protocol2PacketHandler().updateCRC(0, data, len(data))


@given(st.integers(0, 252), st.integers(0, 255), st.lists(st.sampled_from([0xFF, 0xFD, 0, 7]), max_size=60))
def test_any_packet_comes_back_whole(motor_id: int, instruction: int, params: list[int]) -> None:
    packet = Packet(motor_id, instruction, bytes(params))

    assert PacketReader().push(encode(packet)) == [packet]
    assert HEADER not in encode(packet)[7:-2]


@given(st.lists(st.binary(max_size=9), max_size=5), st.integers(1, 13))
def test_packets_are_found_whatever_is_between_and_however_they_arrive(noise: list[bytes], piece: int) -> None:
    packets = [Packet(1, 0x02, bytes([number, 0, 4, 0])) for number in range(len(noise))]
    stream = b"".join(rest.replace(b"\xff", b"") + encode(packet) for rest, packet in zip(noise, packets, strict=True))
    reader = PacketReader()

    found = [one for at in range(0, len(stream), piece) for one in reader.push(stream[at : at + piece])]

    assert found == packets


@pytest.mark.parametrize("at", range(4, 14))
def test_a_flipped_bit_is_never_taken_for_a_packet(at: int) -> None:
    sent = bytearray(encode(DOCUMENTED[2][0]))
    sent[at] ^= 0x10

    assert not any(packet.intact for packet in PacketReader().push(bytes(sent)))


def test_a_length_that_cannot_be_does_not_hold_up_what_follows() -> None:
    ping = Packet(1, 0x01)

    for length in (b"\x00\x00", b"\x02\x00", b"\xff\xff"):
        assert PacketReader().push(HEADER + b"\x01" + length + encode(ping)) == [ping]
