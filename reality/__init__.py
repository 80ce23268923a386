"""A second simulator that is not the twin: it makes the data on which a diagnosis is checked.

It shares nothing with the twin but the robot's description. Imports `session` and that description only.
"""

from reality.camera import Camera, Picture, Sight
from reality.film import Recording
from reality.fluid import StripForces
from reality.instant import Instant
from reality.layout import Layout, Strips
from reality.mechanism import Mechanism
from reality.noise import PixelNoise
from reality.parameters import Parameters
from reality.record import Drive
from reality.run import STEP_S, divergence, simulate
from reality.tendons import Pull, Turn
from reality.world import Nuisances, Trial, World

__all__ = [
    "STEP_S",
    "Camera",
    "Drive",
    "Instant",
    "Layout",
    "Mechanism",
    "Nuisances",
    "Parameters",
    "Picture",
    "PixelNoise",
    "Pull",
    "Recording",
    "Sight",
    "StripForces",
    "Strips",
    "Trial",
    "Turn",
    "World",
    "divergence",
    "simulate",
]
