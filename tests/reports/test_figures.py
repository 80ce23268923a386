"""Figures show what was measured, and nothing they should not."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from diagnosis.result import DiagnosisResult
from reports import gap
from reports.forecasts import speed_sweep_figure
from reports.page import Plot, inline_svg
from reports.report import FURTHER, SECTIONS, gallery
from reports.style import INKS, TWIN, styled
from reports.swims import beat_midlines, marker_distances
from reports.tracks import flagged_kinds, picture_of_tracks
from swimcal.robot import load_robot
from tests.cases import later
from tests.reports.diagnoses import made_diagnosed, made_everything
from tests.reports.sample import MARKERS, made_calibration, made_context, made_session, made_trial
from tests.reports.whole import made_whole_context, of_trials

ROBOT = load_robot()


@pytest.fixture(scope="module")
def whole() -> dict[str, Plot]:
    """Of a session that lacks nothing."""
    return gallery(made_whole_context(), (*SECTIONS, *FURTHER))


def outside(plot: Plot) -> bool:
    """Whether something is drawn outside the frame."""
    plot.figure.canvas.draw()
    box, (width, height) = plot.figure.get_tightbbox(), plot.figure.get_size_inches()
    return bool(box.x0 < -0.02 or box.y0 < -0.02 or box.x1 > width + 0.02 or box.y1 > height + 0.02)


def test_every_figure_stays_within_its_frame(whole: dict[str, Plot]) -> None:
    assert [name for name, plot in whole.items() if outside(plot)] == []
    assert len(whole) > 30


@pytest.mark.long
@pytest.mark.parametrize("count", [9, *later(1, 2, 4, 5, 7)])
def test_it_does_so_however_many_trials_there_are(count: int) -> None:
    context = made_context(of_trials(made_calibration(flagged=count < 3), count, logged=True))
    assert [name for name, plot in gallery(context).items() if outside(plot)] == []


@pytest.mark.parametrize(
    ("found", "markers"),
    [
        (made_diagnosed("unexplained", everything=made_everything()), MARKERS),
        (made_diagnosed("named"), tuple(ROBOT.markers)),
    ],
    ids=["unexplained", "every marker"],
)
def test_figures_of_any_gap_do_so(found: DiagnosisResult, markers: tuple[str, ...]) -> None:
    context = replace(made_context(), diagnosed=found, session=made_session(markers=markers))
    plots = gallery(context, (gap.build_gap,))
    assert len(plots) >= 5
    assert [name for name, plot in plots.items() if outside(plot)] == []


def test_a_figure_shows_itself_with_its_caption_in_a_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[dict[str, Any]] = []
    monkeypatch.setattr("IPython.display.display", lambda data, **_: shown.append(data))
    tracks = picture_of_tracks(made_trial(ROBOT, "medium").measured)

    assert tracks._repr_png_().startswith(b"\x89PNG")
    tracks._ipython_display_()
    picture, caption = shown
    assert picture["image/png"] == tracks._repr_png_()
    assert caption["text/plain"].startswith(tracks.caption)
    assert caption["text/html"].startswith("<p>medium: 100 % of 1260 samples count.")
    assert tracks._repr_png_() == picture_of_tracks(made_trial(ROBOT, "medium").measured)._repr_png_()
    assert repr(tracks).startswith("Plot(name='medium-flags', caption='medium: 100 % of 1260 samples count.")


def test_midlines_of_a_beat_are_those_of_the_wave() -> None:
    trial = made_trial(ROBOT, "medium")
    measured, twin = beat_midlines(trial, ROBOT)
    shape = trial.measured.head.shape_m

    assert measured.shape == (16, len(MARKERS), 2)
    np.testing.assert_allclose(measured[..., 0], np.broadcast_to(shape[0, :, 0], (16, len(MARKERS))), atol=1e-9)
    assert np.ptp(measured[:, -1, 1]) == pytest.approx(np.ptp(shape[:, -1, 1]), rel=0.05)
    assert np.ptp(twin[:, -1, 1]) == pytest.approx(1.15 * np.ptp(measured[:, -1, 1]), rel=0.03)


def test_flagged_samples_do_not_enter_the_midlines() -> None:
    trial = made_trial(ROBOT, "medium")
    wrong = trial.measured.head.shape_m.copy()
    wrong[60:70, 4] += 1.0
    weight = trial.measured.weight.copy()
    weight[60:70, 4] = 0.0
    measured = trial.measured.seen_as(head=replace(trial.measured.head, shape_m=wrong), weight=weight)

    clean, _ = beat_midlines(trial, ROBOT)
    spoilt, _ = beat_midlines(replace(trial, measured=measured), ROBOT)

    np.testing.assert_allclose(spoilt, clean, atol=0.01)


def test_each_sample_left_out_has_a_reason_and_no_other_has() -> None:
    trial = made_trial(ROBOT, "slow", flagged=True).measured
    kinds = flagged_kinds(trial)

    assert ((kinds != "") == (trial.weight <= 0)).all()
    assert set(kinds[100:140, MARKERS.index("tail_3")]) == {"merged_markers"}
    assert set(kinds[20:25, MARKERS.index("neck")]) == {"jump"}
    assert set(kinds[20:25, MARKERS.index("tail_1")]) == {"head not trusted"}


def test_a_marker_too_little_seen_in_the_compared_frames_is_told_so_although_the_warm_up_shows_it() -> None:
    trial = made_trial(ROBOT, "slow").measured
    weight = trial.weight.copy()
    weight[trial.kept, 4] = 0.0
    kinds = flagged_kinds(trial.seen_as(weight=weight))

    assert (weight[:, 4] > 0).any()
    assert set(kinds[trial.kept, 4]) == {"unread_marker"}
    assert (kinds[:, 5] == "").all()


def test_flags_count_from_the_recording_and_samples_from_the_trials_first_frame() -> None:
    trial = made_trial(ROBOT, "slow", flagged=True).measured
    kinds = flagged_kinds(trial)
    later = replace(trial, first_frame=70, flags=tuple(flag.later(70) for flag in trial.flags))

    assert (flagged_kinds(later) == kinds).all()
    assert set(kinds[100:140, MARKERS.index("tail_3")]) == {"merged_markers"}


def test_marker_distances_average_to_the_score_of_the_trial() -> None:
    trial = made_trial(ROBOT, "slow", flagged=True)
    distance, shape, share = marker_distances(trial)
    used = share / share.sum()

    assert float(distance @ used) == pytest.approx(trial.scores.marker_error_m)
    assert float(shape @ used) == pytest.approx(trial.scores.shape_error_m)
    assert float(share.mean()) == pytest.approx(trial.scores.used_fraction)


@styled
def labelled() -> Figure:
    figure = Figure()
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color=TWIN)
    axes.text(0.5, 0.5, "12.375 <b> & $x_1$ #0a6ebd")
    return figure


def test_every_colour_is_left_to_the_page_and_stands_without_it() -> None:
    svg = inline_svg(speed_sweep_figure(made_calibration()), "sweep", "Speed")
    bare = re.sub(r"var\(--([\w-]+), (#[0-9a-f]{6})\)", "", svg)

    assert re.findall(r"#[0-9a-f]{6}\b(?!\w)", re.sub(r'(id|href)="[^"]*"|url\([^)]*\)', "", bare)) == []
    assert (
        dict(re.findall(r"var\(--([\w-]+), (#[0-9a-f]{6})\)", svg)).items()
        <= {name: ink.light for name, ink in INKS.items()}.items()
    )


def test_ids_belong_to_the_figure() -> None:
    svg = inline_svg(labelled(), "first", "A line")

    assert set(re.findall(r'\bid="(\w+)-', svg)) == {"first"}
    assert set(re.findall(r'url\(#(\w+)-|href="#(\w+)-', svg)) <= {("first", ""), ("", "first")}


def test_text_keeps_its_digits_and_is_escaped() -> None:
    svg = inline_svg(labelled(), "first", 'a "quoted" <name>')

    assert "12.375 &lt;b&gt; &amp; $x_1$ #0a6ebd</text>" in svg
    assert 'aria-label="a &#34;quoted&#34; &lt;name&gt;"' in svg
