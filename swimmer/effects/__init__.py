"""Effects: what the plain twin leaves out, and the twin with them."""

from swimmer.effects.affected_twin import AffectedRuns, AffectedTwin
from swimmer.effects.catalogue import catalogue
from swimmer.effects.effect import Effect, Parameter, StepForce, StepState, View

__all__ = [
    "AffectedRuns",
    "AffectedTwin",
    "Effect",
    "Parameter",
    "StepForce",
    "StepState",
    "View",
    "catalogue",
]
