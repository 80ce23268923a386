import numpy as np
import pytest

from session import Flag


@pytest.mark.parametrize("flag", [Flag("jump", ("nose",), (3, 9), "moved 80 px"), Flag("at_bound")])
def test_flag_survives_json(flag: Flag) -> None:
    assert Flag.from_json(flag.to_json()) == flag


def test_flag_json_has_the_form_of_the_contract() -> None:
    assert Flag("gap", ("neck",), (np.int64(1), np.int64(2)), "lost").to_json() == {  # type: ignore[arg-type]
        "kind": "gap",
        "markers": ["neck"],
        "frames": [1, 2],
        "message": "lost",
    }
