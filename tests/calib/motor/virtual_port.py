"""A serial port in virtual time, with what `dynamixel_sdk` asks of its `PortHandler`: hours of driving in seconds."""

import errno
import termios
from collections import deque
from collections.abc import Sequence

from calib.capture.emulator import MotorEmulator

BITS_A_BYTE = 10
SDK_WAIT_S = 0.034
"""The SDK's allowance for an answer beyond its time on the line: twice an FTDI latency of 16 ms, and 2 ms."""
BEYOND_S = 1e-6
"""How far past a deadline time jumps, so that it has surely passed."""


class VirtualClock:
    """Call it for the time in s; `sleep` moves it on at once."""

    def __init__(self) -> None:
        self._now = 0.0

    def __call__(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        self._now += max(0.0, seconds)


class VirtualPort:
    """A port to an emulated motor whose clock is a `VirtualClock`; that clock moves only as bytes and waits take time.

    `latency_s` is the adapter's (1 ms for a U2D2 set up well, 16 ms as it comes). Once the motor is not connected any
    more, reading and writing raise OSError as pyserial's do, and clearing raises what a lost terminal does: an error
    that is no OSError.
    """

    def __init__(self, device: MotorEmulator, latency_s: float = 1e-3) -> None:
        assert isinstance(device.clock, VirtualClock)
        self.device, self.clock, self.latency_s = device, device.clock, latency_s
        self.baudrate = 1_000_000
        self.is_using = False
        self._until = 0.0  # an answer is waited for, s
        self._arriving: deque[tuple[float, int]] = deque()

    @property
    def tx_time_per_byte(self) -> float:
        """Time of a byte on the line, ms."""
        return 1000.0 * BITS_A_BYTE / self.baudrate

    def getBaudRate(self) -> int:
        return self.baudrate

    def clearPort(self) -> None:
        """Throws away what has arrived; what is still on its way arrives later."""
        if not self.device.connected:
            raise termios.error(errno.EIO, "Input/output error")
        while self.getBytesAvailable():
            self._arriving.popleft()

    def getBytesAvailable(self) -> int:
        now = self.clock()
        return sum(at <= now for at, _ in self._arriving)

    def readPort(self, length: int) -> bytes:
        self._check()
        return bytes(self._arriving.popleft()[1] for _ in range(min(length, self.getBytesAvailable())))

    def writePort(self, packet: Sequence[int]) -> int:
        """Sends bytes; time moves on by what they take on the line."""
        self._check()
        data = bytes(packet)
        self.clock.sleep(len(data) * self.tx_time_per_byte / 1000)
        reply = self.device.feed(data)
        at = self.clock() + self.device.reply_delay_s + self.latency_s
        if self._arriving:
            at = max(at, self._arriving[-1][0])
        for byte in reply:
            at += self.tx_time_per_byte / 1000
            self._arriving.append((at, byte))
        return len(data)

    def setPacketTimeout(self, packet_length: int) -> None:
        self.setPacketTimeoutMillis(self.tx_time_per_byte * packet_length + SDK_WAIT_S * 1000)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        self._until = self.clock() + msec / 1000

    def isPacketTimeout(self) -> bool:
        """True once the wait is over. Where nothing has arrived, time first jumps to what comes next."""
        deadline = self._until + BEYOND_S
        if not self.getBytesAvailable():
            last = self._arriving[-1][0] if self._arriving else deadline
            self.clock.sleep(min(last, deadline) - self.clock())
        return self.clock() > self._until

    def _check(self) -> None:
        if not self.device.connected:
            raise OSError(errno.EIO, "device reports readiness to read but returned no data")
