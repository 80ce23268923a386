"""The packets of DYNAMIXEL Protocol 2.0: header, byte stuffing, CRC-16.

Source: ROBOTIS e-manual, "Protocol 2.0" (packet fields, processing order, error numbers) and "CRC calculation". Written
from that text, without ROBOTIS' SDK, so that the two can be tested against each other.
"""

from enum import IntEnum
from typing import NamedTuple

HEADER = b"\xff\xff\xfd\x00"
BROADCAST_ID = 0xFE
ALERT = 0x80
"""Bit of the error byte that means that Hardware Error Status (70) is not zero."""

STUFFED = b"\xff\xff\xfd\xfd"
PLAIN = b"\xff\xff\xfd"


class Instruction(IntEnum):
    """The instruction of a packet, or `STATUS` for an answer."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    STATUS = 0x55


class ErrorNumber(IntEnum):
    """Bits 0 to 6 of a status packet's error byte."""

    NONE = 0
    INSTRUCTION = 2
    CRC = 3
    DATA_RANGE = 4
    DATA_LIMIT = 6
    ACCESS = 7


class Packet(NamedTuple):
    """A packet without its stuffing. `intact` is False when its CRC did not match: only `id` may then be used."""

    id: int
    instruction: int
    params: bytes = b""
    intact: bool = True


def crc16(data: bytes) -> int:
    """Compute the CRC-16 with polynomial 0x8005, start 0, not reflected, of the stuffed packet from its header on."""
    crc = 0
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ (0x18005 if crc & 0x8000 else 0)
    return crc


def encode(packet: Packet) -> bytes:
    """Encode a packet for the line: stuffed, with length and CRC."""
    body = (bytes([packet.instruction]) + packet.params).replace(PLAIN, STUFFED)
    head = HEADER + bytes([packet.id]) + (len(body) + 2).to_bytes(2, "little")
    return head + body + crc16(head + body).to_bytes(2, "little")


class PacketReader:
    """A finder of packets in a stream of bytes that may hold anything else as well.

    Stuffing keeps the header out of every packet, so that one that is cut short costs itself alone.
    """

    def __init__(self) -> None:
        self._buffer = b""

    def push(self, data: bytes) -> list[Packet]:
        """Return the packets completed by these bytes, in order."""
        packets = []
        self._buffer, *parts = (self._buffer + data).split(HEADER)
        for part in parts:
            end = 3 + int.from_bytes(part[1:3], "little")
            whole = 6 <= end <= len(part)
            if whole:
                packets.append(_decode(HEADER + part[:end]))
            self._buffer = part[end:] if whole else HEADER + part
        return packets


def _decode(raw: bytes) -> Packet:
    body = raw[7:-2].replace(STUFFED, PLAIN)
    return Packet(raw[4], body[0], body[1:], intact=crc16(raw[:-2]) == int.from_bytes(raw[-2:], "little"))
