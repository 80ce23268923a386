"""Free decays -> hinges -> dry runs -> crank: the structure that the swims are fitted with, and where it comes from."""

from fitting.structure.sources import assumed
from fitting.structure.structure import BUILT_IN, Source, Structure

__all__ = ["BUILT_IN", "Source", "Structure", "assumed"]
