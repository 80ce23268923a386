"""Pairs of sessions out of public trials of the real robot: its real water, with a fault put into the second's pixels.

The trials are split into a reference and a second session in four ways. What differs between two real launches is in
every pair; a fault of the camera, the clock or the tracker is in some.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from benchmarks.effects.changes import CHANGED, REFERENCE, ChangeAnswer, ChangePlan, missing
from benchmarks.effects.pictures import PictureFault, PixelTracks, clock, drift, lens, offset, shutter
from benchmarks.effects.suite import in_turn
from swimcal.create_session import FISHSIM_FPS, FISHSIM_MARKERS, FISHSIM_SCALE_M, new_folder, write_session_toml
from swimcal.tracks import as_tracks, load_tracks, pixels_of, save_tracks

SPLITS = (
    (("f0_50", "f1_00", "f1_75"), ("f0_75", "f1_25")),
    (("f0_50", "f1_25", "f1_75"), ("f0_75", "f1_00")),
    (("f0_50", "f0_75", "f1_75"), ("f1_00", "f1_25")),
    (("f0_75", "f1_00", "f1_75"), ("f0_50", "f1_25")),
)
"""Trials of the reference and of the second session."""
FAULTS: Mapping[str, Callable[[float], PictureFault]] = {
    "time_base_error": lambda sign: clock(1 + 0.06 * sign),
    "head_frame_misalignment": lambda sign: offset("neck", 0.010 * sign),
    "tracker_drift": lambda sign: drift("tail_4", 0.006 * sign),
    "marker_offset": lambda sign: offset("tail_3", 0.012 * sign),
    "lens_distortion": lambda _sign: lens(-0.08),
    "rolling_shutter": lambda _sign: shutter(0.025),
}
"""Faults by the effect that tells them, from a sign; sizes of the issue that asked for these pairs."""
_SIZE_PX = np.array([3840.0, 2160.0])


def plan_real(seed: int, healthy: int, changed: int) -> tuple[ChangePlan, ...]:
    """Plan pairs: the untouched splits in turn, then faults in turn on splits in turn."""
    effects = [*[None] * healthy, *in_turn(tuple(FAULTS), changed, np.random.default_rng([seed, 83]))]
    return tuple(ChangePlan(f"p{n:03d}", n, effect) for n, effect in enumerate(effects))


def make_real(folder: Path, source: Path, plans: tuple[ChangePlan, ...]) -> int:
    """Make the pairs that are missing from the track files of `source`; return how many.

    Raises:
        InputError: a file is missing or faulty.
    """
    todo = missing(folder, plans)
    for plan in todo:
        sign = -1.0 if plan.seed % 2 else 1.0
        for label, trials in zip((REFERENCE, CHANGED), SPLITS[plan.seed % len(SPLITS)], strict=True):
            fault = FAULTS[plan.change](sign) if plan.change and label == CHANGED else None
            _write(folder / plan.name / label, source, trials, fault)
        right = () if plan.change is None else (plan.change,)
        ChangeAnswer(plan.name, "real", plan.change, right, sign, plan.seed).write(folder)
    return len(todo)


def _write(folder: Path, source: Path, trials: tuple[str, ...], fault: PictureFault | None) -> None:
    with new_folder(folder) as part:
        tables, fps = [], FISHSIM_FPS
        for name in trials:
            position_px = pixels_of(load_tracks(source / f"{name}.csv", FISHSIM_MARKERS, FISHSIM_FPS))
            head_px = np.linalg.norm(position_px[:, 0] - position_px[:, 1], axis=1)
            seen = PixelTracks(
                np.arange(len(position_px)) / FISHSIM_FPS,
                position_px,
                FISHSIM_MARKERS,
                float(np.median(head_px)) / FISHSIM_SCALE_M,
                _SIZE_PX,
            )
            seen = seen if fault is None else fault(seen)
            fps = round(1 / float(seen.time_s[1] - seen.time_s[0]), 3)
            present = np.isfinite(seen.position_px).all(axis=-1).astype(float)
            save_tracks(part / f"trials/{name}.csv", as_tracks(FISHSIM_MARKERS, seen.time_s, seen.position_px, present))
            hz = float(name[1:].replace("_", "."))
            tables.append(
                {"name": name, "kind": "swim", "tracks": f"trials/{name}.csv", "commanded_hz": hz, "role": "fit"}
            )
        camera = {"fps": fps, "scale_length_m": FISHSIM_SCALE_M}
        write_session_toml(part, name=folder.name, camera=camera, markers=FISHSIM_MARKERS, trials=tables)
