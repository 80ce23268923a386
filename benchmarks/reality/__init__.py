"""A second simulator that is not the twin: it makes the data on which a diagnosis is checked.

It shares nothing with the twin but the robot's description. Imports errors, files and that description only.
"""

from benchmarks.reality.film import Recording
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.run import simulate
from benchmarks.reality.world import Nuisances, Trial, World

__all__ = [
    "Mechanism",
    "Nuisances",
    "Recording",
    "Trial",
    "World",
    "simulate",
]
