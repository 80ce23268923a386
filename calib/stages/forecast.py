"""``results/forecast.json``: every trial beside what the hierarchical model and simple baselines forecast of it."""

from dataclasses import replace

from calib.options import EffortName, Job
from calib.stages.fit import StructureStage
from calib.stages.recordings import Recordings
from fitting.model.robot_doubt import doubts_of
from fitting.model.session_forecast import FORECAST, SessionForecast, forecast_session
from session.stage import Stage
from swimmer import Twin

STARTS = {"quick": 2, "full": 4}
"""Of the search for the mode, by effort."""

_FORM = 3


class ForecastStage(Stage):
    """The forecasts of a session.

    Args:
        job: the work on the session.
        recordings: of the session.
        structures: of its robot.
    """

    def __init__(self, job: Job, recordings: Recordings, structures: StructureStage) -> None:
        self._job, self._recordings, self._structures = job, recordings, structures
        self.effort: EffortName = job.options.effort
        settings = {"seed": job.session.seed, "effort": self.effort, "form": _FORM}
        super().__init__(job.results / FORECAST.name, {}, settings, [recordings])

    def make(self) -> None:
        """Fits the model and writes what it forecasts.

        Raises:
            NotEnoughData: no fit trial.
            SimulationDiverged: from every start.
        """
        job, structure, trials = self._job, self._structures.current(), self._recordings.swims
        twin = Twin(structure.robot, trials[0].markers, workers=job.options.workers)
        found = forecast_session(
            trials, twin, doubts_of(structure.sources), STARTS[self.effort], job.session.seed, job.tell
        )
        written = FORECAST.write(job.results, replace(job.provenance, effort=self.effort), found)
        self.mark(written)
        job.made.extend(written)

    def read(self) -> SessionForecast:
        """What stands.

        Raises:
            InputError: there is none of this version.
        """
        return FORECAST.read(self._job.results)
