"""The figures of the report as methods of a calibration, for notebooks: each shows itself as the value of a cell."""

from dataclasses import dataclass, field

from matplotlib.figure import Figure

from fitting import (
    CalibratedTrial,
    Calibration,
    Comparison,
    Evidence,
    MeasuredTrial,
    PairFit,
    SearchRun,
    body_wave,
    speed_errors,
)
from reports.figures import (
    body_wave_figure,
    coefficient_profiles_figure,
    coefficients_figure,
    convergence_figure,
    flagged_samples_figure,
    forward_path_figure,
    lateral_motion_figure,
    marker_residuals_figure,
    mean_shapes_figure,
    pair_coefficients_figure,
    pair_errors_figure,
    phase_portrait_figure,
    planform_figure,
    residuals_over_time_figure,
    search_convergence_figure,
    speed_errors_figure,
    speed_intervals_figure,
    speed_sweep_figure,
    tail_envelope_figure,
)
from reports.figures.search_convergence import SHORT
from reports.figures.speed_intervals import Measure
from reports.png import png_of

DOTS_PER_INCH = 110.0


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure that a notebook shows without any set-up.

    Attributes:
        figure: to be changed or saved with matplotlib.
        says: what it shows, for those who cannot see it.
    """

    figure: Figure = field(repr=False)
    says: str

    def _repr_png_(self) -> bytes:
        """On the light ground that it was drawn for, whatever the notebook's own."""
        return png_of(self.figure, DOTS_PER_INCH)


def picture_of_tracks(trial: MeasuredTrial) -> Picture:
    """Which samples of a measured trial are flagged; needs no fit."""
    return Picture(flagged_samples_figure(trial), f"{trial.name}: flagged samples of each marker over time")


@dataclass(frozen=True, eq=False)
class Gallery:
    """The figures of one calibration; those of a trial take its name.

    Attributes:
        calibration: the calibrated twin beside every trial.
        evidence: what stands beside the fit; `profiles`, `mean_shapes`, `pair_errors` and `pair_coefficients` need it.
        searches: the searches compared; `searches_compared` needs them.
    """

    calibration: Calibration
    evidence: Evidence | None = None
    searches: tuple[SearchRun, ...] = ()

    def trial(self, name: str) -> CalibratedTrial:
        """One trial of the calibration.

        Raises:
            ValueError: there is none of that name.
        """
        trials = {trial.measured.name: trial for trial in self.calibration.trials}
        if name not in trials:
            raise ValueError(f"trial: found {name!r}, expected one of {', '.join(trials)}")
        return trials[name]

    def robot(self) -> Picture:
        """The robot from above, with the markers that were tracked."""
        robot, markers = self.calibration.robot, self.calibration.trials[0].measured.markers
        return Picture(planform_figure(robot, markers), f"{robot.name} from above, with its markers")

    def sweep(self) -> Picture:
        """Speed over frequency: measured, twin, elongated body theory."""
        return Picture(speed_sweep_figure(self.calibration), "forward speed over swim frequency")

    def speed_errors(self) -> Picture:
        """Predicted minus measured speed, a row a trial."""
        return Picture(speed_errors_figure(self.calibration), "predicted minus measured speed of each trial")

    def coefficients(self) -> Picture:
        """Where the restarts of the search ended, between the bounds."""
        return Picture(coefficients_figure(self.calibration.fit), "the five coefficients between their bounds")

    def convergence(self) -> Picture:
        """How each restart of the search came down."""
        return Picture(convergence_figure(self.calibration.fit), "mean marker distance over the search")

    def profiles(self) -> Picture:
        """How the objective rises along each coefficient.

        Raises:
            ValueError: the gallery has no evidence.
        """
        figure = coefficient_profiles_figure(self._evidence().profiles, self.calibration.coefficients)
        return Picture(figure, "mean marker distance along each coefficient")

    def mean_shapes(self) -> Picture:
        """Mean places of the markers in each trial: measured, the twin's, and with boxes put right.

        Raises:
            ValueError: the gallery has no evidence.
        """
        figure = mean_shapes_figure(self.calibration.trials, self._evidence().placed)
        return Picture(figure, "mean places of the markers in each trial")

    def speed_intervals(self, measure: Measure = "mean_absolute") -> Picture:
        """Mean absolute error, bias or worst error of each model's speed, with intervals."""
        trials = self.calibration.trials
        of_role = {role: speed_errors([t for t in trials if t.measured.role == role]) for role in ("fit", "holdout")}
        figure = speed_intervals_figure({role: errors for role, errors in of_role.items() if errors}, measure)
        return Picture(figure, f"{measure.replace('_', ' ')} of each model's speed, with 90 % intervals")

    def pair_errors(self) -> Picture:
        """Speed error of each model over other pairs of fit trials.

        Raises:
            ValueError: the gallery has no evidence, or this no pairs.
        """
        own = frozenset(t.measured.name for t in self.calibration.trials if t.measured.role == "fit")
        return Picture(pair_errors_figure(self._pairs(), own), "speed error of each model for each pair of fit trials")

    def pair_coefficients(self) -> Picture:
        """The coefficients that other pairs of fit trials give.

        Raises:
            ValueError: the gallery has no evidence, or this no pairs.
        """
        figure = pair_coefficients_figure(self._pairs(), self.calibration.coefficients)
        return Picture(figure, "coefficients of each pair of fit trials")

    def searches_compared(self, objective: Comparison = "published") -> Picture:
        """How fast each search found good coefficients.

        Raises:
            ValueError: the gallery has no searches.
        """
        runs = [run for run in self.searches if run.comparison == objective]
        if not runs:
            expected = "those of calib benchmark search SESSION: Gallery(calibration, evidence, searches)"
            raise ValueError(f"searches: found none on the {objective} objective, expected {expected}")
        methods = dict.fromkeys(run.method for run in runs)
        traces = {name: [(run.trace, run.simulated_s) for run in runs if run.method == name] for name in methods}
        figure = search_convergence_figure(traces, SHORT)
        return Picture(figure, f"convergence of each search, {objective} objective")

    def _evidence(self) -> Evidence:
        if self.evidence is None:
            raise ValueError("evidence: found none, expected that of the fit: Gallery(calibration, evidence)")
        return self.evidence

    def _pairs(self) -> tuple[PairFit, ...]:
        if not self._evidence().pairs:
            raise ValueError("pairs: found none, expected at least three swims and evidence of full effort")
        return self._evidence().pairs

    def marker_residuals(self) -> Picture:
        """Mean distance of each marker, a panel a trial."""
        return Picture(marker_residuals_figure(self.calibration.trials), "mean distance of each marker in each trial")

    def residuals_over_time(self) -> Picture:
        """Mean distance from frame to frame, a row a trial."""
        return Picture(residuals_over_time_figure(self.calibration.trials), "mean distance over time in each trial")

    def phase_portrait(self) -> Picture:
        """Lateral place and speed of the last marker, a panel a trial."""
        figure = phase_portrait_figure(self.calibration.trials, self.calibration.robot)
        return Picture(figure, "lateral place and speed of the last marker in each trial")

    def body_wave(self) -> Picture:
        """Amplitude and phase lag along the tail, a polar panel a trial."""
        trials = self.calibration.trials
        waves = [tuple(body_wave(t.measured, head) for head in (t.measured.head, t.simulated)) for t in trials]
        figure = body_wave_figure([trial.measured.name for trial in trials], [(one, two) for one, two in waves])
        return Picture(figure, "amplitude and phase lag along the tail in each trial")

    def tracks(self, trial: str) -> Picture:
        """Which samples of a trial are flagged."""
        return picture_of_tracks(self.trial(trial).measured)

    def envelope(self, trial: str) -> Picture:
        """Midlines through one beat, measured and simulated."""
        figure = tail_envelope_figure(self.trial(trial), self.calibration.robot)
        return Picture(figure, f"{trial}: midlines through one beat, measured and simulated")

    def lateral_motion(self, trial: str) -> Picture:
        """Lateral motion of the tail's markers over time, measured and simulated."""
        figure = lateral_motion_figure(self.trial(trial), self.calibration.robot)
        return Picture(figure, f"{trial}: lateral motion over time, measured and simulated")

    def path(self, trial: str) -> Picture:
        """Distance swum over time, measured and simulated."""
        return Picture(forward_path_figure(self.trial(trial)), f"{trial}: distance swum, measured and simulated")
