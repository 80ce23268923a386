"""The free decays in the report: the numbers that were fitted, the figures whole, the flags shown."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex

from fitting.decay_fit import fit_decay
from fitting.free_decay import measure_decay_trial
from fitting.hinges import DecayFit, combine_decays
from fitting.structure import Source, Structure
from reports.dry_experiments import decay_curve_figure, free_decay_section
from reports.page import Plots, Prose, Table
from reports.style import TWIN
from tests.fitting.free_decay.decays import CAMERA, ROBOT, Truth, decay_tracks


@pytest.fixture(scope="module")
def fit() -> DecayFit:
    tracks = decay_tracks(Truth(damping_n_m_s=0.006))
    return fit_decay(measure_decay_trial("decay_1", tracks, CAMERA, ROBOT), ROBOT, workers=1)


def structure_of(*fits: DecayFit, believed: tuple[str, ...] = ("decay_1",)) -> Structure:
    """A structure of these decays, of which only some are believed."""
    used = [fit for fit in fits if fit.name in believed]
    hinges = combine_decays(used) if used else None
    source = Source("hinge_stiffness", 0.65, "N m/rad", 0.004 if used else None, believed, "")
    return Structure(ROBOT, fits, hinges, None, (source,))


def test_every_marker_is_drawn_next_to_the_twin(fit: DecayFit) -> None:
    lines = [line for line in decay_curve_figure(fit).axes[0].lines if len(line.get_xdata())]

    twin = [line.get_ydata() for line in lines if to_hex(line.get_color()) == TWIN]
    np.testing.assert_allclose(np.array(twin).T, fit.simulated_m * 1000)


def test_the_section_tells_stiffness_damping_and_frequency(fit: DecayFit) -> None:
    section = free_decay_section(structure_of(fit))
    prose, table, plots = section.blocks

    assert isinstance(prose, Prose)
    assert isinstance(table, Table)
    assert isinstance(plots, Plots)
    assert f"{fit.stiffness_n_m:.4f} ±" in prose.text or f"{fit.stiffness_n_m:.3f} ±" in prose.text
    assert len(table.rows[0]) == len(table.columns)
    assert table.rows[0][0] == "decay_1"
    assert table.rows[0][1] == f"{fit.spectrum.peak_hz:.2f}"
    assert len(plots.plots) == 2
    assert section.caveats == ()


def test_a_decay_that_is_not_believed_is_shown_but_does_not_count(fit: DecayFit) -> None:
    section = free_decay_section(structure_of(fit, replace(fit, name="bumped")))
    table = section.blocks[1]

    assert section.blocks[0].text.startswith("The free decay gives a stiffness")  # type: ignore[union-attr]
    assert [row[-1] for row in table.rows] == ["yes", "no"]  # type: ignore[union-attr]


def test_without_a_decay_to_believe_it_says_that_the_hinges_are_assumed(fit: DecayFit) -> None:
    section = free_decay_section(structure_of(fit, believed=()))

    assert section.blocks[0].text.startswith("No free decay can be believed")  # type: ignore[union-attr]
    assert section.blocks[1].rows[0][-1] == "no"  # type: ignore[union-attr]
