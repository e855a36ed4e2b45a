"""Interface nodes act on the groups that are named after them, and yield as the unreduced body."""

from dataclasses import replace

import numpy as np
import pytest
from small_train import SMALL_STAGE

from flexgear.model.load import load_case
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.placement import Placement, check_place
from flexgear.structures.fem.assembly import FeModel, facet_sample
from flexgear.structures.fem.ties import Interface
from flexgear.structures.reduction import condense
from flexgear.structures.sources.carrier import source as carrier_source
from flexgear.structures.sources.reducing import tied
from flexgear.structures.sources.ring import source as ring_source


@pytest.fixture(scope="module")
def case() -> StageView:
    return load_case("wind-5mw", {"solver.fidelity": "quick"}).view()


def interface(case: StageView, fe_mesh: FeMesh) -> tuple[Interface, FeModel]:
    model = FeModel.of(fe_mesh, case.material)
    return tied(model, ring_source(case).nodes(model.fe_mesh)), model


@pytest.mark.parametrize("order", [1, -1])
def test_a_fit_is_tied_to_its_own_band_whichever_is_listed_first(
    case: StageView, order: int
) -> None:
    """Under u = z e_x a node moves by the mean height of what it is tied to."""
    listed = case.with_(**{"stage.ring.fe.fits": case.ring.fits[::order]})
    ties, model = interface(listed, ring_source(listed).fe_mesh())
    field = np.zeros((len(model.nodes), 3))
    field[:, 0] = model.nodes[:, 2]
    motion = (ties.rows @ field.ravel()).reshape(-1, 6)
    for k, fit in enumerate(listed.ring.fits, 1):
        node = ties.node_names.index(f"fit_{k}")
        assert ties.positions[node, 2] == fit.z
        assert motion[node, 0] == pytest.approx(fit.z)


def test_bolts_act_in_the_end_face_that_is_named(case: StageView) -> None:
    """A ring that reaches beyond its bolted face, say by a pilot."""
    fe_mesh = ring_source(case).fe_mesh()
    levels = np.unique(fe_mesh.points[:, 2].round(9))
    assert case.ring.end == "-z"
    for level in levels[:2]:
        flat = np.isclose(fe_mesh.points[:, 2], level)
        face = fe_mesh.every_facet[flat[fe_mesh.every_facet].all(axis=1)]
        _, first = np.unique(np.sort(face, axis=1), axis=0, return_index=True)
        named = replace(fe_mesh, facets={**fe_mesh.facets, "end_minus": face[first]})
        ties, _ = interface(case, named)
        assert ties.positions[ties.node_names.index("bolt_01"), 2] == pytest.approx(level)


def test_a_pin_yields_to_two_rows_as_the_unreduced_carrier_does():
    """Pressure p ~ cos of the angle on either half of the seat: equal pressures push the pin,
    opposite ones tilt it. The displacement of the unreduced carrier is a solution of K + BᵀSB
    itself. An average over all of the displacement was 19 % too stiff against tilting."""
    view = load_case("wind-5mw", {"solver.fidelity": "quick"}).view()
    model = FeModel.of(carrier_source(view).fe_mesh(), view.material)
    interface = tied(model, carrier_source(view).nodes(model.fe_mesh))
    condensation = condense(model, interface)
    supports = carrier_source(view).supports(interface.node_names, condensation.stiffness)
    node = interface.node_names.index("pin_1")
    seat = facet_sample(model, model.fe_mesh.facets["pin_1"])
    arm = seat.points - interface.positions[node]
    normal = arm * [1.0, 1.0, 0.0] / np.hypot(*arm.T[:2])[:, None]
    for across in (0, 1):
        loads, wrenches = [], []
        for half in (arm[:, 2] < 0, arm[:, 2] > 0):
            forces = (seat.weights * half * normal[:, across])[:, None] * normal
            forces /= forces[:, across].sum()
            loads.append(seat.load(forces))
            wrench = np.zeros(interface.size)
            moment = np.cross(arm, forces).sum(axis=0)
            wrench[6 * node : 6 * node + 6] = [*forces.sum(axis=0), *moment]
            wrenches.append(wrench)
        loads, wrenches = np.array(loads).T, np.array(wrenches).T
        motion = condensation.supported_solve(loads, supports)
        full = loads.T @ motion
        reduced = wrenches.T @ np.linalg.solve(condensation.stiffness + supports, wrenches)
        for rows, accepted in (([0.5, 0.5], 0.01), ([0.5, -0.5], 0.12)):
            exact = np.array(rows) @ full @ rows
            assert np.array(rows) @ reduced @ rows == pytest.approx(exact, rel=accepted)


STAGE = SMALL_STAGE.read_text()
BAND = """z_mm = {z}
half_width_mm = 4
stiffness_radial_n_per_m = 1e9
stiffness_axial_n_per_m = 1e8
stiffness_tilt_nm_per_rad = 1e5
stiffness_torsion_nm_per_rad = 5e6
"""


@pytest.fixture(scope="module")
def splined(tmp_path_factory):
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


def test_each_band_has_a_group_of_its_own_in_its_place(splined):
    fe_mesh = ring_source(splined).fe_mesh()
    check_place(fe_mesh, ring_source(splined).groups, Placement(), "generated")
    assert "spline_1" in ring_source(splined).groups.needed
    for name, middle in (("spline_1", -0.005), ("fit_1", 0.006)):
        corners = fe_mesh.points[fe_mesh.facets[name]]
        assert corners[..., 2].min() == pytest.approx(middle - 0.004)
        assert corners[..., 2].max() == pytest.approx(middle + 0.004)
        radius = np.hypot(corners[..., 0], corners[..., 1])
        assert np.ptp(radius) < 1e-12


def test_a_splined_ring_is_reduced_by_sectors_and_twists_by_its_springs(splined):
    """Free but for both bands, equal torques on all teeth twist the bands alone by T/Σk."""
    body = ring_source(splined).reduced()
    assert body.report["path"].startswith("cyclic: 72 sectors")
    assert body.report["static_error"] is not None
    b = body.interface_dofs
    supports = ring_source(splined).supports(body.node_names, body.stiffness)
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
