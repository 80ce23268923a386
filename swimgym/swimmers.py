"""Swimmers: fish drawn from the posterior of a session, simulated side by side.

`Swimmers` are advanced by one control interval at a time, with their state kept. All of them are one
`mujoco.batch.Batch`: its threads persist, the engine steps in C, and positions and velocities are live views of its
state. Each swimmer can have a model of its own (posterior draws, effects).

`load_fish` takes the fish that swims from a calibrated session, from an MJCF or from the built-in robot.
"""

import hashlib
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from mujoco.batch import Batch

from swimcal.errors import Fault, InputError, ModelMismatch
from swimcal.mjcf import build_mjcf
from swimcal.results import read_provenance
from swimcal.robot import load_robot
from swimcal.runs import ENGINE, quiet_engine, workers_of
from swimcal.twin import FORCE_FIELDS, PLAUSIBLE_HINGE_RAD, PLAUSIBLE_SPEED_M_S

_PUBLISHED = ", published coefficients"
HEAD = ("surge", "sway", "yaw")
"""Joints of the head in an MJCF of the public contract: x, y (m) and yaw (rad); the robot heads along -x."""
TURNS = ("roll", "pitch", "yaw")


class Swimmers:
    """A batch of n swimmers, at rest with a straight tail until they are driven.

    Args:
        models: models (`swimcal.mjcf.build_mjcf`), one for all or several that are dealt out in turn.
        count: n.
        interval_s: time between two commands. It is divided into steps of equal length, none longer than the model's
            own.
        workers: threads; 0 for all cores.

    Attributes:
        hinges: names of the h hinges.
        centre_m: (2,) centre of mass of the straight robot in the head's frame, m; the point that is steered.
        joints_m: (h + 2,) x of nose, hinges and tip of the straight robot, m.
    """

    def __init__(
        self, models: Sequence[mujoco.MjModel], count: int, *, interval_s: float = 0.02, workers: int = 0
    ) -> None:
        first = models[0]
        self.interval_s = interval_s
        self.substeps = int(np.ceil(interval_s / first.opt.timestep - 1e-9))
        own = [copy(model) for model in models]
        for model in own:
            model.opt.timestep = interval_s / self.substeps
        joint = {first.joint(i).name: i for i in range(first.njnt)}
        self.hinges = tuple(name for name in joint if name.startswith("tail_"))
        self._q = {name: first.jnt_qposadr[i] for name, i in joint.items()}
        self._v = {name: first.jnt_dofadr[i] for name, i in joint.items()}
        self.centre_m, self.joints_m = _straight(first, self.hinges)
        self._batch = Batch(own[0], count, workers_of(workers))
        if len(own) > 1:
            self._batch.set_models([own[i % len(own)] for i in range(count)])
        self._batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        self._position, self._velocity = self._batch.bind("qpos"), self._batch.bind("qvel")
        self._control, self._start = self._batch.bind("ctrl"), self._batch.state.copy()
        self._hinge_q, self._hinge_v = ([at[name] for name in self.hinges] for at in (self._q, self._v))
        self._head_q, self._head_v = ([at[name] for name in HEAD] for at in (self._q, self._v))

    def __len__(self) -> int:
        return self._batch.nsim

    @property
    def state(self) -> np.ndarray:
        """The state (n, s) of all swimmers; a copy."""
        return self._batch.state.copy()

    def rest(self, rows: np.ndarray, place_m: np.ndarray | float = 0.0, heading_rad: np.ndarray | float = 0.0) -> None:
        """Lay some swimmers (r,) still again.

        Args:
            rows: (r,) numbers of the swimmers.
            place_m: (r, 2) places of the steered point, m.
            heading_rad: (r,) headings from -x, counter-clockwise, rad.
        """
        self._batch.state[rows] = self._start[rows]
        self._position[rows, self._q["yaw"]] = heading_rad
        arm = turned(self.centre_m, self._position[rows, self._q["yaw"]])
        self._position[np.ix_(rows, self._head_q[:2])] = place_m - arm

    def drive(self, speed_rad_s: np.ndarray, rows: np.ndarray | None = None) -> None:
        """Advance all swimmers, or some (r,), by one interval, with cranks held at speeds (n,), rad/s."""
        self._control[:, 0] = speed_rad_s
        with quiet_engine():
            self._batch.step(rows, nstep=self.substeps)

    @property
    def head(self) -> np.ndarray:
        """The head's frame in the pool, (n, 3): x, y (m) and yaw (rad)."""
        return self._position[:, self._head_q]

    @property
    def head_rate(self) -> np.ndarray:
        """The rate of the head's frame (n, 3) in the pool's axes, m/s and rad/s."""
        return self._velocity[:, self._head_v]

    @property
    def turn_rates(self) -> np.ndarray:
        """Rates of roll, pitch and yaw (n, 3), rad/s; 0 where the model has no such joint."""
        rates = np.zeros((len(self), 3))
        for column, name in enumerate(TURNS):
            if name in self._v:
                rates[:, column] = self._velocity[:, self._v[name]]
        return rates

    @property
    def crank(self) -> tuple[np.ndarray, np.ndarray]:
        """The angle of the crank (n,), rad, and its speed (n,), rad/s."""
        return self._position[:, self._q["crank"]], self._velocity[:, self._v["crank"]]

    @property
    def tail(self) -> tuple[np.ndarray, np.ndarray]:
        """The hinge angles (n, h), rad, and their rates (n, h), rad/s."""
        return self._position[:, self._hinge_q], self._velocity[:, self._hinge_v]

    @property
    def centre(self) -> tuple[np.ndarray, np.ndarray]:
        """The place (n, 2) of the steered point in the pool, m, and its velocity (n, 2), m/s."""
        head, rate = self.head, self.head_rate
        arm = turned(self.centre_m, head[:, 2])
        swept = np.stack([-arm[:, 1], arm[:, 0]], axis=1) * rate[:, 2:]
        return head[:, :2] + arm, rate[:, :2] + swept

    @property
    def diverged(self) -> np.ndarray:
        """Mask (n,) of swimmers that are not physical: not finite, bent beyond 90 degrees or faster than 5 m/s."""
        with np.errstate(invalid="ignore"):
            sane = (np.abs(self.tail[0]) < PLAUSIBLE_HINGE_RAD).all(axis=1)
            sane &= (np.abs(self.head_rate[:, :2]) < PLAUSIBLE_SPEED_M_S).all(axis=1)
        return ~sane  # nan compares false


def turned(vector: np.ndarray, angle_rad: np.ndarray) -> np.ndarray:
    """Turn a vector (2,) or vectors (n, 2) by angles (n,), counter-clockwise."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x, y = vector[..., 0], vector[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def _straight(model: mujoco.MjModel, hinges: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Compute `Swimmers.centre_m` (2,) and `Swimmers.joints_m` (h + 2,) in the head's frame, m."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    head = model.body("head").id
    x, reach = data.geom_xpos[:, 0] - data.xpos[head, 0], model.geom_aabb[:, 3]
    at = [data.xanchor[model.joint(name).id, 0] - data.xpos[head, 0] for name in hinges]
    return data.subtree_com[head, :2] - data.xpos[head, :2], np.array([(x - reach).min(), *at, (x + reach).max()])


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
        count = "own coefficients" if len(models) == 1 else f"{len(models)} sets of coefficients"
        return replace(self, models=tuple(models), origin=f"{self.origin.removesuffix(_PUBLISHED)}, {count}")


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
    return Fish(spec.modelname, (model,), f"the built-in robot{_PUBLISHED}", digest)


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
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)  # what blows up is to be seen
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
