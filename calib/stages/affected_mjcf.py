"""The twin with effects that a diagnosis fitted, as files: MJCF, and a script for what no MJCF can hold."""

from pathlib import Path

import numpy as np

from calib.stages.fit import mjcf_text
from diagnosis.affected_swims import SettledTwin
from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit
from fitting.forecast import fit_phase
from fitting.signatures.affected_session import views_of
from reports.page import environment
from session.results import program_version, write_whole
from swimmer import FluidCoefficients
from swimmer.effects import AffectedRuns, AffectedTwin
from swimmer.engine import ENGINE
from swimmer.scenery import add_scenery


def write_affected_twin(
    results: Path, linear: LinearModel, best: Refit, name: str, robot_file: Path | None
) -> list[Path]:
    """Write ``calibrated+<name>.xml``: robot, coefficients and all of the effects that a model can hold.

    Effects with an axis of the picture (a current) are in the frame of the first fit trial. One keyframe a fit trial
    starts the model as that trial started. Where MJCF cannot hold all of the effects, a script of the same name runs
    the twin with them.

    Args:
        results: the folder of the results.
        linear: the linearised model of the diagnosis.
        best: the refit with the effects.
        name: names of the effects in the file's name.
        robot_file: the robot's TOML; None for the built-in robot.
    """
    affected = AffectedTwin(linear.twin, best.effects)
    views = views_of(linear.model, linear.camera, tuple(map(float, linear.at)))
    values, coefficients = affected.in_trial(views[0], best.values), FluidCoefficients(*map(float, best.at))
    names = [effect.name for effect in best.effects]
    parameters = ", ".join(
        f"{effect.name}.{parameter.name} = {value:.6g} {parameter.unit}"
        for effect, own in zip(best.effects, best.by_effect.values(), strict=True)
        for parameter, value in zip(effect.parameters, own, strict=True)
    )
    spec = add_scenery(affected.spec(coefficients, values), affected.robot)
    spec.add_text(name="calibrated_with", data=f"{program_version()}, MuJoCo {ENGINE}")
    spec.add_text(name="effects", data=f"{parameters}; in the frame of trial {linear.swims[0].name}")
    for trial, view in zip(linear.swims, views, strict=False):  # the views of dry runs come last
        own, hz = affected.in_trial(view, best.values), trial.frequency.hz
        phase = fit_phase(SettledTwin(affected, best.values, view), trial, coefficients)
        runs = AffectedRuns(
            best.at[None], np.array([hz]), np.array([phase]), trial.start_velocity[None], values=own[None]
        )
        position, velocity = affected.start(runs)
        spec.add_key(name=trial.name, qpos=position[0], qvel=velocity[0], ctrl=[2 * np.pi * hz])
    paths = [results / f"calibrated+{name}.xml"]
    write_whole(paths[0], mjcf_text(spec))
    if not all(effect.in_mjcf() for effect in best.effects):
        template = environment("calib", escaped=False).get_template("affected_twin.py.j2")
        script = template.render(
            names=names,
            program=program_version(),
            trial=linear.swims[0].name,
            parameters=parameters,
            robot="None  # the built-in one" if robot_file is None else f"Path({str(robot_file)!r})",
            markers=linear.twin.markers,
            values=values.tolist(),
            coefficients=best.at.tolist(),
            axis=views[0].axis_m.tolist(),
            down=views[0].down.tolist(),
            half=float(views[0].half_height_m),
        )
        paths.append(paths[0].with_suffix(".py"))
        write_whole(paths[1], script)
    return paths
