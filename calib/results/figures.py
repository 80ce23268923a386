"""The figures of the report as methods of a result: ``fit.plot.envelope("f1_00")``."""

from collections.abc import Callable, Mapping
from functools import cached_property

from reports.blocks import Plot
from session import FaultCollector


class Figures:
    """Some figures of the report; each is drawn when it is first asked for, and shows itself in a notebook.

    `names` tells all that there are. A figure has a matplotlib `figure` that may be changed and saved, and a `caption`.

    Args:
        draw: all of them, by the name they have in the report.
    """

    def __init__(self, draw: Callable[[], Mapping[str, Plot]]) -> None:
        self._draw = draw

    @cached_property
    def _plots(self) -> dict[str, Plot]:
        return dict(self._draw())

    @property
    def names(self) -> tuple[str, ...]:
        """Those that there are; what begins with the name of a trial is asked for with that trial."""
        return tuple(self._plots)

    def __getitem__(self, name: str) -> Plot:
        """The figure of this name.

        Raises:
            InputError: there is none; the error lists the choices.
        """
        if name not in self._plots:
            faults = FaultCollector("figure")
            faults.add("", "no such figure", found=repr(name), expected="one of this result", choices=self.names)
            faults.raise_if_any()
        return self._plots[name]


class FitFigures(Figures):
    """Figures of a fit."""

    def robot(self) -> Plot:
        """The robot with its markers, hinges and tendons."""
        return self["robot"]

    def envelope(self, trial: str) -> Plot:
        """The tail's envelope in a trial, measured and simulated, in the frame of the head."""
        return self[f"{trial}-envelope"]

    def path(self, trial: str) -> Plot:
        """The distance swum in a trial over time, measured and simulated."""
        return self[f"{trial}-path"]

    def lateral(self, trial: str) -> Plot:
        """The lateral motion of tail markers in a trial over time, measured and simulated."""
        return self[f"{trial}-lateral"]

    def flagged(self, trial: str) -> Plot:
        """The samples of a trial that are flagged, over time."""
        return self[f"{trial}-flags"]

    def speeds(self) -> Plot:
        """Speed over frequency: measured, of the twin and by elongated body theory."""
        return self["sweep"]

    def speed_errors(self) -> Plot:
        """Speed errors of the twin and of elongated body theory, by trial."""
        return self["speed-errors"]

    def speed_error_size(self) -> Plot:
        """Mean absolute speed error of every model with its 90 % interval."""
        return self["speed-error-size"]

    def speed_error_bias(self) -> Plot:
        """Mean signed speed error of every model with its 90 % interval."""
        return self["speed-error-bias"]

    def residual_markers(self) -> Plot:
        """Distance between measured and simulated markers, by marker."""
        return self["residual-markers"]

    def residual_time(self) -> Plot:
        """Distance between measured and simulated markers, over time."""
        return self["residual-time"]

    def phase_portrait(self) -> Plot:
        """Angle and angular rate of the tail, measured and simulated."""
        return self["phase-portrait"]

    def body_wave(self) -> Plot:
        """Amplitude and phase of the wave along the fish, measured and simulated."""
        return self["body-wave"]

    def coefficients(self) -> Plot:
        """Where every restart of the search ended."""
        return self["coefficient-values"]

    def profiles(self) -> Plot:
        """How the objective rises as one coefficient is moved and the others are fitted again."""
        return self["coefficient-profiles"]

    def trace(self) -> Plot:
        """The course of the search."""
        return self["trace"]

    def convergence(self) -> Plot:
        """The objective over the number of simulations."""
        return self["convergence"]

    def mean_shapes(self) -> Plot:
        """The mean shape of the fish in each trial, as measured and with corrected boxes."""
        return self["mean-shapes"]

    def pair_errors(self) -> Plot:
        """Forecast errors of fits to every other pair of trials."""
        return self["pair-errors"]

    def pair_coefficients(self) -> Plot:
        """Coefficients fitted to every other pair of trials."""
        return self["pair-coefficients"]

    def decay(self, number: int = 1) -> Plot:
        """A free decay, measured and fitted."""
        return self[f"decay-{number}"]

    def decay_spectrum(self, number: int = 1) -> Plot:
        """The spectrum of a free decay."""
        return self[f"decay-spectrum-{number}"]

    def crank(self) -> Plot:
        """The error surface of the crank grid search."""
        return self["crank-surface"]

    def motor_speed(self) -> Plot:
        """How fast the motor turned in logged trials."""
        return self["motor-speed"]

    def motor_turn(self) -> Plot:
        """How unevenly the motor turned within a turn."""
        return self["motor-turn"]


class PosteriorFigures(Figures):
    """Figures of a posterior."""

    def intervals(self) -> Plot:
        """The 90 % interval of every coefficient beside its prior."""
        return self["posterior-intervals"]

    def corner(self) -> Plot:
        """The joint posterior of every pair of coefficients."""
        return self["posterior-corner"]

    def speeds(self) -> Plot:
        """Speed over frequency with its predictive band."""
        return self["posterior-sweep"]

    def trials(self) -> Plot:
        """The speed of every trial with its predictive interval."""
        return self["posterior-trials"]

    def further_trial(self) -> Plot:
        """What one more trial would tell, over its frequency."""
        return self["posterior-further-plot"]

    def left_out(self) -> Plot:
        """Effects that the trials ask for and the twin leaves out."""
        return self["posterior-left-out-plot"]

    def whiteness(self) -> Plot:
        """Autocorrelation of the residuals of every trial."""
        return self["posterior-whiteness"]

    def trace(self) -> Plot:
        """The chains over their draws."""
        return self["posterior-trace"]

    def ranks(self) -> Plot:
        """Rank histograms of the chains."""
        return self["posterior-ranks"]


class GapFigures(Figures):
    """Figures of a diagnosis."""

    def fish(self) -> Plot:
        """Where the gap comes from and where it shows, drawn on the robot."""
        return self["gap-fish"]

    def where(self) -> Plot:
        """Shares of the gap by stage, trial, marker, axis and band."""
        return self["gap-shares"]

    def marker_drift(self) -> Plot:
        """How fast each marker slides forward along the fish."""
        return self["gap-slides"]

    def effects(self) -> Plot:
        """The probability of every effect."""
        return self["gap-effects"]

    def separation(self) -> Plot:
        """How well these trials tell each pair of effects apart."""
        return self["gap-separation"]

    def waterfall(self) -> Plot:
        """What of the held-out gap the effects remove, and what they leave."""
        return self["gap-waterfall"]

    def held_out(self) -> Plot:
        """Marker and speed errors of held-out trials without and with the effects."""
        return self["gap-held-out"]

    def all_effects(self) -> Plot:
        """The same with all effects at once."""
        return self["gap-everything"]

    def forces(self) -> Plot:
        """The forces and torques that the plain twin lacks, over a turn of the crank."""
        return self["gap-forces"]
