"""An emulator of the robot's motor, a DYNAMIXEL XW540-T140-R, for trying `calib capture` without one.

It speaks Protocol 2.0 byte for byte, from the manuals and without ROBOTIS' SDK; it needs the standard library only.
"""

from calib.motor.emulator import Emulator

__all__ = ["Emulator"]
