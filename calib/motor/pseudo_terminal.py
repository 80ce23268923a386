"""An emulated motor behind a pseudo-terminal: any program that opens a serial port can talk to it (Linux, macOS)."""

from __future__ import annotations

import math
import os
import select
import signal
import termios
import threading
import time
import tty
from collections import deque
from collections.abc import Callable

from calib.motor.emulator import BAUD_RATES, Emulator

TICK_S = 0.05
"""How often the server looks up without being called: the motor's own clock then acts."""
SPEEDS = {getattr(termios, f"B{baud}"): baud for baud in BAUD_RATES if hasattr(termios, f"B{baud}")}
UNKNOWN_BAUD = 300
"""What a client's speed counts as when the motor has none like it: neither end then understands the other."""


class PseudoTerminal:
    """Serves a motor in real time while its `with` block lasts; `path` is what a client opens.

    The client's speed must be the motor's, as on a cable: another one gives noise. A motor that loses its connection
    closes the terminal under its client. The motor's clock should be a real one.
    """

    def __init__(self, device: Emulator) -> None:
        self.device = device
        self.path = ""
        self._answers: deque[tuple[float, bytes]] = deque()
        self._thread: threading.Thread | None = None
        self._master = self._slave = -1

    def __enter__(self) -> PseudoTerminal:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._wake_read, self._wake_write = os.pipe()
        self._thread = threading.Thread(target=self._serve, name="emulated motor", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        os.write(self._wake_write, b"x")
        if self._thread is not None:
            self._thread.join()
        for end in (self._wake_read, self._wake_write):
            os.close(end)

    def _serve(self) -> None:
        try:
            while self.device.connected and self._wait():
                self._exchange()
        finally:
            os.close(self._slave)
            os.close(self._master)

    def _wait(self) -> bool:
        """Sleeps until bytes or an answer's time come; False when it is time to end."""
        due = self._answers[0][0] - time.monotonic() if self._answers else TICK_S
        ready, _, _ = select.select([self._master, self._wake_read], [], [], min(max(due, 0.0), TICK_S))
        return self._wake_read not in ready

    def _exchange(self) -> None:
        data = self._read()
        if data:
            reply = self.device.feed(data, SPEEDS.get(termios.tcgetattr(self._slave)[5], UNKNOWN_BAUD))
            if reply:
                self._answers.append((time.monotonic() + self.device.reply_delay_s, reply))
        else:
            _ = self.device.state
        while self._answers and self._answers[0][0] <= time.monotonic():
            self._write(self._answers.popleft()[1])

    def _read(self) -> bytes:
        try:
            return os.read(self._master, 4096)
        except BlockingIOError:
            return b""

    def _write(self, data: bytes) -> None:
        """Sends; what a client that never reads leaves no room for is lost, as on a cable."""
        try:
            os.write(self._master, data)
        except BlockingIOError:
            return


def run_emulator(motor: Emulator, report: Callable[[str], None]) -> None:
    """Serves an emulated motor on a pseudo-terminal until Ctrl-C or SIGTERM.

    The first line reported is the terminal's path alone, so that a program can read it; at the end it reports how the
    motor was left.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with PseudoTerminal(motor) as terminal:
        try:
            report(terminal.path)
            report(f"An emulated XW540-T140-R, id {motor.table['id']}, at {motor.baud} baud. Ctrl-C ends it.")
            threading.Event().wait()
        except KeyboardInterrupt:
            report("")
        state = motor.state
    turns_s = state.velocity_rad_s / (2 * math.pi)
    state_of_drive = "not driven" if motor.stopped else "STILL DRIVEN"
    report(f"Ended. The motor is {state_of_drive}, at {turns_s:.2f} turns/s, {state.temperature_c:.0f} degrees C.")
