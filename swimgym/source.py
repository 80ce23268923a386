"""The fish that swims: the models of a calibrated session, of an MJCF or of the built-in robot."""

import hashlib
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from session.errors import Fault, InputError, ModelMismatch
from session.results import read_provenance
from swimgym.swimmers import HEAD
from swimmer import build_mjcf, load_robot
from swimmer.engine import ENGINE
from swimmer.twin import FORCE_FIELDS


@dataclass(frozen=True, eq=False)
class Fish:
    """A robot to swim with: one model, or several between which its swimmers differ (posterior draws).

    `origin` says in words where its numbers come from; `sha256` is that of its MJCF.
    """

    robot: str
    models: tuple[mujoco.MjModel, ...]
    origin: str
    sha256: str

    def with_coefficients(self, coefficients: np.ndarray) -> "Fish":
        """Return the same fish with fluid coefficients (k, 5), a model for each row, such as draws of a posterior."""
        fluid = np.flatnonzero(self.models[0].geom_fluid[:, 0] > 0)
        models = []
        for row in np.atleast_2d(coefficients):
            model = copy(self.models[0])
            model.geom_fluid[fluid, FORCE_FIELDS] = row
            models.append(model)
        return replace(self, models=tuple(models), origin=f"{self.origin}, {len(models)} sets of coefficients")


def load_fish(
    session: str | Path | None = None,
    *,
    mjcf: str | Path | None = None,
    effects: bool = False,
    draws: int = 0,
    seed: int = 0,
) -> Fish:
    """Load the fish of a calibrated session, of an MJCF, or the built-in robot with the published coefficients.

    Args:
        session: folder of a session with a fit.
        mjcf: instead, an MJCF with the names of the public contract.
        effects: whether the fish of a session has the effects that its diagnosis named, as far as an MJCF holds them.
        draws: number of fish drawn from the session's posterior instead of the one fitted.
        seed: seed of these draws.

    Raises:
        InputError: no such file, not such a model, no fit, no posterior, or both a session and an MJCF.
        ModelMismatch: the session was calibrated with another engine.
    """
    if session is not None and mjcf is not None:
        raise _fault(str(mjcf), "a session and an MJCF", "both", "one of them", "Leave one out.")
    if session is not None:
        return _load_session_fish(Path(session), effects, draws, seed)
    if effects or draws:
        step = "Give a session, or leave effects and draws out."
        raise _fault(str(mjcf or "the built-in robot"), "effects or draws", "no session", "those of a session", step)
    if mjcf is not None:
        return _load_mjcf(Path(mjcf), "an MJCF")
    spec = build_mjcf(load_robot())
    model = spec.compile()
    digest = hashlib.sha256(spec.to_xml().encode()).hexdigest()
    return Fish(spec.modelname, (model,), "the built-in robot, published coefficients", digest)


def _load_session_fish(session: Path, effects: bool, draws: int, seed: int) -> Fish:
    results = session / "results"
    made_with = read_provenance(results / "calibration.json")
    if made_with.mujoco != ENGINE:
        raise ModelMismatch(
            f"{results / 'calibration.json'}: this calibration was made with MuJoCo {made_with.mujoco}, here is "
            f"{ENGINE}. Its coefficients mean nothing here. Fit again with `calib fit {session}`."
        )
    fish = _load_mjcf(_find_mjcf(results, effects), f"session {session.name}{', with effects' if effects else ''}")
    if not draws:
        return fish
    if not (results / "posterior.nc").is_file():
        step = f"Run `calib posterior {session}`."
        raise _fault(str(results / "posterior.nc"), "there is no posterior", "nothing", "draws of a posterior", step)
    from fitting.posterior.posterior import load_chains

    drawn = load_chains(results / "posterior.nc")[..., :5].reshape(-1, 5)
    return fish.with_coefficients(np.random.default_rng(seed).choice(drawn, draws, replace=draws > len(drawn)))


def _find_mjcf(results: Path, effects: bool) -> Path:
    if not effects:
        return results / "calibrated.xml"
    if found := sorted(results.glob("calibrated+*.xml")):
        return found[0]
    step = f"Run `calib diagnose {results.parent}`; where it names no effect, leave effects out."
    raise _fault(str(results), "no model with effects", "nothing", "calibrated+<effect>.xml", step)


def _load_mjcf(file: Path, origin: str) -> Fish:
    """Load the fish of a file, without its scenery."""
    step = "Write one with `calib mjcf`."
    if not file.is_file():
        raise _fault(str(file), "it is not there", "nothing", "an MJCF", step)
    try:
        spec = mujoco.MjSpec.from_file(str(file))
        for part in (*spec.sensors, *spec.lights, *spec.cameras, *spec.worldbody.geoms):  # they move nothing
            spec.delete(part)
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise _fault(str(file), "it is no MJCF", str(error), "a model of the robot", step) from error
    joints = {model.joint(i).name for i in range(model.njnt)}
    lack = [name for name in (*HEAD, "crank", "tail_1") if name not in joints]
    lack += [] if model.nu == 1 else ["one actuator"]
    lack += [] if "head" in {model.body(i).name for i in range(model.nbody)} else ["body head"]
    if lack:
        expected = "joints surge, sway, yaw, crank and tail_1 …, one actuator and a body head"
        raise _fault(str(file), "it is no swimmer of the public contract", f"none of {', '.join(lack)}", expected, step)
    return Fish(spec.modelname, (model,), origin, hashlib.sha256(file.read_bytes()).hexdigest())


def _fault(file: str, what: str, found: str, expected: str, step: str) -> InputError:
    return InputError([Fault(file, "", what, found, expected, next_step=step)])
