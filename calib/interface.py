"""The functions behind `import calib`, one a command; the command line is a thin layer on top of them.

Commands with commands of their own are modules: `calib.camera` (board, lens, scale), `calib.capture` (scan, run,
emulate: the motor) and `calib.policy` (train, evaluate, play, aquarium).

A session is given as what `open_session` returns, or as the path of its folder. What has not changed since it was made
is not made again, so that every function returns at once where its results are current. Functions that compute are
`run`, `track`, `fit`, `posterior`, `diagnose` and `effect_test`; all others use existing results. Results are frozen
and read from finished files; every one has `to_frame()`, `summary()` and, where there is something to see, `plot`.

The same in all functions: `session` is opened, or its folder; `effort`, "quick" or "full", says how hard to search:
None takes that of the current result, without one that of the fit, without a fit "full"; `workers` are threads, 0
for all cores; `progress` is shown on standard error; `scheduler`, the address of a dask scheduler, has one of its
workers compute, which needs to see the same folder: `InputError` where none answers or is of another version; what
fails there is a plain `SwimcalError` here.

Errors are a `SwimcalError`: `InputError` (all faults of what was given, at once), `NotEnoughData`, `NotConverged`,
`SimulationDiverged`, `ModelMismatch`, `SessionLocked`, `ResultsNotWritable`.
"""

from typing import TYPE_CHECKING, Any

from calib import camera, capture, policy
from calib.computing import diagnose, effect_test, fit, posterior, run
from calib.sessions import convert_tracks, correct, load_tracks, new_session, open_session, track
from calib.showing import compare, doctor, effects, export_mjcf, load_twin, report, view
from swimcal.errors import (
    InputError,
    ModelMismatch,
    NotConverged,
    NotEnoughData,
    ResultsNotWritable,
    SessionLocked,
    SimulationDiverged,
    SwimcalError,
)
from swimcal.session import Session

if TYPE_CHECKING:
    from calib.results.fit import FitResult, StructureResult
    from calib.results.gap import EffectTest, GapResult, PosteriorResult
    from calib.results.tracks import TrackResult
    from calib.results.twin import SwimTwin, draw_robot
    from swimcal.effects.effect import Effect, Parameter

__all__ = [
    "Effect",
    "EffectTest",
    "FitResult",
    "GapResult",
    "InputError",
    "ModelMismatch",
    "NotConverged",
    "NotEnoughData",
    "Parameter",
    "PosteriorResult",
    "ResultsNotWritable",
    "Session",
    "SessionLocked",
    "SimulationDiverged",
    "StructureResult",
    "SwimTwin",
    "SwimcalError",
    "TrackResult",
    "camera",
    "capture",
    "compare",
    "convert_tracks",
    "correct",
    "diagnose",
    "doctor",
    "draw_robot",
    "effect_test",
    "effects",
    "export_mjcf",
    "fit",
    "load_tracks",
    "load_twin",
    "new_session",
    "open_session",
    "policy",
    "posterior",
    "report",
    "run",
    "track",
    "view",
]


def __getattr__(name: str) -> Any:
    """Load what functions return or take, or draw, when it is asked for: with the libraries behind it takes seconds."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from calib.results.fit import FitResult, StructureResult
    from calib.results.gap import EffectTest, GapResult, PosteriorResult
    from calib.results.tracks import TrackResult
    from calib.results.twin import SwimTwin, draw_robot
    from swimcal.effects.effect import Effect, Parameter

    results = (FitResult, StructureResult, PosteriorResult, GapResult, EffectTest, TrackResult)
    return {each.__name__: each for each in (*results, SwimTwin, draw_robot, Effect, Parameter)}[name]
