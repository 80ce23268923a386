"""`calib doctor`: what is right, what could be better, and what is wrong, each with what to do."""

from pathlib import Path

import pytest

import calib as front
from calib import checkup
from swimcal.tracks import load_tracks, save_tracks
from tests.calib.door import PLAN, Front, edit
from tests.calib.test_left_out import change_tracks, lose_the_tail
from tests.reports.recording.trials import write_video
from tests.tracking.video.clips import Clip


def test_an_installation_that_works_has_no_fault(calib: Front) -> None:
    outcome = calib("doctor")
    assert outcome.code == 0, outcome.out
    assert "ok     engine: MuJoCo" in outcome.out
    assert "ok     packages: as required" in outcome.out


@pytest.mark.long
def test_a_session_is_checked_with_its_results_and_what_would_help(finished: Path) -> None:
    found = front.doctor(finished)
    assert found.loc["session"].state == "ok"
    assert found.loc["swim trials"].found == "1 to fit, 1 held out"
    assert "Two fit trials" in found.loc["swim trials"].step
    assert "fit of quick effort, no posterior" in found.loc["results"].found
    assert "docs/bench.md" in found.loc["dry experiments"].step


def test_each_swim_is_measured_and_nothing_is_written(fresh: Path) -> None:
    edit(fresh / "session.toml", "commanded_hz = 1.35", "commanded_hz = 2.6")
    change_tracks(fresh, "slow", lose_the_tail)
    found = front.doctor(fresh)
    assert found.loc["swim slow"].state == "fault"
    assert "usable tail marker" in found.loc["swim slow"].found
    assert "mm/s" in found.loc["swim fast"].found
    assert found.loc["flag of fast"].state == "advice"
    assert "% off the commanded" in found.loc["flag of fast"].found
    assert not (fresh / "results").exists()


def add_film(session: Path, file: str) -> None:
    toml = session / "session.toml"
    trial = f'[[trial]]\nname = "film"\nkind = "swim"\nvideo = "{file}"\ncommanded_hz = 1.0\n'
    toml.write_text(f"{toml.read_text()}\n{trial}")


def test_a_film_that_is_cut_short_is_to_be_copied_again(fresh: Path) -> None:
    film = Clip(".avi", "mjpeg", pixels="yuvj420p").write(fresh)
    film.write_bytes(film.read_bytes()[:20_000])
    add_film(fresh, film.name)
    found = front.doctor(fresh).loc["film film"]
    assert found.state == "advice"
    assert "; the file ends after 11 of 40 frames, at 0.333 s: copy it again from the card" in found.found


def test_a_film_without_tracks_is_opened(fresh: Path) -> None:
    write_video(fresh / "film.mp4")
    add_film(fresh, "film.mp4")
    found = front.doctor(fresh).loc["film film"]
    assert (found.state, "calib track" in found.step) == ("advice", True)
    assert "px, h264" in found.found
    (fresh / "film.mp4").write_bytes(b"no film")
    assert front.doctor(fresh).loc["film film"].state == "fault"


def test_a_swim_that_is_called_a_dry_run_is_told(fresh: Path) -> None:
    head, first, *rest = (fresh / "session.toml").read_text().split('kind = "swim"')
    (fresh / "session.toml").write_text(head + 'kind = "dry"' + 'kind = "swim"'.join([first, *rest]))
    found = front.doctor(fresh)
    (name,) = (check.removeprefix("dry run ") for check in found.index if check.startswith("dry run "))
    assert found.loc[f"dry run {name}"].state == "ok"
    assert found.loc[f"flag of {name}"].found.str.contains("is this a swim?", regex=False).any()


def test_a_swim_without_its_command_is_a_fault_before_a_fit_is(calib: Front, fresh: Path) -> None:
    file = fresh / "session.toml"
    file.write_text("".join(line for line in file.read_text().splitlines(True) if not line.startswith("commanded_hz")))
    outcome = calib("doctor", fresh)
    assert outcome.code == 2
    assert "FAULT  commands: no commanded_hz: " in outcome.out


def test_a_session_with_nothing_to_fit_is_a_fault(calib: Front, fresh: Path) -> None:
    file = fresh / "session.toml"
    file.write_text(file.read_text().replace('role = "fit"', 'role = "holdout"'))
    outcome = calib("doctor", fresh)
    assert outcome.code == 2
    assert 'Give the trials to be fitted role = "fit".' in outcome.out


def test_a_broken_session_is_a_fault_with_all_that_is_wrong(calib: Front, fresh: Path) -> None:
    (fresh / "session.toml").write_text("nonsense")
    outcome = calib("doctor", fresh)
    assert outcome.code == 2
    assert f"FAULT  session: {fresh / 'session.toml'}" in outcome.out


def test_a_package_of_another_version_and_a_motor_that_is_not_there_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkup, "requires", lambda _: ["numpy>=99", "nonsense-of-ours", "nothing; python_version<'3'"])
    monkeypatch.setattr("calib.capture.trials.ports", list)
    found = front.doctor(motor=True)
    assert "numpy" in found.loc["packages"].found
    assert "nonsense-of-ours is missing" in found.loc["packages"].found
    assert (found.loc["motor"].state, found.loc["packages"].state) == ("fault", "fault")


def test_swims_are_compared_with_one_another(fresh: Path) -> None:
    slow = load_tracks(fresh / "trials" / "slow.csv.gz", PLAN.markers, 60.0)
    save_tracks(fresh / "trials" / "cut.csv.gz", slow.isel(time=slice(6, None)))
    edit(fresh / "session.toml", "trials/fast.csv.gz", "trials/cut.csv.gz")
    found = front.doctor(fresh)
    assert found.loc["flag of fast"].found.str.contains("frames are frames of slow, too").any()


def test_a_recording_with_two_names_is_told_of_both(fresh: Path) -> None:
    edit(fresh / "session.toml", "trials/fast.csv.gz", "trials/slow.csv.gz")
    found = front.doctor(fresh)
    assert "its recording is that of slow" in found.loc["swim fast"].found
    assert "its recording is that of fast" in found.loc["swim slow"].found
