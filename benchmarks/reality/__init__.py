"""A second simulator that is not the twin: it makes the data on which a diagnosis is checked.

It shares nothing with the twin but the robot's description. Imports `session` and that description only.
"""

from benchmarks.reality.camera import Camera, Picture, Sight
from benchmarks.reality.film import Recording
from benchmarks.reality.fluid import StripForces
from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout, Strips
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.noise import PixelNoise
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.record import Drive
from benchmarks.reality.run import STEP_S, divergence, simulate
from benchmarks.reality.tendons import Pull, Turn
from benchmarks.reality.world import Nuisances, Trial, World

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
