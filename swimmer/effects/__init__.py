"""Effects: what the plain twin leaves out, and the twin with them."""

from swimmer.effects.affected_twin import AffectedRuns, AffectedTwin
from swimmer.effects.catalogue import catalogue
from swimmer.effects.effect import Drive, Effect, Family, Parameter, Stage, StepForce, StepState
from swimmer.effects.seen import Seen, View

__all__ = [
    "AffectedRuns",
    "AffectedTwin",
    "Drive",
    "Effect",
    "Family",
    "Parameter",
    "Seen",
    "Stage",
    "StepForce",
    "StepState",
    "View",
    "catalogue",
]
