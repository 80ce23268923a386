"""The twin with the effects that a diagnosis names, as files: MJCF, and a script for what no MJCF can hold."""

from pathlib import Path

import mujoco
import numpy as np

from diagnosis import Diagnosis
from session import program_version, write_whole
from swimmer import ENGINE, FluidCoefficients, Runs
from swimmer.effects import AffectedTwin

_SCRIPT = '''"""Runs the twin with {names}, which plain MJCF cannot hold all of. Needs swimcal ({program})."""

import numpy as np

from swimmer import Runs, Twin, load_robot
from swimmer.effects import AffectedRuns, AffectedTwin, catalogue

EFFECTS = {names!r}
VALUES = {values!r}  # of their parameters, one effect after the other: {parameters}
COEFFICIENTS = {coefficients!r}  # blunt, slender and angular drag, Kutta and Magnus lift

twin = AffectedTwin(Twin(load_robot({robot!r})), [catalogue()[name] for name in EFFECTS])
runs = AffectedRuns(
    coefficients=np.array([COEFFICIENTS]),
    frequency_hz=np.array([1.0]),
    phase_rad=np.zeros(1),
    velocity=np.array([[-0.1, 0.0, 0.0]]),
    values=np.array([VALUES]),
)
trajectories = twin.simulate(runs, np.arange(0.0, 6.0, 1 / 60))
start, end = trajectories.head[0, [60, -1], :2]
print(f"{{np.linalg.norm(end - start) / (trajectories.time_s[-1] - trajectories.time_s[60]):.4f}} m/s at 1 Hz")
'''


def write_affected_twin(results: Path, found: Diagnosis) -> list[Path]:
    """``calibrated+<effects>.xml``: robot, coefficients and all of the effects that a model can hold.

    Where it cannot hold all of them a script of the same name runs the twin with the rest. One keyframe a fit trial
    starts it as that trial started.
    """
    best, twin = found.refit, found.ground.twin
    assert best is not None
    names = [effect.name for effect in best.effects]
    affected = AffectedTwin(twin, best.effects)
    coefficients = FluidCoefficients(*map(float, best.at))
    spec = affected.spec(coefficients, best.values)
    said = ", ".join(
        f"{effect.name}.{parameter.name} = {value:.6g} {parameter.unit}"
        for effect, values in zip(best.effects, best.by_effect.values(), strict=True)
        for parameter, value in zip(effect.parameters, values, strict=True)
    )
    spec.add_text(name="calibrated_with", data=f"{program_version()}, MuJoCo {ENGINE}")
    spec.add_text(name="effects", data=said)
    for model in found.ground.model.trials:
        trial, hz = model.trial, model.trial.frequency.hz
        runs = Runs(best.at[None], np.array([hz]), np.array([model.phase_rad]), trial.start_velocity[None])
        position, velocity = twin.start(runs)
        spec.add_key(name=trial.name, qpos=position[0], qvel=velocity[0], ctrl=[2 * np.pi * hz])
    spec.compile()
    text: str = spec.to_xml()
    mujoco.MjModel.from_xml_string(text)  # what is written must load
    stem = "calibrated+" + "+".join(names)
    paths = [results / f"{stem}.xml"]
    write_whole(paths[0], text)
    if not all(effect.in_mjcf() for effect in best.effects):
        paths.append(results / f"{stem}.py")
        robot = None
        script = _SCRIPT.format(
            names=names,
            program=program_version(),
            values=[float(value) for value in best.values],
            parameters=said,
            coefficients=[float(value) for value in best.at],
            robot=robot,
        )
        write_whole(paths[1], script)
    return paths
