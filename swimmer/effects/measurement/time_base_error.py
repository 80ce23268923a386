"""A camera whose clock is wrong."""

import numpy as np

from swimmer.effects.effect import Drive, Effect, Parameter


class TimeBaseError(Effect):
    """A second on the camera's clock lasts longer by the share `relative`.

    The swim frequency is measured on that clock too, so a crank that no motor log tells of is slower by as much.
    """

    name = "time_base_error"
    family = "measurement"
    stage = "drive"
    physics = "Frames are further apart than their stamps say: speeds and frequencies are read too high."
    source = "A frame rate taken from the file's header or the camera's menu."
    seen_in = frozenset({"free_decay", "dry", "swim"})
    parameters = (Parameter("relative", "1", -0.4, 0.4, 0.02),)

    def clock(self, time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        """True times."""
        return np.asarray(time_s * (1 + values[0]))

    def drive(self, drive: Drive, values: np.ndarray) -> Drive:
        """As fast as the camera's clock makes a measured frequency."""
        if drive.turn is not None:
            return drive
        return drive._replace(frequency_hz=float(drive.frequency_hz / (1 + values[0])))

    def measured_hz(self, turned_hz: float, values: np.ndarray) -> float:
        """As the camera's clock tells it."""
        return float(turned_hz * (1 + values[0]))


EFFECT = TimeBaseError()
