"""`import calib`: what its functions return, and that it covers what the command line does."""

import doctest
import inspect
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import typer
import xarray as xr
from numpy.typing import ArrayLike

import calib as front
from calib import cli, interface
from calib.capture.functions import _parser
from calib.entry import PACKAGES
from calib.results.result import Figures, FitFigures, GapFigures, PosteriorFigures
from calib.stages.recordings import AnyTrial, Recordings
from reports.first_screen import build_summary
from reports.gap import gap_plots
from reports.posterior import build_posterior
from reports.report import gallery
from swimcal.robot import load_robot
from swimcal.session import TrialSpec
from tests.calib import desk
from tests.calib.door import files_in
from tests.reports.diagnoses import made_diagnosed, made_everything
from tests.reports.posteriors import made_summary
from tests.reports.sample import MARKERS, made_context

QUIET = {"effort": "quick", "progress": False}
FUNCTIONS = [name for name in interface.__all__ if inspect.isfunction(getattr(interface, name))]
PUBLIC = {name: getattr(interface, name) for name in FUNCTIONS} | {
    f"{module}.{name}": getattr(getattr(interface, module), name)
    for module in ("camera", "capture", "policy")
    for name in getattr(interface, module).__all__
    if inspect.isfunction(getattr(getattr(interface, module), name))
}
"""Every public function by its name after `calib.`."""
OF_COMMAND = {
    "aquarium": "policy.aquarium",
    "convert": "convert_tracks",
    "edit": "correct",
    "mjcf": "export_mjcf",
    "new": "new_session",
    "robot": "draw_robot",
}
"""The functions that are not called as their commands."""
PRINTING = {"as_json", "verbose", "help"}
"""Options that change nothing but what is printed."""
OF_OPTION = {
    "commands": "commands_hz",
    "show": "open_viewer",
    "test": None,
}
"""The parameters that are not called as their options; `--test` of `calib diagnose` is the function `effect_test`."""
OF_ARGUMENT = {"session": "folder", "tracks": "path", "file": "robot"}
"""Of `calib new` and `calib convert`, where the function says more plainly what it takes."""


def commands_with_options() -> dict[str, set[str]]:
    """The names of arguments and options of every command, by its words."""
    found: dict[str, set[str]] = {}

    def walk(command: Any, words: tuple[str, ...]) -> None:
        if hasattr(command, "commands"):
            for name, below in command.commands.items():
                walk(below, (*words, name))
        elif words != ("capture",):  # it has a parser of its own
            found[" ".join(words)] = {parameter.name for parameter in command.params}

    walk(typer.main.get_command(cli.app), ())
    drive = next(iter(_parser("calib capture")._subparsers._group_actions)).choices  # type: ignore[union-attr]
    for name, parser in drive.items():  # type: ignore[union-attr]
        found[f"capture {name}"] = {action.dest for action in parser._actions}
    return found


COMMANDS = commands_with_options()


def examples() -> dict[str, list[doctest.DocTest]]:
    """The examples of every public name after `calib.`: of its docstring and those of its methods."""
    finder, public = doctest.DocTestFinder(), {name: getattr(interface, name) for name in interface.__all__}
    modules = {name: what for name, what in public.items() if inspect.ismodule(what)}
    public |= {f"{name}.{own}": getattr(module, own) for name, module in modules.items() for own in module.__all__}
    found = {name: finder.find(what, name, module=False, globs={"calib": front}) for name, what in public.items()}
    return {name: tests[:1] if name in modules else tests for name, tests in found.items()}


EXAMPLES = examples()


@pytest.fixture
def a_desk(whole: Path, finished_session: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with what the examples use."""
    desk.lay_out(whole.parent, whole, finished_session)
    desk.stand_in(monkeypatch)
    return whole.parent


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_public_name_has_an_example_and_none_is_skipped(name: str) -> None:
    examples = [example for test in EXAMPLES[name] for example in test.examples]
    assert examples, f"calib.{name} shows no example"
    assert not any(example.options.get(doctest.SKIP) for example in examples)


def test_the_examples_are_right(a_desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a folder with what users have; what takes minutes or a motor is replaced, see `tests.calib.desk`."""
    monkeypatch.chdir(a_desk)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    for tests in EXAMPLES.values():
        for test in tests:
            runner.run(test)
    assert runner.failures == 0


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_whatever_a_command_does_a_function_does(command: str) -> None:
    """Each has a function of its name, and each of its options a parameter, but for what is listed above."""
    name = OF_COMMAND.get(command, command.replace(" ", "."))
    assert name in PUBLIC
    parameters = set(inspect.signature(PUBLIC[name]).parameters)
    for option in COMMANDS[command] - PRINTING:
        renamed = OF_OPTION.get(option, option)
        assert renamed is None or {renamed, OF_ARGUMENT.get(option)} & parameters, f"calib.{name} has no {option}"


def test_a_finished_fit_is_read_and_nothing_is_computed(finished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = files_in(finished)
    monkeypatch.setattr("swimcal.twin.Twin.simulate", None)
    found = front.fit(str(finished), **QUIET)
    assert isinstance(found, front.FitResult)
    assert list(found.to_frame().index) == ["slow", "fast"]
    assert list(found.to_frame("coefficients").index) == list(found.coefficients._fields)
    assert "line" in found.to_frame("speed_errors").index
    assert set(found.to_frame("flags").trial) <= {"", "slow", "fast"}
    assert len(found.summary().splitlines()) <= 7
    assert found.summary().splitlines()[0] in found._repr_html_()
    own = (".swimcal.lock", "results/.output.json")  # records of the work itself
    assert files_in(finished) == {**before, **{name: files_in(finished)[name] for name in own}}


@pytest.mark.long
def test_tables_and_figures_that_there_are_not_are_reported_with_the_choices(finished: Path) -> None:
    found = front.fit(finished, **QUIET)
    with pytest.raises(front.InputError, match=r"no such table; found 'wrong'; .* choices: trials, coefficients"):
        found.to_frame("wrong")
    with pytest.raises(front.InputError, match="no such trial; found 'none'"):
        found.plot.envelope("none")


@pytest.mark.usefixtures("true_report")
def test_every_figure_of_the_report_is_a_method(finished: Path) -> None:
    """Each is asked for by the method that has it; those of a trial with its name."""
    found = front.fit(finished, **QUIET)
    fetched = set()

    class Fetched(FitFigures):
        def __getitem__(self, name: str) -> None:  # type: ignore[override]
            fetched.add(name)

    figures = Fetched(None, dict, lambda _trial: {}, ())  # type: ignore[arg-type]
    for name, method in inspect.getmembers(figures, inspect.ismethod):
        if not name.startswith("_"):
            (method("slow"), method("fast")) if "trial" in inspect.signature(method).parameters else method()
    assert set(found.plot.names) <= fetched
    assert found.plot.envelope("slow")._repr_png_().startswith(b"\x89PNG")


@pytest.mark.long
@pytest.mark.parametrize("kind", [PosteriorFigures, GapFigures])
def test_every_figure_of_posterior_and_gap_is_a_method(kind: type[Figures]) -> None:
    context = replace(made_context(), posterior=made_summary())
    plots = {
        PosteriorFigures: lambda: gallery(context, (build_summary, build_posterior)),
        GapFigures: lambda: gap_plots(made_diagnosed(everything=made_everything()), load_robot(), MARKERS),
    }[kind]
    figures = kind(SimpleNamespace(is_current=True), plots)  # type: ignore[arg-type]
    methods = [m for name, m in inspect.getmembers(figures, inspect.ismethod) if not name.startswith("_")]
    assert {method().name for method in methods} == set(figures.names)


def test_measured_and_simulated_motion_are_one_labelled_dataset(finished: Path) -> None:
    """That of the fit, though no other trial is measured again."""
    found = front.fit(finished, **QUIET)
    motion = found.motion("fast")
    assert motion.twin.dims == motion.measured.dims == ("time", "space", "keypoint")
    away = (motion.twin - motion.measured).where((motion.weight > 0) & motion.scored)
    error_mm = 1000 * float((away**2).sum("space", skipna=False).pipe(np.sqrt).mean())
    assert error_mm == pytest.approx(found.trials["fast"].marker_error_mm)
    with pytest.raises(front.InputError, match="no such trial; found 'none'"):
        found.motion("none")


def test_figures_of_a_fit_that_was_replaced_are_refused(finished: Path) -> None:
    found = front.fit(finished, **QUIET)
    (finished / "results" / "calibrated.xml").write_text("another")
    with pytest.raises(front.InputError, match="the result has been replaced"):
        found.plot.speeds()


@pytest.fixture
def measured_again(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the trials that are measured from now on."""
    names, measure = [], Recordings._measure

    def noted(self: Recordings, spec: TrialSpec, recorded: xr.Dataset) -> AnyTrial:
        names.append(spec.name)
        return measure(self, spec, recorded)

    monkeypatch.setattr(Recordings, "_measure", noted)
    return names


@pytest.mark.long
def test_a_twin_is_loaded_without_measuring_any_trial(finished: Path, measured_again: list[str]) -> None:
    twin = front.load_twin(finished)
    assert measured_again == []
    assert twin.robot == front.fit(finished, **QUIET).read().robot


def test_a_figure_of_a_trial_needs_that_trial_alone(finished: Path, measured_again: list[str]) -> None:
    found = front.fit(finished, **QUIET)
    assert found.plot.envelope("slow").name == "slow-envelope"
    assert found.plot.path("slow").name == "slow-path"
    assert measured_again == ["slow"]


def test_a_swim_beyond_the_fitted_speeds_says_so(finished: Path) -> None:
    twin = front.load_twin(finished)
    assert twin.fitted_hz is not None
    low, high = twin.fitted_hz
    found = twin.swim([0.9 * low, low, high, 1.1 * high], seconds=2.0)
    assert found.extrapolated.values.tolist() == [True, False, False, True]
    fastest = front.load_twin().swim([2.5, 3.0], seconds=1.0)  # its coefficients are of no fit, its step was checked
    assert fastest.extrapolated.values.tolist() == [False, True]
    with pytest.raises(front.InputError, match=r"faster than a tail is driven; found 16; .* at most 15"):
        twin.swim(16.0)


def test_sessions_of_one_name_are_told_apart_by_their_folders(finished: Path, tmp_path: Path) -> None:
    shutil.copytree(finished, tmp_path / "copy")
    table = front.compare([finished, tmp_path / "copy"], "coefficients")
    assert table.index.get_level_values("session").unique().tolist() == [finished.name, "copy"]


def test_a_twin_swims_as_the_fit_has_it(finished: Path) -> None:
    twin = front.load_twin(finished, effects=["tendon_slack"])
    swim = twin.swim(0.8, seconds=3.0, parameters={twin.parameters[0]: [0.0, 0.001]})
    assert swim.position.dims == ("run", "time", "space", "keypoint")
    assert swim.speed[0] != swim.speed[1]
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(front.InputError, match="no frequency"):
            twin.swim([0.8, wrong])


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"nonsense": 1.0}, "no such parameter"),
        ({"linear_drag.drag": -1.0}, "beyond what the effect may be; found -1.0; expected numbers from 0 to 10 N s/m"),
        ({"linear_drag.drag": [0.0, float("nan")]}, "beyond what the effect may be"),
        ({"linear_drag.drag": "much"}, "beyond what the effect may be"),
        ({"linear_drag.drag": [0.0, 1.0, 2.0]}, "another number of values than of runs.*expected one value, or 2"),
        ({"scale_error.relative": 0.1}, "changes what is filmed or commanded"),
    ],
)
def test_a_swim_refuses_parameters_that_mean_nothing(parameters: Mapping[str, ArrayLike], message: str) -> None:
    twin = front.load_twin(effects=["linear_drag", "scale_error"])
    with pytest.raises(front.InputError, match=message):
        twin.swim([0.8, 1.0], seconds=1.0, parameters=parameters)


def test_a_swim_from_rest_lasts_until_its_speed_has_settled() -> None:
    twin = front.load_twin()
    told, settled = (float(twin.swim(0.4, seconds=seconds).speed[0]) for seconds in (None, 80.0))
    assert told == pytest.approx(settled, rel=0.05)


@pytest.mark.parametrize("name", PACKAGES)
def test_a_file_of_the_user_that_hides_a_package_is_named(name: str, tmp_path: Path) -> None:
    (tmp_path / f"{name}.py").write_text("answer = 42\n")
    code = "import calib\ntry:\n    calib.open_session\nexcept ImportError as error:\n    print(error)"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert f"{tmp_path / name}.py hides the package `{name}`" in shown.stdout
    assert "Rename the file" in shown.stdout
    assert shown.stderr == ""


def test_a_result_shows_itself_in_one_line_with_its_numbers_and_units(whole: Path) -> None:
    """As the last line of a notebook's cell does, or a debugger."""
    session, fit = front.open_session(whole), front.fit(whole, **QUIET)
    calibration = fit.read()
    posterior, gap, tracks = front.posterior(whole, **QUIET), front.diagnose(whole, **QUIET), front.track(whole)
    with pytest.raises(front.InputError, match="no effect is named"):
        front.effect_test(whole, [], **QUIET)
    test = front.effect_test(whole, ["scale_error"], **QUIET)
    trial = calibration.trials[0]
    number = r"[−\d.,]+"
    for shown, pattern in (
        (session, r"<Session synthetic: 2 trials \(1 to fit\), 9 markers, 60 frames/s>"),
        (session.trial("slow"), r"<TrialSpec slow: swim, fit, commanded 0\.82 Hz; slow\.csv\.gz>"),
        (fit, rf"<FitResult synthetic: markers {number} mm, speed {number} mm/s off over 1 held-out trial; \w+>"),
        (
            posterior,
            rf"<PosteriorResult synthetic: \d of 5 coefficients determined; at least {number} effective draws, "
            rf"R-hat {number} at most; [\w ]+>",
        ),
        (
            gap,
            rf"<GapResult synthetic: [\w ]+, most probable [\w ]+ \({number}\); held out: "
            rf"markers {number} mm without and {number} with effects, speed {number} and {number} mm/s>",
        ),
        (test, rf"<EffectTest synthetic: scale error; log Bayes factor over the plain twin {number}>"),
        (tracks, rf"<TrackResult synthetic: 2 trials, \d+ frames, {number} % of the samples seen>"),
        (front.load_twin(whole, effects=["tendon_slack"]), r"<SwimTwin [\w .]+: blunt drag .*; effects: tendon_slack>"),
        (trial.measured, rf"<MeasuredTrial slow: fit, 0\.{number} Hz, {number} mm/s, 9 markers, \d+ frames>"),
        (
            trial,
            rf"<CalibratedTrial slow: fit, {number} Hz, {number} mm/s, twin {number} mm/s, markers {number} mm off>",
        ),
        (calibration, rf"<Calibration: 2 trials; blunt drag {number}, .*, magnus lift {number}>"),
        (fit.trials["slow"], rf"<TrialResult: fit, {number} Hz, {number} mm/s, twin .* mm/s, markers {number} mm off>"),
    ):
        assert re.fullmatch(pattern, repr(shown)), repr(shown)


def test_datasets_are_read_by_their_labels_and_plot_themselves(whole: Path) -> None:
    """Space, keypoint, run, frequency and quantile by name; axes have names and units."""
    tracks, motion = front.track(whole)["fast"], front.fit(whole, **QUIET).motion("fast")
    swims = front.load_twin(whole, effects=["tendon_slack"]).swim(
        [0.8, 1.2], seconds=3.0, parameters={"tendon_slack.length": [0.0, 0.001]}
    )
    sweep = front.posterior(whole, **QUIET).sweep
    assert tracks.trial == "fast"
    for data in (tracks.position_head, motion.twin, swims.position.isel(run=0)):
        across = data.sel(keypoint="caudal_fin", space="y")
        assert across.dims == ("time",)
        (line,) = across.plot()
        assert line.axes.get_xlabel() == "time (s)"
        assert line.axes.get_ylabel().endswith("[m]")
        plt.close()
    assert swims.sel(run=1).frequency == 1.2
    assert swims.speed.sel(frequency=1.2) == swims.speed[1]
    assert swims["tendon_slack.length"].sel(frequency=1.2) == 0.001
    (line,) = swims.speed.plot(x="frequency")
    assert line.axes.get_xlabel() == "frequency [Hz]"
    assert sweep.speed.sel(quantile=0.5).dims == ("frequency",)
    assert (sweep.another_trial.sel(quantile=0.05) < sweep.speed.sel(quantile=0.05)).all()
    plt.close()
