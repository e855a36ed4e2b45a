"""A stage whose slices bend each other by FE, on coarse segments of one tooth each."""

import numpy as np
import pytest
from law_response import respond
from train_contexts import coarse_teeth, rigid_stage

from flexgear.coupling.laws import COUPLED_SLICES_LAW
from flexgear.coupling.pair_data import LINE_COLUMNS
from flexgear.model.load import load_case
from flexgear.solve.static import static
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions
from flexgear.structures.tooth_influence import of_case

FE = {"stage.gear_mesh.model": "face_load", "stage.gear_mesh.tooth_compliance": "fe"}
BASE = load_case("wind-5mw").with_(**FE)
CYCLE = 2 * np.pi / BASE.view().stage.ring.teeth * np.arange(6) / 6
COARSE = SegmentDivisions(flank=5, fillet=2, tooth=2, layers=8)


@pytest.fixture(scope="module")
def teeth():
    return coarse_teeth(BASE.view(), COARSE, teeth=1, held_radius=None, margin=0.0)


@pytest.fixture
def assembled(monkeypatch, teeth):
    monkeypatch.setattr(of_case, "tooth_influence", lambda view, slot: teeth[slot])
    return lambda **changes: rigid_stage(BASE.with_(**changes))


def test_the_nominal_tangent_is_that_of_lines_that_touch_evenly(assembled):
    """Two rows of half the stiffness each, not coupled: by the law itself, at the rated load of a
    line in the middle of the path, pressed in parallel and not by an even load."""
    model = assembled()
    of_case, count = model.system.pairs, 15
    for m in (0, 5):  # ring and sun of planet 1
        table = of_case.slice_table[of_case.table[m]]
        middle = int(np.argmax(of_case.k_table[of_case.table[m]]))
        radius, lines = table[middle, 0], table[middle, LINE_COLUMNS:].copy()
        centre, nominal = of_case.z_table[of_case.table[m], middle], table[middle, 1]
        lines[:count] = 0.5 * (1.0 + (lines[:count] - centre) / radius)
        parameters = np.concatenate([[count, 0.0, 0.0], lines])
        approach = 0.5 * model.rated[0] / nominal
        _, force, tangent = respond(
            COUPLED_SLICES_LAW, parameters, np.array([[approach] * 2, [0.0] * 2])
        )
        assert force[0].sum() == pytest.approx(nominal * approach, rel=0.1)
        np.testing.assert_allclose(tangent[0] / nominal, [[0.5, 0.0], [0.0, 0.5]], atol=0.05)


def test_half_the_load_is_softer_per_load(assembled):
    """Hertz's line contact is: more than half the deflection remains at half the torque."""
    model = assembled(**{f"stage.errors.{g}_tooth": 0.0 for g in ("ring", "planet", "sun")})
    half, full = (
        static(model, CYCLE, share * model.system.rated_torque).transmission_error
        for share in (0.5, 1.0)
    )
    ratio = (half / full).sel(flank="stage sun 1 drive").mean().item()
    assert 0.5 < ratio < 0.65
