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
    "gap-fish": "Red is where the gap comes from: each part is as full of colour as its stage has of what the nearest "
    "twin leaves. Blue is where it shows: each disc is as large as the share of that marker, of the speed, of the "
    "course (slip and turning) or of the beat’s frequency.",
    "gap-shares": "The same by numbers; the bars of each panel add up to 100 %. By stage, stages that can do alike "
    "share what they could both do: the tick is what each would take if it were alone, and the truth may lie anywhere "
    "along the line. Speed, course and frequency have neither axis nor band.",
    "gap-effects": "How likely each effect is, once these swims are seen. Blue are those that are named: the gap has "
    "to look like one of a group with 0.9, and one of the group to be likelier there than not, for it may be something "
    "that only looks like it. Several may be present at once, so the bars need not add up to 1.",
    "gap-waterfall": "Mean squared residual of the held-out swims in units of what disturbs them: what the plain twin "
    "leaves, what adding the effects takes away, what is left above noise, and noise itself.",
    "gap-held-out": "The same swims in millimetres and mm/s, run ahead by the twin alone, before and after. The dashed "
    "line is the distance that tracking noise alone would make.",
    "gap-everything": "Each held-out swim without effects and with all of them, fitted to the fitted swims alone.",
    "gap-forces": "What would have to act on the plain twin, beside all that it has, for it to swim like the robot: "
    "along and across the head, a moment on it, and a torque in every hinge. A line a swim, with two standard "
    "deviations; where the band covers zero, nothing is called for.",
}


def gap_plots(found: DiagnosisResult, robot: RobotSpec, markers: tuple[str, ...]) -> dict[str, Plot]:
    """Those in which there is something to see.

    Args:
        found: the diagnosis.
        robot: that swam.
        markers: that were tracked.
    """
    figures = {"gap-fish": gap_fish_figure(found, robot, markers), "gap-shares": gap_shares_figure(found)}
    figures["gap-effects"] = gap_effects_figure(found)
    if found.gap.trials:
        figures["gap-waterfall"] = gap_waterfall_figure(found)
        figures["gap-held-out"] = gap_held_out_figure(found.gap, bool(found.effect_parameters))
    if found.everything is not None and found.everything.gap.evaluated_on:
        figures["gap-everything"] = gap_held_out_figure(found.everything.gap, True)
    figures["gap-forces"] = gap_forces_figure(found.missing_forces)
    return {name: Plot(figure, name, _CAPTIONS[name]) for name, figure in figures.items()}
