"""Models of tests as cases."""

import pytest
from rexs_samples import case_of_file


@pytest.fixture
def imported(tmp_path):
    """Function: model -> (case, what was assumed, what was left out)."""

    def run(model, suffix=".rexs", load_case_id=None):
        return case_of_file(model.write(tmp_path / f"model{suffix}"), load_case_id)

    return run
