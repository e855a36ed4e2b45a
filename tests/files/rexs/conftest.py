"""Models of tests as cases."""

import pytest
from rexs_samples import NM, RPM, case_of_file, planetary


@pytest.fixture
def imported(tmp_path):
    """Function: model -> (case, what was assumed, what was left out)."""

    def run(model, suffix=".rexs", load_case_id=None):
        return case_of_file(model.write(tmp_path / f"model{suffix}"), load_case_id)

    return run


@pytest.fixture
def spectrum():
    """The planetary stage with two load cases."""
    m = planetary()
    m.load_cases = {
        4: {m.load: {"torque_around_u_axis": (2000.0, NM)}},
        9: {
            m.load: {"torque_around_u_axis": (1000.0, NM)},
            m.drive: {"rotational_speed": (6.0, RPM)},
        },
    }
    return m
