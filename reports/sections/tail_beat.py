"""The section on the beat: the wave along the tail, and the dimensionless numbers of each swim."""

import numpy as np

from fitting import CalibratedTrial
from fitting.body_wave import BodyWave, SwimNumbers, body_wave, simulated_numbers, swim_numbers
from reports.blocks import Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.tail_beat import body_wave_figure
from reports.numbers import counted, listed, shown, significant
from swimmer import RobotSpec

COLUMNS = table_head(
    "trial | swimming number [measured, 10³] | twin [10³] | Reynolds [measured, 10³] | twin [10³] | "
    "Strouhal [measured] | twin [] | lag of the fin [measured, °] | twin [°]"
)
LEAST_SEEN = 0.7  # share of a marker's samples needed for its beat; gaps come back at one phase of the beat
Waves = tuple[BodyWave, BodyWave]


def build(context: ReportContext) -> Section:
    """Build the section: waves and numbers, measured and simulated."""
    trials, robot = context.calibration.trials, context.calibration.robot
    waves = [_waves(trial) for trial in trials]
    names = [trial.measured.name for trial in trials]
    last = waves[0][0].markers[-1]
    plots = (
        Plot(
            body_wave_figure(names, waves),
            "body-wave",
            "The wave along the tail: each dot a tail marker; radius is its amplitude, angle its lag behind the first. "
            "A spiral is a travelling wave, a ray a standing one.",
        ),
    )
    rows = tuple(_row(trial, pair, robot) for trial, pair in zip(trials, waves, strict=True))
    blocks = (Plots(plots), _table(rows, last), Prose(_strouhal(trials, waves, robot)))
    return Section("Tail beat", "tail-beat", blocks, _caveats(trials, waves))


def _waves(trial: CalibratedTrial) -> Waves:
    """Compute the measured and the simulated wave; the measured one is nan for a marker that is flagged too often."""
    measured = trial.measured
    wave = body_wave(measured, measured.head)
    columns = [measured.markers.index(name) for name in wave.markers]
    known = (measured.weight[measured.kept][:, columns] > 0).mean(axis=0) >= LEAST_SEEN
    amplitude, lag = (np.where(known, values, np.nan) for values in (wave.amplitude_m, wave.lag_rad))
    return wave._replace(amplitude_m=amplitude, lag_rad=lag), body_wave(measured, trial.simulated)


def _caveats(trials: tuple[CalibratedTrial, ...], waves: list[Waves]) -> tuple[str, ...]:
    unclear = [
        f"{name} of {trial.measured.name}"
        for trial, (measured, _) in zip(trials, waves, strict=True)
        for name, amplitude in zip(measured.markers, measured.amplitude_m, strict=True)
        if not np.isfinite(amplitude)
    ]
    if not unclear:
        return ()
    return (f"Too often flagged to estimate its beat: {listed(unclear)}; left out of the measured wave.",)


def _numbers(trial: CalibratedTrial, waves: Waves, robot: RobotSpec) -> tuple[SwimNumbers, SwimNumbers]:
    measured = swim_numbers(trial.measured, robot)
    if not np.isfinite(waves[0].amplitude_m[-1]):
        measured = measured._replace(amplitude_m=np.nan, swimming_number=np.nan, strouhal=np.nan)
    return measured, simulated_numbers(trial.measured, trial.simulated, trial.simulated_hz, robot)


def _row(trial: CalibratedTrial, waves: Waves, robot: RobotSpec) -> tuple[str, ...]:
    numbers = _numbers(trial, waves, robot)
    return (
        trial.measured.name,
        *(shown(number.swimming_number / 1000) for number in numbers),
        *(shown(number.reynolds / 1000) for number in numbers),
        *(significant(number.strouhal) for number in numbers),
        *(shown(float(np.degrees(wave.lag_rad[-1]))) for wave in waves),
    )


def _table(rows: tuple[tuple[str, ...], ...], last: str) -> Table:
    return Table(
        f"Dimensionless numbers of each swim (Gazzola, Argentina and Mahadevan, Nature Physics 10, 2014); amplitude "
        f"and lag are those of {last}.",
        COLUMNS,
        rows,
        folded=True,
    )


def _strouhal(trials: tuple[CalibratedTrial, ...], waves: list[Waves], robot: RobotSpec) -> str:
    found = [_numbers(trial, pair, robot)[0].strouhal for trial, pair in zip(trials, waves, strict=True)]
    known = [value for value in found if np.isfinite(value)]
    text = "Swimming animals cruise at Strouhal numbers of 0.2 to 0.4 (Taylor et al., Nature 425, 2003)"
    if not known:
        return f"{text}; it is not known for any trial here."
    span = significant(known[0]) if len(known) == 1 else f"{significant(min(known))} to {significant(max(known))}"
    unknown = len(found) - len(known)
    rest = f"; {counted(unknown, 'trial')} without forward speed or amplitude left out" if unknown else ""
    return f"{text}; this robot swims at {span}{rest}."
