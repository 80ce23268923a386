"""A camera near enough that markers at different heights are drawn at different scales."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.camera import Sight
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from swimmer.robot import load_robot

_TRIM_RAD, _GLUED_M = 0.01, 0.003


@dataclass(frozen=True)
class CameraParallax(Mechanism):
    """Markers stand at their heights above the plane of the scale, times `nearness`; the pinhole does the rest.

    Heights n times as large under a camera of height H are seen exactly as the true ones are from H / n, at the same
    scale.

    Attributes:
        nearness: of the camera; 1 is one at the height that the scale was made for.
        height_m: by name of marker, above the nose.
    """

    nearness: float
    height_m: tuple[tuple[str, float], ...]

    def place(self, sight: Sight) -> Sight:
        """Up or down, nowhere else."""
        height = dict(self.height_m)
        own = np.array([height.get(name, 0.0) for name in sight.names])
        return replace(sight, height_m=sight.height_m + self.nearness * own)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws how the fish is trimmed in pitch, and how far each marker is from its published height.

    The nearness saturates at 10, as from 0.25 m above the fish instead of 2.5 m.
    """
    markers = load_robot().markers
    nose = markers["nose"].position_m
    trim = _TRIM_RAD * random.standard_normal()
    height = tuple(
        (
            name,
            float(
                its.position_m[2] - nose[2] + trim * (its.position_m[0] - nose[0]) + _GLUED_M * random.standard_normal()
            ),
        )
        for name, its in markers.items()
    )

    def at(strength: float) -> tuple[Mechanism, ...]:
        return (CameraParallax(float(10 * np.tanh(strength / 10)), height),) if strength else ()

    return at
