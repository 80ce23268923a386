"""An emulated motor behind a pseudo-terminal: any program that opens a serial port can talk to it (Linux, macOS)."""

import os
import select
import signal
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from calib.motor.emulator import Emulator

TICK_S = 0.05
"""Time after which the server lets the motor's own clock act, even if no bytes came."""


@contextmanager
def pseudo_terminal(motor: Emulator, baud: int) -> Iterator[str]:
    """Serve a motor in real time while its `with` block lasts, or until it is no longer `connected`.

    Yields the path that a client opens. A motor hears nothing at another speed than `baud`.
    """
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    server = threading.Thread(target=_serve, args=(motor, baud, master, slave), name="emulated motor", daemon=True)
    server.start()
    try:
        yield os.ttyname(slave)
    finally:
        motor.connected = False
        server.join()


def _serve(motor: Emulator, baud: int, master: int, slave: int) -> None:
    speed = getattr(termios, f"B{baud}", baud)
    while motor.connected:
        ready, _, _ = select.select([master], [], [], TICK_S)
        data = os.read(master, 4096) if ready else b""
        reply = motor.feed(data if termios.tcgetattr(slave)[5] == speed else b"")
        if reply:
            time.sleep(motor.reply_delay_s)
            with suppress(BlockingIOError):  # answers to a client that never reads are lost
                os.write(master, reply)
    os.close(slave)
    os.close(master)


def run_emulator(motor: Emulator, baud: int, report: Callable[[str], None]) -> None:
    """Serve an emulated motor on a pseudo-terminal until Ctrl-C or SIGTERM.

    The first line reported is the terminal's path alone, so that a program can read it; at the end it reports how the
    motor was left.

    Args:
        motor: the emulated motor.
        baud: the only baud rate at which it hears anything.
        report: receives lines for the user.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with pseudo_terminal(motor, baud) as path:
        try:
            report(path)
            report(f"An emulated XW540-T140-R, id {motor.id}, at {baud} baud. Ctrl-C ends it.")
            threading.Event().wait()
        except KeyboardInterrupt:
            report("")
    report(f"Ended. The motor is {'not driven' if motor.stopped else 'STILL DRIVEN'}.")
