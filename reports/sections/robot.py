"""The robot from above."""

from reports.blocks import Plot, Plots, Section
from reports.context import ReportContext
from reports.figures.planform import planform_figure
from reports.numbers import in_mm


def build(context: ReportContext) -> Section:
    """A sketch to scale."""
    robot = context.calibration.robot
    planform = Plot(
        planform_figure(robot, context.session.markers),
        "robot",
        f"The robot from above, to scale ({in_mm(robot.length_m, 0)} mm long): rings are the tracked markers, dots the "
        "hinges, the orange lines the tendons.",
    )
    return Section("Robot", "robot-sketch", (Plots((planform,)),))
