from pathlib import Path

import pytest

from swimcal.create_session import FISHSIM_MARKERS, new_folder, new_from_fishsim, write_session_toml
from swimcal.errors import InputError
from swimcal.robot import load_robot
from swimcal.session import load_session


def public_tracks(folder: Path, *names: str) -> Path:
    """Files as the authors have them, with other numbers."""
    folder.mkdir(parents=True)
    row = ",".join(f"{20 * k}.5,{100 + k}.0" for k in range(len(FISHSIM_MARKERS)))
    for name in names:
        (folder / f"{name}.csv").write_text(f"{row}\n" * 90)
    return folder


def test_a_checkout_and_a_folder_of_files_make_the_same_session(tmp_path: Path) -> None:
    public_tracks(tmp_path / "checkout/Data/Markers", "markers_f1_00", "markers_f2_25", "rotatedMarkers_f1_00")
    public_tracks(tmp_path / "plain", "f1_00", "f2_25")
    texts = set()
    for source in ("checkout", "plain"):
        folder = new_from_fishsim(tmp_path / f"of_{source}" / "pool", tmp_path / source)
        texts.add((folder / "session.toml").read_text())
        session = load_session(folder, load_robot)
        assert [(t.name, t.commanded_hz, t.role) for t in session.trials] == [
            ("f1_00", 1.0, "fit"),
            ("f2_25", 2.25, "holdout"),
        ]
        assert (session.camera.fps, session.camera.scale_length_m) == (60.0, 0.142)
        assert sorted(path.name for path in (tmp_path / f"of_{source}").iterdir()) == ["pool"]
    assert len(texts) == 1


def test_the_trials_to_fit_can_be_named(tmp_path: Path) -> None:
    source = public_tracks(tmp_path / "plain", "f0_50", "f1_00", "f2_25")
    (tmp_path / "pool").mkdir()  # an empty folder is no obstacle
    session = load_session(new_from_fishsim(tmp_path / "pool", source, ["f0_50", "f2_25"]))
    assert [trial.name for trial in session.trials if trial.role == "fit"] == ["f0_50", "f2_25"]


@pytest.mark.parametrize(
    ("names", "fit", "message"),
    [
        ((), (), "no tracks of the public robot fish here; found no CSV files; expected a checkout with"),
        (("other",), (), "found CSV files of other names"),
        (
            ("f1_00", "f1_75"),
            ("f1_01",),
            "found 'f1_01'; expected trials that are there; choices: f1_00",
        ),
        (("f0_50",), (), "no trial to fit; expected at least one; choices: f0_50. Name it with --fit."),
    ],
)
def test_unusable_sources_are_reported_and_leave_nothing(
    tmp_path: Path, names: tuple[str, ...], fit: tuple[str, ...], message: str
) -> None:
    source = public_tracks(tmp_path / "plain", *names)
    with pytest.raises(InputError) as caught:
        new_from_fishsim(tmp_path / "pool", source, fit)
    assert message in str(caught.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plain"]


def test_a_folder_that_is_not_empty_is_refused(tmp_path: Path) -> None:
    source = public_tracks(tmp_path / "plain", "f1_00")
    with pytest.raises(InputError, match="cannot make a session here; found something that is already there"):
        new_from_fishsim(source, source)


def test_an_interrupted_making_leaves_nothing(tmp_path: Path) -> None:
    def make() -> None:
        with new_folder(tmp_path / "pool") as part:
            (part / "half").write_text("x")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make()
    assert list(tmp_path.iterdir()) == []


def test_a_written_description_loads_back(tmp_path: Path) -> None:
    trial = {"name": "a", "kind": "dry", "motor": "a.csv", "commanded_hz": 1.0, "video": None}
    write_session_toml(
        tmp_path,
        name='a "quoted" name',
        camera={"fps": 59.94, "scale_length_m": 0.142, "calibration": None},
        markers=("nose", "neck", "fin"),
        trials=[trial],
        fit={"warmup_s": 0.5, "seed": 4},
        robot_file="robot.toml",
    )
    (tmp_path / "robot.toml").write_text("")
    (tmp_path / "a.csv").write_text("x")
    session = load_session(tmp_path, check_tracks=False)
    assert (session.name, session.camera.fps, session.warmup_s, session.seed) == (
        'a "quoted" name',
        59.94,
        0.5,
        4,
    )
    assert session.robot_file == tmp_path / "robot.toml"
    assert (session.trials[0].video, session.trials[0].kind) == (None, "dry")
