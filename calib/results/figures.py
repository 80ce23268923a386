"""The figures of the report as methods of a result: ``fit.plot.envelope("f1_00")``."""

from collections.abc import Callable, Mapping
from functools import cached_property

from reports.blocks import Plot
from session import InputError
from session.errors import Fault
from session.stage import Stage


def check_current(stage: Stage) -> None:
    """Raise an `InputError` where the files are no longer those that a result was read from."""
    if not stage.is_current:
        step = "Ask for the result again, then for what you want of it."
        raise InputError([Fault(str(stage.file), "", "the result has been replaced", "", "", next_step=step)])


class Figures:
    """Some figures of the report; each is drawn on first use, and shows itself in a notebook.

    `names` lists them. A figure has a matplotlib `figure` that may be changed and saved, and a `caption`.
    """

    def __init__(self, stage: Stage, draw: Callable[[], Mapping[str, Plot]]) -> None:
        self._stage, self._draw = stage, draw

    @cached_property
    def _plots(self) -> dict[str, Plot]:
        check_current(self._stage)
        return dict(self._draw())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the available figures; one that begins with the name of a trial is called with that trial."""
        return tuple(self._plots)

    def __getitem__(self, name: str) -> Plot:
        """Return the figure of this name; an `InputError` lists the choices where there is none."""
        if name not in self._plots:
            raise InputError([Fault("figure", "", "no such figure", repr(name), "one of this result", self.names)])
        return self._plots[name]


def _figure(name: str, about: str) -> Callable[[Figures], Plot]:
    def fetch(self: Figures) -> Plot:
        return self[name]

    fetch.__doc__ = about
    return fetch


def _trial_figure(name: str, about: str) -> Callable[[Figures, str], Plot]:
    def fetch(self: Figures, trial: str) -> Plot:
        return self[f"{trial}-{name}"]

    fetch.__doc__ = about
    return fetch


def _numbered_figure(name: str, about: str) -> Callable[..., Plot]:
    def fetch(self: Figures, number: int = 1) -> Plot:
        return self[f"{name}-{number}"]

    fetch.__doc__ = about
    return fetch


_MOTIONS = ("envelope", "path", "lateral")
"""Figures of a trial that need no other trial."""


class StructureFigures(Figures):
    """Figures of the robot and of its dry experiments; a fit has them, too."""

    robot = _figure("robot", "The robot with its markers, hinges and tendons.")
    decay = _numbered_figure("decay", "A free decay, measured and fitted.")
    decay_spectrum = _numbered_figure("decay-spectrum", "The spectrum of a free decay.")
    crank = _figure("crank-surface", "The error surface of the crank grid search.")
    motor_speed = _figure("motor-speed", "How fast the motor turned in logged trials.")
    motor_turn = _figure("motor-turn", "How unevenly the motor turned within a turn.")


class FitFigures(StructureFigures):
    """Figures of a fit; those of a trial are drawn without measuring any other."""

    def __init__(
        self,
        stage: Stage,
        draw: Callable[[], Mapping[str, Plot]],
        draw_trial: Callable[[str], Mapping[str, Plot]] = lambda _trial: {},
    ) -> None:
        super().__init__(stage, draw)
        self._draw_trial, self._of_trials = draw_trial, dict[str, Plot]()

    def __getitem__(self, name: str) -> Plot:
        """Return the figure of this name; an `InputError` lists the choices where there is none."""
        trial, _, what = name.rpartition("-")
        if what in _MOTIONS and "_plots" not in vars(self):
            if name not in self._of_trials:
                check_current(self._stage)
                self._of_trials.update(self._draw_trial(trial))
            if name in self._of_trials:
                return self._of_trials[name]
        return super().__getitem__(name)

    envelope = _trial_figure("envelope", "The tail's envelope in the frame of the head, measured and simulated.")
    path = _trial_figure("path", "The distance swum in a trial over time, measured and simulated.")
    lateral = _trial_figure(
        "lateral", "The lateral motion of tail markers in a trial over time, measured and simulated."
    )
    flagged = _trial_figure("flags", "The samples of a trial that are flagged, over time.")
    speeds = _figure("sweep", "Speed over frequency: measured, of the twin, by elongated body theory and simple rules.")
    residual_markers = _figure("residual-markers", "Distance between measured and simulated markers, by marker.")
    body_wave = _figure("body-wave", "Amplitude and phase of the wave along the fish, measured and simulated.")
    forecasts = _figure("forecast-speeds", "Speeds of held-out trials, measured and forecast.")
    hull_roll = _figure("hull-roll", "The neck's sideways sway over frequency: measured, and with and without a roll.")
    coefficients = _figure("coefficient-values", "The coefficients with their intervals, and where every start ended.")


class PosteriorFigures(Figures):
    """Figures of a posterior."""

    intervals = _figure("posterior-intervals", "The 90 % interval of every coefficient and its prior.")
    corner = _figure("posterior-corner", "The joint posterior of every pair of coefficients.")
    speeds = _figure("sweep", "Speed over frequency with its predictive band.")
    trials = _figure("posterior-trials", "The speed of every trial with its predictive interval.")
    further_trial = _figure("posterior-further-plot", "Expected information of one more trial, over its frequency.")
    whiteness = _figure("posterior-whiteness", "Autocorrelation of the residuals of every trial.")
    trace = _figure("posterior-trace", "The chains over their draws.")
    ranks = _figure("posterior-ranks", "Rank histograms of the chains.")


class GapFigures(Figures):
    """Figures of a diagnosis."""

    fish = _figure("gap-fish", "Where the gap comes from and where it shows, drawn on the robot.")
    where = _figure("gap-shares", "Shares of the gap by stage, trial, marker, axis and band.")
    effects = _figure("gap-effects", "The probability of every effect.")
    waterfall = _figure("gap-waterfall", "What of the held-out gap the effects remove, and what they leave.")
    held_out = _figure("gap-held-out", "Marker and speed errors of held-out trials without and with the effects.")
    all_effects = _figure("gap-everything", "The same with all effects at once.")
    forces = _figure("gap-forces", "The forces and torques that the plain twin lacks, over a turn of the crank.")
