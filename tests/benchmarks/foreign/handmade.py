"""A session without a simulation: fish that beat evenly and swim straight at a known speed."""

import numpy as np

from benchmarks.foreign.recordings import Recording, Recordings, Tracker
from swimcal.robot import load_robot
from swimsynth.disturbances import NOISELESS

FISH = load_robot()
MARKERS = ("nose", "neck", "tail_2", "tail_4", "caudal_fin")
FPS, PX_PER_M, SPEED_M_S = 60.0, 1000.0, 0.1
COEFFICIENTS = (0.4, 2.0, 6.0, 4.0, 1.0)


def swim(name: str, hz: float, role: str = "fit", seconds: float = 8.0, speed_m_s: float = SPEED_M_S) -> Recording:
    """Towards the left; the tail swings by up to 60 mm."""
    time_s = np.arange(round(seconds * 240) + 1) / 240
    along = FISH.marker_positions_m(MARKERS)[:, 0]
    behind = np.clip(along - along[1], 0.0, None)
    x = along - speed_m_s * time_s[:, None] + 2.0
    y = 0.06 * behind / behind.max() * np.sin(2 * np.pi * hz * time_s[:, None] - 4.0 * behind) + 1.0
    return Recording(name, "swim", role, hz, hz, time_s, PX_PER_M * np.stack([x, y], axis=-1))


def session(*trials: Recording, filmed: bool = True) -> Recordings:
    """Of these trials, by default two to fit and one held out."""
    chosen = list(trials) or [swim("swim_a", 0.8), swim("swim_b", 1.0, "holdout"), swim("swim_c", 1.3)]
    made = Recordings(FISH, True, "twin", MARKERS, FPS, PX_PER_M, 1.0, Tracker(NOISELESS, 0.2), COEFFICIENTS, chosen)
    for trial in chosen if filmed else ():
        trial.film(FPS, made.tracker, np.random.default_rng(0))
    return made
