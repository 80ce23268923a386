"""The figures of a diagnosis by name, with what to see in each."""

from diagnosis.result import DiagnosisResult
from reports.blocks import Plot
from reports.figures.gap_fish import gap_fish_figure
from reports.figures.gap_forces import gap_forces_figure
from reports.figures.gap_how_far import gap_held_out_figure, gap_waterfall_figure
from reports.figures.gap_where import gap_shares_figure
from reports.figures.gap_which import gap_effects_figure
from reports.missing_forces import seen
from swimmer import RobotSpec

_CAPTIONS = {
    "gap-fish": "Red: parts where the gap comes from. Blue: where it shows; the size of a disc is the share of that "
    "marker, of the speed, of the course or of the beat frequency.",
    "gap-shares": "The same in numbers. Line: all ways to split what several stages could cause; tick: what the stage "
    "could explain alone.",
    "gap-effects": "Probability of each effect. Blue: named. Several may be present at once.",
    "gap-waterfall": "Mean squared residual of the held-out trials: what the effects remove, what remains above noise, "
    "and noise.",
    "gap-held-out": "Errors of the held-out trials, forecast by the twin without and with the effects. Dashed: what "
    "tracking noise alone would give.",
    "gap-everything": "Each held-out trial without effects and with all of them, fitted to the fit trials alone.",
    "gap-forces": "Forces and torques that the plain twin lacks over a beat, a line a trial, with bands of two "
    "standard deviations.",
}


def gap_plots(found: DiagnosisResult, robot: RobotSpec, markers: tuple[str, ...]) -> dict[str, Plot]:
    """Draw the figures of a diagnosis in which there is something to see.

    Args:
        found: the diagnosis.
        robot: the robot as described.
        markers: names of the tracked markers.
    """
    figures = {"gap-fish": gap_fish_figure(found, robot, markers), "gap-shares": gap_shares_figure(found)}
    figures["gap-effects"] = gap_effects_figure(found)
    if found.gap.trials:
        figures["gap-held-out"] = gap_held_out_figure(found.gap, bool(found.effect_parameters))
        if found.effect_parameters:
            figures["gap-waterfall"] = gap_waterfall_figure(found)
    if found.everything is not None and found.everything.gap.evaluated_on:
        figures["gap-everything"] = gap_held_out_figure(found.everything.gap, True)
    if seen(found.missing_forces):
        figures["gap-forces"] = gap_forces_figure(found.missing_forces)
    return {name: Plot(figure, name, _CAPTIONS[name]) for name, figure in figures.items()}
