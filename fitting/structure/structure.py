"""The structure of the robot that the swims are fitted with: what of it was measured, and what had to be assumed."""

from dataclasses import dataclass, field
from typing import NamedTuple

from fitting.dry_run import CrankFit, DryTrial
from fitting.free_decay import DecayFit, HingeEstimate
from session import Flag
from session.records import KEPT_ELSEWHERE
from session.results import ResultFile
from swimmer import RobotSpec

BUILT_IN = "the built-in robot"


class Source(NamedTuple):
    """Where a number of the structure comes from.

    Attributes:
        quantity: "hinge_stiffness", "hinge_damping" or "crank_arm".
        value: in `unit`.
        unit: "N m/rad", "N m s/rad" or "m".
        se: standard error; None where the value is assumed.
        trials: it was measured in; none where it is assumed.
        sentence: value, source and, where it is assumed, why, for the reader.
    """

    quantity: str
    value: float
    unit: str
    se: float | None
    trials: tuple[str, ...]
    sentence: str

    @property
    def assumed(self) -> bool:
        """Whether it was taken over from the robot's description."""
        return not self.trials


@dataclass(frozen=True, eq=False)
class Structure:
    """What the dry experiments say about the robot, each building on the one before: hinges, then crank.

    Attributes:
        robot: as described, with what was measured in the place of what was assumed.
        decays: every free decay beside its twin, believed or not.
        hinges: of the decays that are believed; None where there is none.
        crank: of the dry runs that are believed, else of all of them, and then not used; None where there is none.
        sources: hinge stiffness, hinge damping and crank arm, in this order.
        flags: which experiments are not believed, and what is doubtful about those that are.
    """

    robot: RobotSpec = field(metadata=KEPT_ELSEWHERE)
    decays: tuple[DecayFit, ...]
    hinges: HingeEstimate | None
    crank: CrankFit | None
    sources: tuple[Source, ...]
    flags: tuple[Flag, ...] = ()


STRUCTURE = ResultFile("structure.json", Structure, named=(DryTrial,), arrays_apart=True)
"""In SI units; the dry runs as measured, and the robot's description, stand elsewhere."""
