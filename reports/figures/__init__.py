"""The figures of the report, one a file; each returns a matplotlib `Figure`, in notebooks as well."""

from reports.figures.body_wave import body_wave_figure
from reports.figures.coefficient_profiles import coefficient_profiles_figure
from reports.figures.coefficients import coefficients_figure
from reports.figures.convergence import convergence_figure
from reports.figures.flagged_samples import flagged_samples_figure
from reports.figures.forward_path import forward_path_figure
from reports.figures.gap_effects import gap_effects_figure
from reports.figures.gap_fish import gap_fish_figure
from reports.figures.gap_forces import gap_forces_figure
from reports.figures.gap_held_out import gap_held_out_figure
from reports.figures.gap_separation import gap_separation_figure
from reports.figures.gap_shares import gap_shares_figure
from reports.figures.gap_slides import gap_slides_figure
from reports.figures.gap_waterfall import gap_waterfall_figure
from reports.figures.lateral_motion import lateral_motion_figure
from reports.figures.marker_residuals import marker_residuals_figure
from reports.figures.mean_shapes import mean_shapes_figure
from reports.figures.pair_coefficients import pair_coefficients_figure
from reports.figures.pair_errors import pair_errors_figure
from reports.figures.phase_portrait import phase_portrait_figure
from reports.figures.planform import planform_figure
from reports.figures.posterior_chains import posterior_ranks_figure, posterior_trace_figure
from reports.figures.posterior_corner import posterior_corner_figure
from reports.figures.posterior_further import posterior_further_figure
from reports.figures.posterior_intervals import posterior_intervals_figure
from reports.figures.posterior_left_out import posterior_left_out_figure
from reports.figures.posterior_sweep import posterior_sweep_figure
from reports.figures.posterior_trials import posterior_trials_figure
from reports.figures.posterior_whiteness import posterior_whiteness_figure
from reports.figures.residuals_over_time import residuals_over_time_figure
from reports.figures.search_convergence import search_convergence_figure
from reports.figures.speed_errors import speed_errors_figure
from reports.figures.speed_intervals import speed_intervals_figure
from reports.figures.speed_sweep import speed_sweep_figure
from reports.figures.tail_envelope import beat_midlines, tail_envelope_figure

__all__ = [
    "beat_midlines",
    "body_wave_figure",
    "coefficient_profiles_figure",
    "coefficients_figure",
    "convergence_figure",
    "flagged_samples_figure",
    "forward_path_figure",
    "gap_effects_figure",
    "gap_fish_figure",
    "gap_forces_figure",
    "gap_held_out_figure",
    "gap_separation_figure",
    "gap_shares_figure",
    "gap_slides_figure",
    "gap_waterfall_figure",
    "lateral_motion_figure",
    "marker_residuals_figure",
    "mean_shapes_figure",
    "pair_coefficients_figure",
    "pair_errors_figure",
    "phase_portrait_figure",
    "planform_figure",
    "posterior_corner_figure",
    "posterior_further_figure",
    "posterior_intervals_figure",
    "posterior_left_out_figure",
    "posterior_ranks_figure",
    "posterior_sweep_figure",
    "posterior_trace_figure",
    "posterior_trials_figure",
    "posterior_whiteness_figure",
    "residuals_over_time_figure",
    "search_convergence_figure",
    "speed_errors_figure",
    "speed_intervals_figure",
    "speed_sweep_figure",
    "tail_envelope_figure",
]
