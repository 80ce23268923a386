"""The figures of a diagnosis by name, with what to see in each."""

from diagnosis.result import DiagnosisResult
from reports.blocks import Plot
from reports.figures.gap_fish import gap_fish_figure
from reports.figures.gap_forces import gap_forces_figure
from reports.figures.gap_how_far import gap_held_out_figure, gap_waterfall_figure
from reports.figures.gap_where import gap_shares_figure
from reports.figures.gap_which import gap_effects_figure
from swimmer import RobotSpec

_CAPTIONS = {
    "gap-fish": "Red: where the gap comes from; the colour of a part gives the share of its stage in the residual. "
    "Blue: where it shows; the size of a disc gives the share of that marker, of the speed, of the course (slip and "
    "turning) or of the beat frequency.",
    "gap-shares": "The same in numbers; the bars of each panel add up to 100 %. Where several stages could cause the "
    "same residual, it is split between them: the bar is the split, the tick what the stage could explain alone; the "
    "line between covers all splits. Speed, course and frequency have neither axis nor band.",
    "gap-effects": "Posterior probability of each effect. Blue: named, which takes a probability of 0.9 that the gap "
    "looks like one of the group, and of 0.5 that one of the group is present rather than a look-alike. Several "
    "effects may be present at once, so the bars need not add up to 1.",
    "gap-waterfall": "Mean squared whitened residual of the held-out trials: of the plain twin, the part that the "
    "effects remove, the part above noise that remains, and noise.",
    "gap-held-out": "Errors of the held-out trials in mm and mm/s, forecast by the twin alone, without and with the "
    "effects. Dashed: the distance that tracking noise alone would give.",
    "gap-everything": "Each held-out trial without effects and with all of them, fitted to the fit trials alone.",
    "gap-forces": "Forces that the plain twin lacks (generalised residual forces): along and across the head, a moment "
    "on it, and a torque in every hinge. One line per trial, with a band of two standard deviations; where the band "
    "covers zero, the force is not significant.",
}


def gap_plots(found: DiagnosisResult, robot: RobotSpec, markers: tuple[str, ...]) -> dict[str, Plot]:
    """Those in which there is something to see."""
    figures = {"gap-fish": gap_fish_figure(found, robot, markers), "gap-shares": gap_shares_figure(found)}
    figures["gap-effects"] = gap_effects_figure(found)
    if found.gap.trials:
        figures["gap-waterfall"] = gap_waterfall_figure(found)
        figures["gap-held-out"] = gap_held_out_figure(found.gap, bool(found.effect_parameters))
    if found.everything is not None and found.everything.gap.evaluated_on:
        figures["gap-everything"] = gap_held_out_figure(found.everything.gap, True)
    figures["gap-forces"] = gap_forces_figure(found.missing_forces)
    return {name: Plot(figure, name, _CAPTIONS[name]) for name, figure in figures.items()}
