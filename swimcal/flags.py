"""Flags: what makes the numbers of a sample, a trial or a fit doubtful.

A `Flag` is no error: it says what is doubtful, with the number that it concerns; `FLAG_KINDS` lists all kinds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

FLAG_KINDS: dict[str, str] = {
    "merged_markers": "two markers sit on one spot",
    "frozen_marker": "a marker does not move while its neighbours do",
    "jump": "a marker, or the whole body, moves further between two frames than it can",
    "segment_length": "the distance to the neighbouring marker is implausible",
    "gap": "samples are missing",
    "lost_marker": "the tracker does not see a marker",
    "only_csrt": "no spot answers, only CSRT sees the marker",
    "drift": "a marker has lost its appearance for a while; the tracker may have drifted onto something else",
    "size": "a marker appears in another size",
    "swap": "markers seem to be exchanged",
    "edited": "a person corrected the track",
    "doubtful_box": "a start box may hold no marker",
    "indistinct": "no grey tells a marker from its surroundings",
    "damaged_video": "part of the video cannot be read",
    "few_frames": "markers move between two frames by more than half the distance to their neighbours",
    "exchanged_frames": "frames are shown in exchanged order",
    "uneven_stamps": "time stamps are uneven, the frames are not",
    "repeated_frames": "frames repeat the one before",
    "no_lens": "the lens is not calibrated",
    "no_camera_height": "the camera's height is not known, so parallax is not undone",
    "lens_other_size": "the lens was calibrated for pictures of another size",
    "camera_height_off_scale": "the camera's height does not fit the scale of the tracks",
    "lens_folds": "the lens calibration has no meaning near the corners of the picture",
    "tendon_pushes": "a tendon of the twin pushes where a string would be slack",
    "tendon_stretch": "the tendons of the twin stretch otherwise than published",
    "too_short": "the recording is too short for the estimate to be trusted",
    "trials_disagree": "trials give different values",
    "head_moves": "the head is not clamped",
    "poor_fit": "the twin does not follow the recording",
    "clipped": "a marker leaves the picture, merges or is cut off at its largest swings",
    "decays_disagree": "decays give different values",
    "double_peaked": "the spectrum has a second peak as high",
    "moved_again": "the tail was moved again after its release",
    "no_release": "the moment of release was not found",
    "code_not_seen": "the coded wiggle of the motor was not found in the video",
    "clock_given": "the offset between video and motor log was not found, it is that of session.toml",
    "clock_rate": "the clocks of video and motor log run at implausibly different rates",
    "short_log": "the motor log does not cover what is compared",
    "log_gap": "readings are missing from the motor log",
    "misread_position": "single readings of the motor's position cannot be, and are left out",
    "position_jump": "the counter of the motor's position jumps by whole turns, which are taken out",
    "motor_error": "the motor reported an error",
    "motor_slow": "the motor turned otherwise than commanded",
    "supply_sags": "the supply voltage of the motor sags",
    "beat_off_crank": "the tail beats at another frequency than the crank turns",
    "other_command": "the motor was commanded another speed than the session states",
    "truncated_log": "the last row of a log is cut short",
    "not_used": "an experiment is not believed and was left out",
    "fit_outside": "the fit lies outside its own posterior interval",
    "outside_bands": "a fitted trial lies outside its own predicted band",
    "wide_bands": "predictive bands are wider than the trials need",
    "markers_off": "markers sit elsewhere than the robot's description has them",
    "robot_off": "the recordings support another robot than the described one",
    "at_bound": "an estimate sits at the bound of its range",
    "not_converged": "the optimiser stopped before it converged",
    "restarts_disagree": "different starts end at different estimates",
    "ebt_ratio_only": "of elongated body theory only c_D / beta is identifiable",
    "unidentifiable": "the data do not determine this number",
    "no_command": "the commanded frequency is not known",
    "frequency_off_command": "the swim frequency differs from the command",
    "scale_off_robot": "the scale of the picture does not fit the robot",
    "path_wobbles": "the head goes to and fro besides the beat",
    "marker_creeps": "a marker slides aside of its neighbours during the trial",
    "scale_apart": "nose and neck are not as far apart in the picture as in the other swims",
    "scale_drifts": "nose and neck come closer together, or part, during the trial",
    "rests": "the tail does not beat for a part of the trial",
    "leaves_picture": "nose and neck are not seen any more before the trial ends",
    "unread_marker": "a marker is seen too little to take part",
    "carried": "the robot slips aside as in no other swim",
    "tail_first": "the robot swims tail first",
    "unsteady": "the speed changes during the trial",
    "turns": "the course bends so much that the net displacement is shorter than the path",
    "shared_frames": "a swim shares frames with a fit trial",
    "left_out": "a trial takes no part",
    "far_from_twin": "the trial's own twin is far from it",
    "speed_missed": "the twin misses the speed of a trial it was fitted to",
    "ebt_noise": "the tail speed that elongated body theory takes as published is mostly noise",
    "no_ebt": "the tail does not show what elongated body theory needs",
    "few_beats": "too few beats for a frequency to be trusted",
    "swims_backward": "started from rest, the fitted twin swims backward",
    "time_step": "with its time step the twin swims at another speed than with fine steps",
    "rejected_restart": "closer coefficients were rejected because their twin swims backward from rest",
    "emulator_off": "the emulator of the twin misses it by more than it may",
    "model_discrepancy": "the twin itself is off by more than noise and nuisances explain",
    "noise_not_white": "the errors of the tracks are not as the posterior takes them to be",
    "extrapolated": "outside the range of the trials that were fitted",
}
"""The kinds of flag and what each means. Later stages may use further kinds of their own."""


@dataclass(frozen=True)
class Flag:
    """One thing that is doubtful, in a sentence for the reader of the report.

    Attributes:
        kind: one of `FLAG_KINDS`, or a later stage's own.
        markers: the markers concerned; empty where it is not about markers.
        frames: first and last frame concerned, both included; None for the whole trial or fit.
    """

    kind: str
    markers: tuple[str, ...] = ()
    frames: tuple[int, int] | None = None
    message: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return the flag in the form of the public contract."""
        frames = None if self.frames is None else [int(frame) for frame in self.frames]
        return {"kind": self.kind, "markers": list(self.markers), "frames": frames, "message": self.message}

    def later(self, first: int) -> Flag:
        """Return the same flag for a recording that begins `first` frames earlier."""
        return self if self.frames is None else replace(self, frames=(self.frames[0] + first, self.frames[1] + first))

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Flag:
        """Read what `to_json` wrote."""
        frames = None if data.get("frames") is None else (int(data["frames"][0]), int(data["frames"][1]))
        return cls(data["kind"], tuple(data.get("markers", ())), frames, data.get("message", ""))
