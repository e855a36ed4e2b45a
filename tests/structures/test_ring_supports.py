"""A ring that a spline alone holds: meshed, tied and reduced by sectors."""

import numpy as np
import pytest
from small_train import SMALL_STAGE

from flexgear.model.load import load_case
from flexgear.structures.fe_mesh.placement import Placement, check_place
from flexgear.structures.sources.of_case import ring_source

STAGE = SMALL_STAGE.read_text()
BAND = """z_mm = {z}
half_width_mm = 4
stiffness_radial_n_per_m = 1e9
stiffness_axial_n_per_m = 1e8
stiffness_tilt_nm_per_rad = 1e5
stiffness_torsion_nm_per_rad = 5e6
"""


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    before, rest = STAGE.split("[stage.ring.fe.bolts]\n")
    held = (
        "[[stage.ring.fe.splines]]\n"
        + BAND.format(z=-5)
        + "[[stage.ring.fe.fits]]\n"
        + BAND.format(z=6)
    )
    file = tmp_path_factory.mktemp("case") / "stage.toml"
    file.write_text(before + held + "[stage.carrier.fe]" + rest.split("[stage.carrier.fe]")[1])
    return load_case(
        file, {"solver.fidelity": "quick", "stage.ring.fe.fixed_interface_modes": "4"}
    ).view()


def test_each_band_has_a_group_of_its_own_in_its_place(case):
    fe_mesh = ring_source(case).fe_mesh()
    check_place(fe_mesh, ring_source(case).groups, Placement(), "generated")
    assert "spline_1" in ring_source(case).groups.needed
    for name, middle in (("spline_1", -0.005), ("fit_1", 0.006)):
        corners = fe_mesh.points[fe_mesh.facets[name]]
        assert corners[..., 2].min() == pytest.approx(middle - 0.004)
        assert corners[..., 2].max() == pytest.approx(middle + 0.004)
        radius = np.hypot(corners[..., 0], corners[..., 1])
        assert np.ptp(radius) < 1e-12


def test_it_is_reduced_by_sectors_and_its_torsion_is_the_springs(case):
    """Free but for both bands, equal torques on all teeth twist the bands alone by T/Σk."""
    body = ring_source(case).reduced()
    assert body.report["path"].startswith("cyclic: 72 sectors")
    assert body.report["static_error"] is not None
    b = body.interface_dofs
    supports = ring_source(case).supports(body.node_names, body.stiffness)
    load = np.zeros(b)
    for name in body.node_names:
        if name.startswith("tooth"):
            load[body.node_slice(name)][5] = 1.0
    q = np.linalg.solve(body.stiffness[:b, :b] + supports, load)
    torque = supports @ q
    spline, fit = (torque[body.node_slice(name)] for name in ("spline_1", "fit_1"))
    assert spline[5] + fit[5] == pytest.approx(72.0, rel=1e-9)
    assert np.abs(np.concatenate([spline[:5], fit[:5]])).max() < 1e-6
    assert q[body.node_slice("spline_1")][5] == pytest.approx(spline[5] / 5e6, rel=1e-9)


def test_holes_of_any_circle_are_numbered_through_all(tmp_path):
    before, rest = STAGE.split("[stage.ring.fe.bolts]\n")
    bolts, after = rest.split("[stage.carrier.fe]\n")
    fewer = bolts.replace("number = 8", "number = 4\nfirst_angle_deg = 22.5\nholes = true")
    held = f'[[stage.ring.fe.bolts]]\n{bolts}[[stage.ring.fe.bolts]]\nend = "+z"\n{fewer}'
    before = before.replace("thickness_mm = 9", "thickness_mm = 12")
    file = tmp_path / "stage.toml"
    file.write_text(
        f"{before}{held}[stage.carrier.fe]\n{after}".replace(
            "thickness_mm = 9", "thickness_mm = 12"
        )
    )
    case = load_case(file, {"solver.fidelity": "quick"}).view()
    fe_mesh, groups = ring_source(case).fe_mesh(), ring_source(case).groups
    check_place(fe_mesh, groups, Placement(), "generated")
    walls = {name for name in fe_mesh.facets if name.startswith("bolt")}
    assert walls == {f"bolt_{k:02d}" for k in range(9, 13)} == set(groups.needed) & walls
    assert "end_minus" in groups.needed and "end_plus" not in groups.needed
    names = tuple(node.name for node in ring_source(case).nodes(fe_mesh)[72:])
    assert names == tuple(f"bolt_{k:02d}" for k in range(1, 13))
