"""A lens that is not rectilinear."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.camera import Picture
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_TYPICAL, _MOST = 0.03, 0.25


@dataclass(frozen=True)
class LensDistortion(Mechanism):
    """A radius r about the lens's own centre is drawn at r (1 + k1 r^2 + k2 r^4); r = 1 at the picture's lower edge.

    Brown (1966), Photogrammetric Engineering 32: two radial terms, and a centre that is not the picture's.

    Attributes:
        k1, k2: coefficients.
        right_px, down_px: from the picture's middle to the centre of distortion.
    """

    k1: float
    k2: float
    right_px: float
    down_px: float

    def picture(self, picture: Picture) -> Picture:
        """Each position along its radius."""
        centre = picture.camera.centre_px + np.array([self.right_px, self.down_px])
        off = picture.position_px - centre
        square = (off**2).sum(axis=-1, keepdims=True) / (picture.camera.height_px / 2) ** 2
        return replace(picture, position_px=picture.position_px + off * square * (self.k1 + self.k2 * square))


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws barrel or cushion, how much of it the second term takes back, and the centre.

    Saturates at k1 = 0.25, where a barrel would begin to fold the picture's corners over.
    """
    sign, back = random.choice([-1.0, 1.0]), random.uniform(0.05, 0.1)
    right, down = 8.0 * random.standard_normal(2)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        k1 = float(sign * _MOST * np.tanh(_TYPICAL / _MOST * strength))
        return (LensDistortion(k1, float(-back * k1), float(right), float(down)),)

    return at
