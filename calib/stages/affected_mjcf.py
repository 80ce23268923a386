"""The twin with effects that a diagnosis fitted, as files: MJCF, and a script for what no MJCF can hold."""

from pathlib import Path

import mujoco
import numpy as np

from diagnosis.affected_swims import SettledTwin
from diagnosis.ground import Ground
from diagnosis.refit import Refit
from fitting.forecast import fit_phase
from fitting.signatures.affected_session import views_of
from session.results import program_version, write_whole
from swimmer import FluidCoefficients
from swimmer.effects import AffectedRuns, AffectedTwin
from swimmer.engine import ENGINE
from swimmer.scenery import add_scenery

_SCRIPT = '''"""Runs the twin with {names}, which plain MJCF cannot hold all of. Needs swimcal ({program}).

As the camera of trial {trial} would see it, at a command of 1 Hz. Parameters: {parameters}.
"""

from pathlib import Path

import numpy as np

from swimmer import Twin, load_robot
from swimmer.effects import AffectedRuns, AffectedTwin, View, catalogue

ROBOT = {robot}
MARKERS = {markers!r}
EFFECTS = {names!r}
VALUES = np.array({values!r})  # of all parameters of the effects, one after the other, in the frame of that trial
COEFFICIENTS = {coefficients!r}  # blunt, slender and angular drag, Kutta and Magnus lift
VIEW = View(np.array({axis!r}), np.array({down!r}), {half!r})

twin = AffectedTwin(Twin(load_robot(ROBOT), MARKERS), [catalogue()[name] for name in EFFECTS])
runs = AffectedRuns(
    coefficients=np.array([COEFFICIENTS]),
    frequency_hz=np.array([twin.measured_hz(1.0, VALUES)]),  # what the command leads to
    phase_rad=np.zeros(1),
    velocity=np.array([[-0.1, 0.0, 0.0]]),
    values=VALUES[None],
)
trajectories = twin.simulate(runs, np.arange(0.0, 6.0, 1 / 60))
seen = twin.observed(runs, trajectories, [VIEW])  # (1, frames, markers, 2) where camera and tracker find them, m
start, end = seen[0, [60, -1], MARKERS.index("nose")]
print(f"{{np.linalg.norm(end - start) / (trajectories.time_s[-1] - trajectories.time_s[60]):.4f}} m/s as seen")
'''


def write_affected_twin(results: Path, ground: Ground, best: Refit, name: str, robot_file: Path | None) -> list[Path]:
    """``calibrated+<name>.xml``: robot, coefficients and all of the effects that a model can hold.

    Effects with an axis of the picture (a current) are in the frame of the first fit trial. One keyframe a fit trial
    starts the model as that trial started. Where MJCF cannot hold all of the effects a script of the same name runs the
    twin with them.

    Args:
        results: folder.
        ground: the fitted swims beside the nearest plain twin.
        best: the twin with effects, fitted to them.
        name: of the files, for its effects.
        robot_file: the robot's own; None for the built-in one.
    """
    affected = AffectedTwin(ground.twin, best.effects)
    views = views_of(ground.model, ground.camera, tuple(map(float, ground.at)))
    values, coefficients = affected.in_trial(views[0], best.values), FluidCoefficients(*map(float, best.at))
    names = [effect.name for effect in best.effects]
    said = ", ".join(
        f"{effect.name}.{parameter.name} = {value:.6g} {parameter.unit}"
        for effect, own in zip(best.effects, best.by_effect.values(), strict=True)
        for parameter, value in zip(effect.parameters, own, strict=True)
    )
    spec = add_scenery(affected.spec(coefficients, values), affected.robot)
    spec.add_text(name="calibrated_with", data=f"{program_version()}, MuJoCo {ENGINE}")
    spec.add_text(name="effects", data=f"{said}; in the frame of trial {ground.swims[0].name}")
    for trial, view in zip(ground.swims, views, strict=False):  # the views of dry runs come last
        own, hz = affected.in_trial(view, best.values), trial.frequency.hz
        phase = fit_phase(SettledTwin(affected, best.values, view), trial, coefficients)
        runs = AffectedRuns(
            best.at[None], np.array([hz]), np.array([phase]), trial.start_velocity[None], values=own[None]
        )
        position, velocity = affected.start(runs)
        spec.add_key(name=trial.name, qpos=position[0], qvel=velocity[0], ctrl=[2 * np.pi * hz])
    spec.compile()
    text: str = spec.to_xml()
    mujoco.MjModel.from_xml_string(text)  # what is written must load
    paths = [results / f"calibrated+{name}.xml"]
    write_whole(paths[0], text)
    if not all(effect.in_mjcf() for effect in best.effects):
        script = _SCRIPT.format(
            names=names,
            program=program_version(),
            trial=ground.swims[0].name,
            parameters=said,
            robot="None  # the built-in one" if robot_file is None else f"Path({str(robot_file)!r})",
            markers=ground.twin.markers,
            values=values.tolist(),
            coefficients=best.at.tolist(),
            axis=views[0].axis_m.tolist(),
            down=views[0].down.tolist(),
            half=float(views[0].half_height_m),
        )
        paths.append(paths[0].with_suffix(".py"))
        write_whole(paths[1], script)
    return paths
