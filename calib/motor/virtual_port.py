"""A serial port in virtual time, with the interface of `dynamixel_sdk.PortHandler`: hours of driving in seconds."""

from __future__ import annotations

import errno
from collections import deque
from collections.abc import Sequence

from calib.motor.emulator import Emulator


class VirtualClock:
    """Call it for the time in s; `sleep` moves it on at once. It starts at `start_s`."""

    def __init__(self, start_s: float = 0.0) -> None:
        self._now = start_s

    def __call__(self) -> float:
        """The time in s."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Moves the time on; a negative time counts as none."""
        self._now += max(0.0, seconds)


SUPPORTED = (
    9_600, 57_600, 115_200, 230_400, 460_800, 500_000, 576_000, 921_600, 1_000_000, 1_152_000, 2_000_000, 2_500_000,
    3_000_000, 3_500_000, 4_000_000,
)  # fmt: skip
"""Rates that the SDK's port takes."""
BITS_A_BYTE = 10
SDK_WAIT_S = 0.034
"""The SDK's allowance for an answer beyond its time on the line: twice an FTDI latency of 16 ms, and 2 ms."""
BEYOND_S = 1e-6
"""How far past a deadline time jumps, so that it has surely passed."""


class VirtualPort:
    """A port to an emulated motor whose clock is a `VirtualClock`; that clock moves only as bytes and waits take time.

    `latency_s` is the adapter's (1 ms for a U2D2 set up well, 16 ms as it comes). Once the motor is not connected any
    more, reading and writing raise OSError as pyserial's do, and clearing raises what a lost terminal does: an error
    that is no OSError.
    """

    def __init__(self, device: Emulator, latency_s: float = 1e-3, port_name: str = "virtual") -> None:
        if not isinstance(device.clock, VirtualClock):
            raise TypeError(f"the motor's clock is {device.clock!r}: a VirtualPort needs a motor with a VirtualClock")
        self.device = device
        self.clock = device.clock
        self.latency_s = latency_s
        self.port_name = port_name
        self.baudrate = 1_000_000
        self.is_open = False
        self.is_using = False
        self.packet_start_time = 0.0
        self.packet_timeout = 0.0
        self._arriving: deque[tuple[float, int]] = deque()

    @property
    def tx_time_per_byte(self) -> float:
        """Time of a byte on the line, ms."""
        return 1000.0 * BITS_A_BYTE / self.baudrate

    def openPort(self) -> bool:
        """Opens at the present rate."""
        return self.setBaudRate(self.baudrate)

    def closePort(self) -> None:
        """Closes; what was still arriving is lost."""
        self.is_open = False
        self._arriving.clear()

    def clearPort(self) -> None:
        """Throws away what has arrived; what is still on its way arrives later."""
        if not self.device.connected:
            raise _terminal_error()
        while self.getBytesAvailable():
            self._arriving.popleft()

    def setPortName(self, port_name: str) -> None:
        """Sets the name."""
        self.port_name = port_name

    def getPortName(self) -> str:
        """The name."""
        return self.port_name

    def setBaudRate(self, baudrate: int) -> bool:
        """Sets the rate and opens; False for one the SDK does not know."""
        if baudrate not in SUPPORTED:
            return False
        if not self.device.connected:
            raise OSError(errno.ENOENT, "could not open port: the cable is lost", self.port_name)
        self.baudrate = baudrate
        self.is_open = True
        self._arriving.clear()
        return True

    def getBaudRate(self) -> int:
        """The rate, bits a second."""
        return self.baudrate

    def getBytesAvailable(self) -> int:
        """How many bytes have arrived."""
        now = self.clock()
        return sum(at <= now for at, _ in self._arriving)

    def readPort(self, length: int) -> bytes:
        """Up to `length` of the bytes that have arrived."""
        self._check()
        return bytes(self._arriving.popleft()[1] for _ in range(min(length, self.getBytesAvailable())))

    def writePort(self, packet: Sequence[int]) -> int:
        """Sends bytes; time moves on by what they take on the line. The number sent."""
        self._check()
        data = bytes(packet)
        self.clock.sleep(len(data) * self.tx_time_per_byte / 1000)
        reply = self.device.feed(data, self.baudrate)
        at = self.clock() + self.device.reply_delay_s + self.latency_s
        if self._arriving:
            at = max(at, self._arriving[-1][0])
        for byte in reply:
            at += self.tx_time_per_byte / 1000
            self._arriving.append((at, byte))
        return len(data)

    def setPacketTimeout(self, packet_length: int) -> None:
        """Starts the wait for an answer of so many bytes."""
        self.setPacketTimeoutMillis(self.tx_time_per_byte * packet_length + SDK_WAIT_S * 1000)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        """Starts a wait of so many ms."""
        self.packet_start_time = self.getCurrentTime()
        self.packet_timeout = msec

    def isPacketTimeout(self) -> bool:
        """True once the wait is over. Where nothing has arrived, time first jumps to what comes next."""
        if not self.getBytesAvailable():
            deadline = (self.packet_start_time + self.packet_timeout) / 1000 + BEYOND_S
            last = self._arriving[-1][0] if self._arriving else deadline
            self.clock.sleep(min(last, deadline) - self.clock())
        if self.getTimeSinceStart() > self.packet_timeout:
            self.packet_timeout = 0
            return True
        return False

    def getCurrentTime(self) -> float:
        """The time, ms."""
        return self.clock() * 1000

    def getTimeSinceStart(self) -> float:
        """How long the wait has lasted, ms."""
        return self.getCurrentTime() - self.packet_start_time

    def _check(self) -> None:
        if not self.is_open:
            raise OSError(errno.EBADF, "the port is not open", self.port_name)
        if not self.device.connected:
            raise OSError(errno.EIO, "device reports readiness to read but returned no data", self.port_name)


def _terminal_error() -> Exception:
    """What flushing a lost terminal raises; OSError where there are no such terminals."""
    try:
        import termios
    except ImportError:
        return OSError(errno.EIO, "Input/output error")
    return termios.error(errno.EIO, "Input/output error")
