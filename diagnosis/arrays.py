"""What figures of a diagnosis are drawn from, as arrays in one file beside it."""

from pathlib import Path

import numpy as np

from diagnosis.diagnosis import Diagnosis


def save_arrays(path: Path, found: Diagnosis) -> None:
    """Writes `diagnosis.npz`.

    Gaits of the fitted swims are (t, g), g = 1 + 14 m + s + 2, the sliding of s markers and the course last:
    `measured`, `plain` (the nearest plain twin's) and `with_effects` (nan where nothing is named); `parts` (5, t, g) of
    what the plain twin leaves, by stage;
    `separation` (e, e) whitened distance between the likeliest effects, each as strong as it would have to be,
    coefficients refitted, and `compared` their places; `forces` and `forces_sd` (t, j, 7).
    """
    ground, where = found.ground, found.where
    trials = len(ground.trials)
    cut = len(ground.model.measured)
    measured = ground.model.measured.reshape(trials, -1)
    left = ground.left[:cut].reshape(trials, -1)
    with_effects = np.full_like(left, np.nan) if found.refit is None else found.refit.left[:cut].reshape(trials, -1)
    compared, separation = found.separation
    with path.open("wb") as file:
        np.savez_compressed(
            file,
            measured=measured,
            plain=measured - left,
            with_effects=measured - with_effects,
            parts=where.parts[:, :cut].reshape(len(where.parts), trials, -1),
            compared=np.array(compared),
            separation=separation,
            forces=where.forces.mean,
            forces_sd=where.forces.sd,
        )
