"""The recording that `calib view` opens: everything of a session's trials over frames and over time."""

import warnings
from collections.abc import Collection, Sequence
from pathlib import Path

import rerun as rr
from rerun.chunk import RrdReader
from rerun.error_utils import RerunWarning

from reports.numbers import listed
from reports.recording.blueprint import blueprint_of
from reports.recording.layer import Layer
from reports.recording.missing import missing_layers
from reports.recording.picture import picture_layers
from reports.recording.recorded_trial import RecordedTrial
from reports.recording.series import series_layers
from session import InputError
from session.errors import Fault
from session.results import writing_whole
from session.tracks import pixels_of

APPLICATION = "swimcal"


def write_recording(path: Path, trials: Sequence[RecordedTrial], name: str = "swimcal") -> None:
    """Write a recording for the Rerun viewer, read it back, and only then give it its name.

    Each trial has its own tree of entities ``/<trial>/…`` on two timelines, ``frame`` (its number, from 0) and
    ``time`` (that of the video), both from the start of the trial:

    - ``picture``: in pixels of the video; ``video``, ``boxes`` (colour: state of the sample), ``markers``,
      ``trails``, ``twin`` and ``residuals`` (lines from the measured to the twin's marker);
    - ``picture/missing_force``, ``missing_force_mN`` and ``missing_torque_mN_m``, once there is a diagnosis: the force
      that is missing on the head as an arrow, and a line for each of head and hinges;
    - ``confidence`` and ``residual_mm``: a line for each marker;
    - ``states/<number>_<marker>``: the frames at which the state changes;
    - ``flags``: a log, each flag at its first frame; ``summary``: the trial's numbers.

    Args:
        path: the file, ending in ``.rrd``.
        trials: the trials to show.
        name: the name that the viewer shows, such as that of the session.

    Raises:
        ResultsNotWritable: the file cannot be written; the previous one is unchanged.
        InputError: what was written cannot be read back whole.
    """
    layers = {trial.name: trial_layers(trial) for trial in trials}
    with writing_whole(path) as part:
        stream = rr.RecordingStream(APPLICATION)
        stream.save(part, default_blueprint=blueprint_of(trials))
        stream.send_recording_name(name)
        for trial in trials:
            for layer in layers[trial.name]:
                layer.send(stream, trial.time_s)
        stream.flush()
        stream.disconnect()
        check_recording(part, [layer.entity for of_trial in layers.values() for layer in of_trial])


def trial_layers(trial: RecordedTrial) -> list[Layer]:
    """Make every layer of a trial."""
    layers = [*picture_layers(trial), *series_layers(trial)]
    if trial.missing is not None:
        head_px = (pixels_of(trial.tracked)[:, trial.markers.index(name)] for name in ("nose", "neck"))
        layers += missing_layers(trial.name, trial.missing, *head_px)
    return layers


def check_recording(path: Path, entities: Collection[str]) -> None:
    """Check, without a viewer, that a recording is whole and holds these entities and a layout.

    Rerun does not report a file that it could not write whole, and only warns of one that breaks off.

    Raises:
        InputError: it cannot be read, or something is missing.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RerunWarning)
            reader = RrdReader(path)
            held = {chunk.entity_path for chunk in reader.stream()}
            missing = [*sorted(set(entities) - held), *([] if reader.blueprints() else ["its layout"])]
            found = f"nothing of {listed(missing)}" if missing else ""
    except (OSError, ValueError, RuntimeError, RerunWarning) as error:
        found = str(error)
    if found:
        expected, again = "a whole recording of Rerun", "Make it again with `calib view`."
        raise InputError([Fault(str(path), "", "cannot be read back", found, expected, next_step=again)])
