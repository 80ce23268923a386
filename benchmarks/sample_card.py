"""`CARD.md`: what a synthetic dataset is, how it was made, its truth, seed, licence and checksums."""

from collections.abc import Iterable
from pathlib import Path

from session.results import sha256_of, write_whole
from synthetic.trials import Merge
from synthetic.truth import TrialTruth, Truth, read_truth

CARD_FILE = "CARD.md"

_CARD = """\
# {title}

**What.** {what}

**How made.** `{command}`, MuJoCo {mujoco}.

- The twin of `{robot}` swims in a plane, from {run_in_s:g} s before the first frame, at steps of
  {timestep_ms:g} ms; a fit uses coarser ones, so it cannot reproduce the tracks to the bit.{air}
- A camera straight above, without lens or parallax, sees it at {fps:g} frames a second and {px_per_m:g} px
  a metre.
- Each box sits off its marker by a constant for each trial (standard deviation {placement_sd_px:g} px in x
  and in y) and errs by {sd_px:g} px more, correlated over {correlation_s:g} s{grid}.
- No effect beyond the plain twin is simulated: a fit of these data shows how well a known truth is recovered,
  not how well the twin describes a real robot.

**Truth.** In full in `truth.json`, which the program never reads.

- Fluid coefficients: {coefficients}.
- Each hinge: {hinge_stiffness_n_m:g} N m/rad, {hinge_damping_n_m_s:g} N m s/rad; the tail in air then rings at
  {natural_hz:.3f} Hz (small swings, no damping).
- Crank arm: {crank_arm_mm:g} mm. {told}

| trial | role | commanded, Hz | crank, Hz | its phase, rad | forward speed, m/s | track faults |
|---|---|---|---|---|---|---|
{trials}

Phase: of the crank in the first frame. Speed: of the nose, without noise, over the whole beats after
{warmup_s:g} s.
{dry}
**Seed.** {seed}. The same seed gives the same tracks, but for samples on the edge between two places of the
grid, which another machine or engine may round the other way.

**Licence.** MIT, as the program.

**Checksums** (SHA-256).

| file | sha256 |
|---|---|
{checksums}
"""

_AIR = """
- In air, the head clamped: dry runs, in which the crank follows the motor (late commands, ramps, a speed below the
  command that ripples with the load; steps of {step_ms:g} ms), and the tail held bent and let go. A motor is logged as
  `calib capture` logs it, in the steps of its encoder, about every 10 ms, on a clock that is not the video's."""
_TOLD = {
    True: "Hinges and arm are the built-in robot's; the session tells them only by naming no other robot.",
    False: "Hinges and arm stand in the session's `robot.toml`.",
}


def write_card(folder: Path, title: str, what: str, command: str) -> Path:
    """Writes the card of a synthetic session.

    Args:
        folder: the session folder; every file in it is listed, but results and the card itself.
        title: of the card.
        what: a sentence or two for the reader.
        command: that made the folder.

    Raises:
        session.InputError: the session has no `truth.json`.
        session.ResultsNotWritable: the folder is not writable.
    """
    truth = read_truth(folder)
    plan = truth.plan
    parts = (plan, plan.camera, plan.noise, truth.structure, truth)
    settings = {key: value for part in parts for key, value in part.model_dump().items()}
    settings |= {
        "robot": plan.swimmer.name,
        "timestep_ms": 1000 * plan.timestep_s,
        "grid": ", then is rounded to half a pixel" if plan.noise.half_pixel_grid else "",
        "coefficients": ", ".join(f"{name} {value:g}" for name, value in plan.coefficients._asdict().items()),
        "crank_arm_mm": 1000 * truth.structure.crank_arm_m,
        "told": _TOLD[plan.robot is None],
        "air": _AIR.format(step_ms=1000 * plan.air_timestep_s) if plan.dry_runs or plan.free_decays else "",
        "dry": "\n".join(["", *_dry_lines(truth), ""]) if plan.dry_runs or plan.free_decays else "",
        "trials": "\n".join(_trial_rows(truth)),
        "checksums": "\n".join(f"| `{name}` | `{digest}` |" for name, digest in checksums(folder).items()),
    }
    path = folder / CARD_FILE
    write_whole(path, _CARD.format(title=title, what=what, command=command, **settings))
    return path


def checksums(folder: Path) -> dict[str, str]:
    """The sha256 of every file of a dataset by its name in the folder, without results and the card."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    names = {path.relative_to(folder).as_posix(): path for path in files}
    return {
        name: sha256_of(path)
        for name, path in names.items()
        if name != CARD_FILE and not name.startswith(("results/", "."))
    }


def _trial_rows(truth: Truth) -> Iterable[str]:
    for trial in truth.plan.trials:
        known: TrialTruth = truth.trials[trial.name]
        cells = [
            trial.name,
            trial.role,
            f"{trial.commanded_hz:.3f}",
            f"{known.frequency_hz:.4f}",
            f"{known.phase_rad:.3f}",
            f"{known.speed_m_s:.4f}",
            "; ".join(map(_described, trial.faults)) or "none",
        ]
        yield f"| {' | '.join(cells)} |"


def _dry_lines(truth: Truth) -> Iterable[str]:
    """Tables of the dry runs, and of the clocks of their motors, and a line for each free decay."""
    if truth.dry_runs:
        yield "| dry run | role | commanded, Hz | crank, Hz | its phase, rad | steady, s | motor clock - video's |"
        yield "|---|---|---|---|---|---|---|"
    for run in truth.plan.dry_runs:
        known, motor = truth.dry_runs[run.name], run.motor
        steady = "all" if known.steady_s is None else "{:.2f} to {:.2f}".format(*known.steady_s)
        clock = "no log" if motor is None else f"{motor.clock_offset_s:.3f} s, {1e6 * (motor.clock_rate - 1):+.0f} ppm"
        cells = [run.name, run.role, f"{run.commanded_hz:.3f}", f"{known.frequency_hz:.4f}", f"{known.phase_rad:.3f}"]
        yield f"| {' | '.join([*cells, steady, clock])} |"
    if truth.dry_runs:
        yield "\nCrank: its mean over the steady stretch. Clock: in the first frame, and how much faster it runs.\n"
    for decay in truth.plan.free_decays:
        bent = ", ".join(f"{angle:g}" for angle in decay.bent_rad)
        yield f"Free decay {decay.name}: its hinges, bent by {bent} rad, are let go at {decay.release_s:g} s."


def _described(fault: Merge) -> str:
    return f"{fault.kind}: {fault.marker} onto {fault.onto}, frames {fault.first} to {fault.last}"
