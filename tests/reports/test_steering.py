"""The section on policies: what they reach, on which twin, and that nothing is said where none was trained."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from reports import steering
from reports.context import read_swims, swims_files
from reports.report import render_report
from swimgym.course import make_course
from swimgym.policy import SHIPPED, load_policy, swim
from tests.reports.page import Page
from tests.reports.sample import made_context
from tests.reports.whole import made_circles, made_targets
from tests.swimgym.fish import fish


def test_it_tells_how_many_targets_are_reached_and_how_near_the_circle_is() -> None:
    swims = (made_targets(), made_circles())
    page = Page(render_report(replace(made_context(), policies=swims), (steering.build_steering,)))
    assert "reaches 59 of 60 random targets (91.1 % to 99.7 %, 95 % interval)" in page.text
    assert "follows a circle of 1 m at 3.0 mm from it in the mean and 5.0 mm at most" in page.text
    assert "The policy for circle is of another fit than this report" in page.text
    assert "The policy for target is of another fit" not in page.text


def test_without_a_policy_there_is_no_section() -> None:
    assert steering.build_steering(made_context()) is None


def test_swims_are_read_as_they_were_swum(tmp_path: Path) -> None:
    swum = swim(make_course("circle", 2, fish=fish(), workers=1, seconds=1.0), load_policy(SHIPPED / "circle").act)
    folder = tmp_path / "policy"
    folder.mkdir()
    assert swims_files(tmp_path) == ()
    load_policy(SHIPPED / "circle").save(folder / "circle.npz")
    swum.save(folder / "circle.swims.npz")
    (read,) = read_swims(tmp_path)
    np.testing.assert_array_equal(read.seconds, swum.seconds)
    np.testing.assert_allclose(read.path_m, swum.path[::5], atol=1e-6)
    assert (read.task, read.method, read.of_this_fit, read.radius_m) == ("circle", "search", False, 1.0)
    assert len(swims_files(tmp_path)) == 1
