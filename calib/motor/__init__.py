"""An emulator of the robot's motor, a DYNAMIXEL XW540-T140-R, for trying `calib capture` without one.

It speaks Protocol 2.0 byte for byte, from the manuals and without ROBOTIS' SDK; it needs the standard library only.

    motor = Emulator(clock=VirtualClock())
    port = VirtualPort(motor)             # in place of dynamixel_sdk.PortHandler, in virtual time
    with PseudoTerminal(Emulator()) as terminal:
        ...                               # any program opens terminal.path, in real time
"""

from typing import TYPE_CHECKING, Any

from calib.motor.control_table import ControlTable
from calib.motor.emulator import Emulator
from calib.motor.motor_physics import MotorConstants
from calib.motor.serve import run_emulator
from calib.motor.servo import HardwareError, MotorState
from calib.motor.virtual_port import VirtualClock, VirtualPort

if TYPE_CHECKING:
    from calib.motor.pseudo_terminal import PseudoTerminal

__all__ = [
    "ControlTable",
    "Emulator",
    "HardwareError",
    "MotorConstants",
    "MotorState",
    "PseudoTerminal",
    "VirtualClock",
    "VirtualPort",
    "run_emulator",
]


def __getattr__(name: str) -> Any:
    """`PseudoTerminal` is loaded when asked for: some systems have no such terminals."""
    if name != "PseudoTerminal":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from calib.motor.pseudo_terminal import PseudoTerminal

    return PseudoTerminal
