"""Free decays -> hinges -> dry runs -> crank: the structure that the swims are fitted with, and where it comes from."""

from fitting.structure.identify import DryExperiments, identify_structure
from fitting.structure.sources import BUILT_IN, STRUCTURE, Source, Structure, assumed, read_structure

__all__ = [
    "BUILT_IN",
    "STRUCTURE",
    "DryExperiments",
    "Source",
    "Structure",
    "assumed",
    "identify_structure",
    "read_structure",
]
