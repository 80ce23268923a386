"""Free decays -> hinges -> dry runs -> crank: the structure that the swims are fitted with, and where it comes from."""

from fitting.structure.identify import DryExperiments, identify_structure
from fitting.structure.sources import assumed
from fitting.structure.structure import BUILT_IN, Source, Structure
from fitting.structure.structure_file import read_structure, structure_payload

__all__ = [
    "BUILT_IN",
    "DryExperiments",
    "Source",
    "Structure",
    "assumed",
    "identify_structure",
    "read_structure",
    "structure_payload",
]
