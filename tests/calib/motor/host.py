"""A host of the tests' own: instructions in, error byte and parameters out, on an emulated motor."""

from typing import NamedTuple

from calib.motor import Emulator
from calib.motor.protocol import Instruction, Packet, PacketReader, encode
from tests.calib.motor.virtual_port import VirtualClock

OPERATING_MODE, TORQUE_ENABLE, BUS_WATCHDOG, GOAL_VELOCITY, PROFILE_ACCELERATION = 11, 64, 98, 104, 108
SIZES = {OPERATING_MODE: 1, TORQUE_ENABLE: 1, BUS_WATCHDOG: 1, GOAL_VELOCITY: 4, PROFILE_ACCELERATION: 4}


class Answer(NamedTuple):
    error: int
    params: bytes


class Host:
    def __init__(self, motor: Emulator | None = None) -> None:
        self.clock = VirtualClock()
        self.motor = motor or Emulator(clock=self.clock)

    def ask(self, instruction: int, params: bytes = b"", to: int = 1) -> Answer | None:
        """The one answer, or None for silence."""
        answers = PacketReader().push(self.motor.feed(encode(Packet(to, instruction, params))))
        assert len(answers) <= 1
        if not answers:
            return None
        assert answers[0].intact
        assert answers[0].instruction == Instruction.STATUS
        return Answer(answers[0].params[0], answers[0].params[1:])

    def write(self, address: int, value: int, size: int | None = None) -> int | None:
        size = size or SIZES[address]
        data = (value & (1 << 8 * size) - 1).to_bytes(size, "little")
        answer = self.ask(Instruction.WRITE, address.to_bytes(2, "little") + data)
        return None if answer is None else answer.error

    def read(self, address: int, size: int, signed: bool = False) -> int:
        answer = self.ask(Instruction.READ, address.to_bytes(2, "little") + size.to_bytes(2, "little"))
        assert answer is not None
        assert answer.error & 0x7F == 0
        assert len(answer.params) == size
        return int.from_bytes(answer.params, "little", signed=signed)

    def turn(self, goal: int, acceleration: int = 0) -> None:
        """Velocity mode, torque on, off it goes."""
        for address, value in (
            (OPERATING_MODE, 1),
            (TORQUE_ENABLE, 1),
            (PROFILE_ACCELERATION, acceleration),
            (GOAL_VELOCITY, goal),
        ):
            assert self.write(address, value) == 0
