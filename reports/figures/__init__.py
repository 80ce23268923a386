"""The figures of the report, one a file; each returns a matplotlib `Figure`, in notebooks as well."""

from reports.figures.coefficients import coefficients_figure
from reports.figures.convergence import convergence_figure
from reports.figures.flagged_samples import flagged_samples_figure
from reports.figures.forward_path import forward_path_figure
from reports.figures.lateral_motion import lateral_motion_figure
from reports.figures.planform import planform_figure
from reports.figures.speed_errors import speed_errors_figure
from reports.figures.speed_sweep import speed_sweep_figure
from reports.figures.tail_envelope import beat_midlines, tail_envelope_figure

__all__ = [
    "beat_midlines",
    "coefficients_figure",
    "convergence_figure",
    "flagged_samples_figure",
    "forward_path_figure",
    "lateral_motion_figure",
    "planform_figure",
    "speed_errors_figure",
    "speed_sweep_figure",
    "tail_envelope_figure",
]
