"""An emulated motor to try programs on: prints where it is, serves until it is told to stop."""

from __future__ import annotations

import math
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from calib.motor.emulator import Emulator


def run_emulator(
    id: int = 1,  # noqa: A002
    baud: int = 1_000_000,
    load_nm: float = 0.0,
    seed: int = 0,
    tell: Callable[[str], None] = print,
    until: threading.Event | None = None,
) -> None:
    """Serves an emulated XW540-T140-R on a pseudo-terminal until Ctrl-C or SIGTERM (or until the event is set).

    `load_nm` is friction on its shaft. The first line told is the terminal's path alone, so that a program can read
    it; at the end it tells how the motor was left.

    Raises:
        ValueError: for an id or a baud rate the motor does not have.
        OSError: on a system without pseudo-terminals.
    """
    try:
        from calib.motor.pseudo_terminal import PseudoTerminal
    except ImportError as error:
        raise OSError("the emulator needs pseudo-terminals, which this system does not have: use Linux") from error

    motor = Emulator(id=id, load=load_nm, seed=seed, baud=baud)
    with PseudoTerminal(motor) as terminal, _sigterm_as_ctrl_c():
        try:
            tell(terminal.path)
            tell(f"An emulated XW540-T140-R, id {id}, at {baud} baud. Ctrl-C ends it.")
            (until or threading.Event()).wait()
        except KeyboardInterrupt:
            tell("")
        state = motor.state
    turns_s = state.velocity_rad_s / (2 * math.pi)
    left = "not driven" if motor.stopped else "STILL DRIVEN"
    tell(f"Ended. The motor is {left}, at {turns_s:.2f} turns/s, {state.temperature_c:.0f} degrees C.")


@contextmanager
def _sigterm_as_ctrl_c() -> Iterator[None]:
    """Lets SIGTERM end the block as Ctrl-C does; outside the main thread, which alone gets signals, as before."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
