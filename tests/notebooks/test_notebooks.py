"""Every notebook runs from its first cell to its last, and says the same as the script it is paired with."""

from __future__ import annotations

import shutil
from pathlib import Path

import jupytext
import matplotlib.pyplot as plt
import nbformat
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted((ROOT / "notebooks").glob("*.py"))
MOST_BYTES = 1_500_000
each_notebook = pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A fresh one, with all that notebooks read; in its folder of notebooks they run."""
    shutil.copytree(ROOT / "datasets", tmp_path / "datasets", ignore=shutil.ignore_patterns("results"))
    shutil.copytree(ROOT / "swimcal" / "robots", tmp_path / "swimcal" / "robots")
    (tmp_path / "notebooks").mkdir()
    return tmp_path


def cells(notebook: nbformat.NotebookNode) -> list[tuple[str, str]]:
    return [(cell.cell_type, cell.source) for cell in notebook.cells]


def test_there_is_a_notebook_for_every_script_and_the_other_way_round() -> None:
    notebooks = sorted((ROOT / "notebooks").glob("*.ipynb"))

    assert SCRIPTS
    assert [script.stem for script in SCRIPTS] == [notebook.stem for notebook in notebooks]


@each_notebook
def test_script_and_notebook_hold_the_same_cells(script: Path) -> None:
    paired = nbformat.read(script.with_suffix(".ipynb"), as_version=4)

    assert cells(jupytext.read(script)) == cells(paired), f"run `jupytext --sync notebooks/{script.name}`"


@each_notebook
def test_the_committed_notebook_shows_its_figures_and_no_error(script: Path) -> None:
    paired = nbformat.read(script.with_suffix(".ipynb"), as_version=4)
    outputs = [output for cell in paired.cells if cell.cell_type == "code" for output in cell.outputs]

    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert not [output for output in outputs if output.output_type == "error" or output.get("name") == "stderr"]
    assert script.with_suffix(".ipynb").stat().st_size < MOST_BYTES


def test_the_cells_of_one_run_without_error_or_warning(
    checkout: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of the quickest, without the kernel that takes longer than all of them."""
    script = ROOT / "notebooks" / "07_a_robot_of_your_own.py"
    monkeypatch.chdir(checkout / "notebooks")
    monkeypatch.setattr(plt, "show", lambda: plt.close("all"))
    exec(compile(script.read_text(), str(script), "exec"), {})
    told = capsys.readouterr().err.splitlines()
    assert [line for line in told if not line.startswith("calib: reading ")] == []  # progress, where a step is slow


@pytest.mark.long
@each_notebook
def test_it_runs_in_a_fresh_checkout_without_error_or_warning(
    script: Path, checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("IPYTHONDIR", str(checkout / "ipython"))
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    notebook = jupytext.read(script)

    place = {"metadata": {"path": str(checkout / "notebooks")}}
    NotebookClient(notebook, timeout=600, kernel_name="python3", resources=place).execute()

    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    reported = [output.text for output in outputs if output.get("name") == "stderr"]
    assert reported == []
