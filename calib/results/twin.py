"""The twin that a user can drive, and a robot's description on one sheet.

`SwimTwin.swim` returns the markers of a swim at any crank speed, as labelled arrays. `draw_robot` draws a robot from
above, with the numbers that show whether its description is right.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import mujoco
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from calib.results.result import TIME, Export
from fitting.pool import forward_speed, head_frame
from reports.robot import robot_figure
from swimcal.effects.affected_twin import AffectedRuns, AffectedTwin
from swimcal.effects.effect import MOVING_WAYS, Effect, Parameter
from swimcal.errors import Fault, InputError
from swimcal.mjcf import PUBLISHED_COEFFICIENTS, FluidCoefficients, add_scenery, build_mjcf, natural_hz
from swimcal.results import write_whole
from swimcal.robot import RobotSpec, load_robot
from swimcal.robot_doubts import robot_doubts
from swimcal.runs import Runs
from swimcal.session_file import FASTEST_HZ
from swimcal.twin import Twin
from tracking.head_frame import select_head

PICTURES = (".png", ".svg", ".pdf")
"""Endings of the pictures of a robot that can be written."""
DOTS_AN_INCH = 200
_LEAST_S = 6.0  # shortest swim from rest, where no duration is given
_BEYOND = 0.01  # share by which a frequency may differ from the fitted ones without being beyond them
_STEPS_A_TURN = 80  # fewest time steps a turn at which the speed was compared with that of a shorter step
_SETTLED_BEATS = 12.0  # beats in which the speed of a swim from rest settles


@dataclass(frozen=True, eq=False)
class SwimTwin:
    """A robot with its fluid coefficients and, optionally, effects that the plain twin leaves out.

    Attributes:
        robot: as described, with what dry experiments say of it.
        coefficients: the five fluid coefficients.
        engine: simulates batches of swims on all cores.
        fitted_hz: slowest and fastest turns a second of the trials that the coefficients were fitted to; None for those
            of no fit.

    Example:
        >>> twin = calib.load_twin("pool", effects=["tendon_slack"])
        >>> twin.parameters
        ('tendon_slack.length', 'tendon_slack.dragging')
        >>> swim = twin.swim(0.8, seconds=3.0, parameters={"tendon_slack.length": [0.0, 0.002]})
        >>> bool(swim.speed[1] < swim.speed[0])                 # with 2 mm of slack it is slower
        True
        >>> twin.model.opt.timestep                             # s; a plain `mujoco.MjModel`
        0.0045
    """

    robot: RobotSpec
    coefficients: FluidCoefficients
    engine: Twin
    fitted_hz: tuple[float, float] | None = None

    def __repr__(self) -> str:
        effects = self.engine.effects if isinstance(self.engine, AffectedTwin) else ()
        names = ", ".join(effect.name for effect in effects)
        return f"<SwimTwin {self.robot.name}: {self.coefficients}; effects: {names or 'none'}>"

    @property
    def model(self) -> mujoco.MjModel:
        """The plain twin as a MuJoCo model, without effects, with scenery and sensors."""
        return add_scenery(build_mjcf(self.robot, self.coefficients), self.robot).compile()

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the effects' parameters, as `swim` takes them, such as "tendon_slack.length"."""
        return tuple(self._by_name)

    @property
    def _by_name(self) -> dict[str, tuple[Effect, Parameter]]:
        """Parameters of the effects, each with its effect, by the name that `swim` takes."""
        effects = self.engine.effects if isinstance(self.engine, AffectedTwin) else ()
        return {f"{effect.name}.{each.name}": (effect, each) for effect in effects for each in effect.parameters}

    def swim(
        self,
        frequency_hz: ArrayLike,
        seconds: float | None = None,
        fps: float = 60.0,
        phase_rad: float = 0.0,
        parameters: Mapping[str, ArrayLike] | None = None,
    ) -> xr.Dataset:
        """Simulate swims from rest, heading along -x.

        Args:
            frequency_hz: crank turns a second; one or (n,), simulated together.
            seconds: duration; default: twelve beats of the slowest, in which speeds settle, and 6 s at least.
            fps: frames a second.
            phase_rad: angle of the crank at time 0; at 0 the tail is straight.
            parameters: values of the effects' parameters, by the names in `parameters`; one or (n,). Others are 0.

        Returns:
            Dimensions `run` (n), `time` (s), `space` (x, y) and `keypoint`; variables `position` (run, time, space,
                keypoint) of the markers and `head` (run, time, space), m, on the pool; `yaw` (run, time), rad; `speed`
                (run), m/s, forward, over the whole beats of the second half; `extrapolated` (run), whether the
                frequency is beyond `fitted_hz`, or a turn has fewer than 80 of the robot's time steps: there another
                step may give another speed. `frequency`, Hz, and the parameters are coordinates of the runs:
                `.sel(frequency=0.8)`. Of the head write `swim["head"]`: `swim.head` is a method of every dataset.

        Raises:
            InputError: a parameter that the effects do not have, a value beyond its bounds, values of another number
                than the frequencies, an effect that changes no swim, or a frequency that is none.
            SimulationDiverged: the twin left the range in which its numbers mean something.
        """
        hz = _check_frequencies(frequency_hz)
        given = self._check_parameters(parameters or {}, len(hz))
        _check_positive({"fps": fps} if seconds is None else {"fps": fps, "seconds": seconds})
        count = max(map(len, (hz, *given.values())))
        seconds = max(_LEAST_S, _SETTLED_BEATS / float(hz.min())) if seconds is None else seconds
        hz = np.broadcast_to(hz, count)
        time_s = np.arange(round(seconds * fps)) / fps
        water = np.tile(np.array(self.coefficients, float), (count, 1))
        runs = Runs(water, hz, np.full(count, phase_rad))
        if isinstance(self.engine, AffectedTwin):
            values = np.zeros((count, self.engine.size))
            for name, value in given.items():
                values[:, self.parameters.index(name)] = value
            runs = AffectedRuns(water, hz, np.full(count, phase_rad), values=values)
        found = self.engine.simulate(runs, time_s)
        late, heads = time_s >= time_s[-1] / 2, head_frame(self.engine.markers, found.marker_m)
        low, high = self.fitted_hz or (-np.inf, np.inf)
        high = min(high, 1 / (_STEPS_A_TURN * self.robot.time_step_s))
        speed = [float(forward_speed(time_s, select_head(heads, run), late, hz[run])) for run in range(count)]
        swims = xr.Dataset(
            {
                "position": (("run", "time", "space", "keypoint"), np.swapaxes(found.marker_m, 2, 3), {"units": "m"}),
                "head": (("run", "time", "space"), found.head[..., :2], {"units": "m"}),
                "yaw": (("run", "time"), found.head[..., 2], {"units": "rad"}),
                "speed": (("run",), np.array(speed), {"units": "m/s", "long_name": "forward speed"}),
                "extrapolated": (("run",), (hz < low * (1 - _BEYOND)) | (hz > high * (1 + _BEYOND))),
            },
            {
                "run": np.arange(count),
                "frequency": (("run",), np.array(hz), {"units": "Hz"}),
                **{name: (("run",), np.broadcast_to(value, count)) for name, value in given.items()},
                "time": ("time", time_s, TIME),
                "space": ["x", "y"],
                "keypoint": list(self.engine.markers),
            },
        )
        return swims.set_xindex("frequency")

    def _check_parameters(self, parameters: Mapping[str, ArrayLike], runs: int) -> dict[str, np.ndarray]:
        """Convert each parameter to (n,) or (1,), for n runs; an `InputError` for what the effects do not have."""
        known, found = self._by_name, {name: _numbers_of(value) for name, value in parameters.items()}
        runs = max([runs, *map(len, found.values())]) if runs == 1 else runs
        faults = []
        for name, value in found.items():
            here = parameters[name]
            if name not in known:
                what, expected = "no such parameter", "a parameter of the twin's effects"
                faults.append(Fault("parameters", "", what, repr(name), expected, tuple(known)))
                continue
            effect, parameter = known[name]
            if not set(effect.enters()) & {*MOVING_WAYS, "drive"}:
                what = "the effect changes what is filmed or commanded, not how the twin swims at a given crank speed"
                faults.append(Fault("parameters", name, what, repr(here), "an effect that moves the fish"))
            if not ((value >= parameter.low) & (value <= parameter.high)).all():  # also of nan
                expected = f"numbers from {parameter.low:g} to {parameter.high:g} {parameter.unit}"
                faults.append(Fault("parameters", name, "beyond what the effect may be", repr(here), expected))
            if len(value) not in (1, runs):
                expected = f"one value, or {runs}, one for each run"
                faults.append(Fault("parameters", name, "another number of values than of runs", repr(here), expected))
        if faults:
            raise InputError(faults)
        return found


def _numbers_of(value: ArrayLike) -> np.ndarray:
    """Convert what was given to (n,); nan where it is no number."""
    try:
        return np.atleast_1d(np.asarray(value, float))
    except (TypeError, ValueError):
        return np.array([np.nan])


def check_coefficients(given: Sequence[float]) -> FluidCoefficients:
    """Check five fluid coefficients, without a unit.

    Raises:
        InputError: they are not five, or not finite and 0 or more.
    """
    if len(given) != len(FluidCoefficients._fields) or not all(0 <= each < np.inf for each in given):
        names = ", ".join(name.replace("_", " ") for name in FluidCoefficients._fields)
        what, expected = "no coefficients of the fluid forces", f"five numbers of 0 or more: {names}"
        raise InputError([Fault("coefficients", "", what, str(list(given)), expected)])
    return FluidCoefficients(*map(float, given))


def _check_frequencies(given: ArrayLike) -> np.ndarray:
    """Convert one or several frequencies, Hz, to (n,); an `InputError` where there is none, or one is not above 0."""
    what, expected, hz = "no frequency", "crank turns a second above 0", _numbers_of(given)
    if len(hz) == 0:
        raise InputError([Fault("frequency_hz", "", what, "an empty list", "one or more")])
    if not (np.isfinite(hz) & (hz > 0)).all():
        raise InputError([Fault("frequency_hz", "", what, str(given), expected)])
    if (hz > FASTEST_HZ).any():
        what, expected = "faster than a tail is driven", f"crank turns a second, at most {FASTEST_HZ:g}"
        raise InputError([Fault("frequency_hz", "", what, f"{hz.max():g}", expected)])
    return hz


def _check_positive(given: Mapping[str, float]) -> None:
    whats, expected = {"seconds": "no duration", "fps": "no frame rate"}, "a number above 0"
    wrong = {name: value for name, value in given.items() if not 0 < value < np.inf}
    if wrong:
        raise InputError([Fault(name, "", whats[name], f"{value:g}", expected) for name, value in wrong.items()])


def draw_robot(robot: str | Path | None = None, out: str | Path = "robot.png") -> Export:
    """Draw a robot from above and from the side; say its mass, length, natural frequency in air and speed at 1 Hz.

    Args:
        robot: a robot's TOML; default: the published 0.57 m fish.
        out: the picture to write, .png, .svg or .pdf.

    Raises:
        InputError: the file has faults, all of them at once; or `out` has another ending.
        ResultsNotWritable: `out` cannot be written.

    Example:
        >>> made = calib.draw_robot(out="fish.png")
        >>> made.notes[1]
        'Its tail rings at 3.6 Hz in air, without tendons'
    """
    described, picture = load_robot(None if robot is None else Path(robot)), Path(out)
    if picture.suffix.lower() not in PICTURES:
        what, expected = "no picture can be written there", "a name with one of these endings"
        raise InputError([Fault("--out", "", what, picture.name, expected, PICTURES)])
    markers = tuple(described.markers)
    speed_m_s = float(SwimTwin(described, PUBLISHED_COEFFICIENTS, Twin(described, markers)).swim(1.0).speed[0])
    mass_kg, tail_kg = build_mjcf(described).compile().body_mass.sum(), described.tail_mass_kg.sum()
    drawn = BytesIO()
    robot_figure(described, markers).savefig(drawn, format=picture.suffix[1:].lower(), dpi=DOTS_AN_INCH)
    write_whole(picture, drawn.getvalue())
    notes = (
        f"{described.name}: {mass_kg:.2f} kg, of which the tail has {1000 * tail_kg:.0f} g; {described.length_m:.2f} m "
        "from nose to fin",
        f"Its tail rings at {natural_hz(described):.1f} Hz in air, without tendons",
        f"With the published coefficients it swims at {speed_m_s:.3f} m/s at 1 Hz; a fit finds its own",
        *robot_doubts(described),
    )
    return Export((picture,), notes)
