"""Data of a diagnosis: the trials of a session, and the twin with its recommended coefficients."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from diagnosis.discrepancy import Discrepancy
from diagnosis.linear_model import LinearModel
from fitting.free_decay import DecayTrial, Ring, fit_decay
from fitting.free_decay.hinges import fault_of_decay
from fitting.signatures.affected_session import with_picture
from fitting.trial import NOTHING, ExperimentsInAir, MeasuredTrial
from session import CameraSpec, NotEnoughData
from session.errors import SimulationDiverged
from swimmer import Twin


@dataclass(frozen=True, eq=False)
class SessionData:
    """The recordings of a session, and what was known before.

    The crank of a trial with a motor log turns as it was logged, as in the fit: a fault of the drive shows in how fast
    it turned, against the command.

    Attributes:
        trials: all swims; those of the role "fit" determine the effect, the others score it.
        twin: the plain twin, of the robot as described.
        camera: the camera that filmed them.
        discrepancy: discrepancy of a refitted twin where nothing is wrong.
        at: (5,) the recommended coefficients of the session, fitted to the same swims.
        dry: measurements out of the water, which also determine the effect.
        doubted: names of fitted swims that their own twin does not follow; with these no effect is named.
    """

    trials: Sequence[MeasuredTrial]
    twin: Twin
    camera: CameraSpec
    discrepancy: Discrepancy
    at: np.ndarray
    dry: ExperimentsInAir = NOTHING
    doubted: tuple[str, ...] = ()

    def of_role(self, fitted: bool) -> tuple[MeasuredTrial, ...]:
        """Return the swims that are fitted, or those that are not."""
        return tuple(trial for trial in self.trials if (trial.role == "fit") == fitted)

    @cached_property
    def rings(self) -> "FreeDecayFits":
        """Fits of the free decays."""
        return free_decay_fits(self.dry.decays, self.twin)

    @property
    def linear(self) -> LinearModel:
        """Linearised model of the fitted trials.

        Raises:
            NotEnoughData: there is none.
            SimulationDiverged: the twin diverged at these coefficients.
        """
        if not (fitted := self.of_role(fitted=True)):
            raise NotEnoughData('no swim of role "fit"; a diagnosis needs at least one')
        runs = self.dry.runs
        camera = with_picture(self.camera, (*fitted, *self.of_role(fitted=False), *runs))
        return LinearModel.of(fitted, self.twin, camera, self.discrepancy, self.at, runs, self.rings.believed)


class FreeDecayFits(NamedTuple):
    """Free decays of a session: fits of those that are believed, and by name why others are left out."""

    believed: tuple[Ring, ...]
    left_out: Mapping[str, str]


def free_decay_fits(decays: Sequence[DecayTrial], twin: Twin) -> FreeDecayFits:
    """Fit the free decays, and leave out those whose fit must not be believed (`fault_of_decay`)."""
    believed, left_out = [], {}
    for trial in decays:
        try:
            fit = fit_decay(trial, twin.robot, workers=twin.workers)
            doubt, ring = fault_of_decay(fit), Ring.of(trial, fit, twin.robot)
            if doubt is None and not np.isfinite(ring.of_twin(twin)).all():
                doubt = "a twin with the fitted hinges does not stand"
        except SimulationDiverged as problem:
            doubt = str(problem)
        if doubt is None:
            believed.append(ring)
        else:
            left_out[trial.name] = doubt
    return FreeDecayFits(tuple(believed), left_out)
