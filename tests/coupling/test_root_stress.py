"""Root stress in results: of slices, of neighbours, both sides of a tooth."""

from dataclasses import replace

import numpy as np
import pytest
from beam_planet import beam_planet
from coupled import make_bodies
from plain_meshes import annulus
from train_contexts import rigid_stage

import flexgear as fg
from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.line_loads import line_loads
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case
from flexgear.model.names import BodyName
from flexgear.results.stage_figures import root_figures
from flexgear.solve import bodies, stresses
from flexgear.solve.dataset import equilibrium_data
from flexgear.solve.deformed import deformed
from flexgear.solve.model import model_of
from flexgear.solve.static import position_figures, static
from flexgear.solve.stresses import ring_roots, tooth_roots
from flexgear.solve.transient import simulate
from flexgear.structures.bodies import rigid_motion, rigid_variant, rotation
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions
from flexgear.structures.surface_strain import FieldAt
from flexgear.structures.tooth_influence import roots as tables
from flexgear.structures.tooth_influence.roots import root_influence, root_segment

CASE = load_case(
    "wind-5mw",
    {
        "stage.gear_mesh.model": "face_load", "stage.gear_mesh.root_stress": "fe",
        "stage.gear_mesh.slices": "5",
        "stage.face_width_mm": "150", "stage.ring.fe.fits": "[]",
    },
)  # fmt: skip
CYCLE = 2 * np.pi / CASE.view().stage.ring.teeth * np.arange(3) / 3
COARSE = SegmentDivisions(flank=4, fillet=4, tooth=2, rim=3, layers=4)


@pytest.fixture(scope="module")
def roots():
    """Influences of coarse submodels, not kept."""
    view = CASE.view()
    steel = view.material.young_modulus, view.material.poisson_ratio
    influences = {
        slot: root_influence(replace(root_segment(view, slot), divisions=COARSE), *steel)
        for slot in ("planet", "sun", "ring")
    }
    with pytest.MonkeyPatch.context() as patch:
        for user in (tables, bodies):
            patch.setattr(user, "root_of_case", lambda view, slot: influences[slot])
        yield influences


@pytest.fixture(scope="module")
def model(roots):
    return rigid_stage(CASE)


@pytest.fixture(scope="module")
def data(model):
    turned = revolution(model.modal, CYCLE, model.system.rated_torque)
    return equilibrium_data(model, turned), turned


def flank_of(model, kind):
    return next(m for m, x in enumerate(model.system.gear_meshes) if x.kind == kind)


@pytest.mark.parametrize("kind", ["ring", "sun"])
def test_one_pair_is_what_its_slices_make_in_the_submodel(roots, model, data, kind):
    """On a contact line of the table; halfway to the next one it is the mean of both."""
    m = flank_of(model, kind)
    label = model.system.gear_meshes[m]
    path, lines = model.root_tables.path(label), line_loads(data[1])
    slot = int(np.nanargmax(data[1].pair_load[0, m]))
    place, force = data[1].pair_position[0, m, slot], lines.force[0, m, slot]
    z, width = lines.z[0, m, slot], lines.width[0, m, slot]
    for k, table in enumerate(model.root_tables.of(label)):
        at = int(np.argmin(np.abs(table.s - place)))
        s, between = table.s[at], table.s[at : at + 2].mean()
        stress, halfway, after = table.of(
            np.array([s, between, table.s[at + 1]]), np.tile(force, (3, 1))
        )
        np.testing.assert_allclose(halfway, (stress + after) / 2, rtol=1e-9)
        root = roots[table.name] if table.sense > 0 else roots[table.name].turned()
        roll = path.off_path.rolls(s + path.slope * z)[k]
        direct = np.tensordot(force, root.per_force(roll, z, width)[:, 1, 0], axes=1)
        np.testing.assert_allclose(stress[1, 0], direct, atol=1e-3 * direct.max())
        low, high = np.sort(root.roll[[0, -1]])
        on = (roll > low) & (roll < high)
        slope = np.polyfit(z[on], roll[on], 1)[0]
        assert slope == pytest.approx(root.slope, rel=1e-6)  # hand and flank
        assert stress[1, 0].max() > -0.2 * stress[1, 1].min() > 0  # stretched here, pressed there
        assert table.of(np.array([s]), 2.0 * force[None])[0] == pytest.approx(2.0 * stress)


def test_neighbours_count_where_they_are():
    """Of pairs a base pitch apart, each one tooth further on against +θ."""
    stress = np.zeros((2, 1, 3, 2, 1, 2))
    stress[:, 0, :, 0] = np.array([1.0, 10.0, 100.0])[:, None, None]
    roots = tables.PairRoots("sun", 1, -1, np.array([0.0, 1.0]), stress, np.array([-1.0, 1.0]))
    s = np.array([[0.1, 0.4, 0.7]])
    force = np.array([[[1.0], [2.0], [np.nan]]])
    tension = tooth_roots(roots, s, force, 0.3).tension[0, :, 0, 0]
    assert tension[:2] == pytest.approx([10.0 + 2.0 * 1.0, 20.0 + 1.0 * 100.0])
    assert np.isnan(tension[2])


def test_teeth_of_a_ring_collect_what_their_pairs_make(model, data):
    """A ring with a node at every tooth, its body rigid, tooth by tooth and pair by pair."""
    turned, lines = data[1], line_loads(data[1])
    field = ring_roots(model.root_tables, Recovery(turned), lines, 0)
    m = flank_of(model, "ring")
    roots, force = model.root_tables.of(model.system.gear_meshes[m])[1], lines.force[:, m]
    pitch = model.root_tables.path(model.system.gear_meshes[m]).base_pitch
    stress = tooth_roots(roots, turned.pair_position[:, m], force, pitch)
    for t, slot in np.argwhere(np.isfinite(stress.tension[:, :, 0, 0])):
        tooth_stress = field[t, turned.pair_tooth[t, m, slot], :: roots.sense]
        size = np.abs(stress.tension[t, slot]).max()
        np.testing.assert_allclose(tooth_stress[0], stress.tension[t, slot], atol=1e-6 * size)
        np.testing.assert_allclose(tooth_stress[1], stress.compression[t, slot], atol=1e-6 * size)
    by_tooth = data[0]["tooth_root_stress"].isel(fillet=0 if roots.sense > 0 else 1)
    ring = data[0]["root_stress"].sel(pair_member="gear")
    ring = ring.isel(flank=ring["flank_kind"].to_numpy() == "ring").max("flank")
    np.testing.assert_allclose(by_tooth.max("tooth"), ring, rtol=1e-6)


def test_roots_turned_twice_are_the_same(roots):
    one, two = roots["planet"], roots["planet"].turned().turned()
    np.testing.assert_array_equal(one.stress, two.stress)
    assert two.slope == one.slope


def test_root_stress_is_finite_where_a_pair_carries(model, data):
    data, turned = data
    stress = data["root_stress"]
    loaded = turned.pair_load.sum(axis=2) > 0
    assert np.array_equal(np.isfinite(stress.to_numpy()).all(axis=2), loaded)
    face = data["face_root_stress"].max("face")
    assert (face <= stress + 1e-6).where(stress.notnull(), True).all()
    assert stress.attrs["units"] == "Pa"
    figures = root_figures(data, "stage")
    assert set(figures) == {"planet", "sun", "ring"}
    for one in figures.values():
        assert one["min"] < 0.0 < one["range"] <= one["max"] - one["min"] + 1e-9
    assert figures["planet"]["range"] > 1.1 * figures["planet"]["max"]  # its teeth alternate
    assert figures["sun"]["range"] == pytest.approx(figures["sun"]["max"], rel=0.02)  # they do not


def test_figures_of_one_position(model, data):
    figures, data = {}, data[0]
    for position in range(len(CYCLE)):
        summary = position_figures(model, data.isel(position=position))["root_stress_mpa"]["stage"]
        for gear, one in summary.items():
            figures[gear] = max(figures.get(gear, 0.0), one["max"])
    whole = root_figures(data, "stage")
    assert figures == {gear: one["max"] for gear, one in whole.items()}


def test_root_stress_in_a_transient(model):
    """Chunks without samples come, too; what is not by sample is not there."""
    transient = simulate(model, duration=0.002).data
    stress = transient["root_stress"]
    assert stress.dims == ("time", "flank", "pair_member")
    assert np.isfinite(stress.where(stress["flank_sense"] == "drive", drop=True)).all()
    assert {"face_root_stress", "tooth_root_range"}.isdisjoint(transient)
    assert transient["tooth_root_stress"].max() == pytest.approx(
        stress.isel(flank=stress["flank_kind"].to_numpy() == "ring").sel(pair_member="gear").max()
    )


def test_root_stress_needs_load_along_the_face():
    with pytest.raises(fg.InputError, match=r"root_stress.*face_load"):
        load_case("wind-5mw", {"stage.gear_mesh.root_stress": "fe"})


def test_the_rim_of_an_fe_planet_adds_to_the_stress_in_its_roots(roots, monkeypatch):
    """S_u at the displacement that pictures show, tooth by tooth; the planet of beams has an FE
    mesh of one column of cells for each tooth, which moves with its node."""
    view = load_case(CASE, {"stage.planet.fe.tie": "root"}).view()
    monkeypatch.setattr(stresses, "root_of_case", lambda view, slot: roots[slot])
    planet = stage_geometry(view).planet
    body = beam_planet(planet.teeth, 0.9 * planet.root_radius, young=2.06e12)
    cut = roots["planet"].cut_points
    inner = 0.9 * np.hypot(*cut.T[:2]).min()
    mesh = annulus((planet.teeth, 1, 1), inner, planet.tip_radius, view.stage.face_width)
    tooth = np.round(np.arctan2(*mesh.points.T[1::-1]) / planet.pitch_angle).astype(int)
    tooth %= planet.teeth
    recovery = np.zeros((len(tooth), 3, len(body.mass)))
    for row, point, j in zip(recovery, np.asarray(mesh.points), tooth, strict=True):
        row[:, 6 * j : 6 * j + 6] = rigid_motion((point - body.positions[j])[None])[0]
    body = replace(
        body, points=np.asarray(mesh.points), cells=np.asarray(mesh.cells),
        recovery=recovery.reshape(-1, len(body.mass)).astype(np.float32),
    )  # fmt: skip
    bodies = {**make_bodies(view), BodyName.of(view.name, "planet"): body}
    still = [name for name in bodies if name.part != "planet"]
    system = build_system(
        view.case,
        {n: rigid_variant(b.as_body()) if n in still else b for n, b in bodies.items()},
        still,
    )
    model = model_of(view.case, system, bodies)
    data = static(model, [0.0])
    field = deformed(model, "stage.planet_1")["displacement"].to_numpy()
    turned = revolution(model.modal, np.zeros(1), system.rated_torque)
    lines = line_loads(turned)
    for m, label in enumerate(system.gear_meshes):
        force = lines.force[:, m]
        if label.planet != 0 or not np.isfinite(force).any():
            continue
        of_planet, path = model.root_tables.of(label)[0], model.root_tables.path(label)
        held = tooth_roots(of_planet, turned.pair_position[:, m], force, path.base_pitch).tension[0]
        rim = np.zeros_like(held)
        for slot in np.flatnonzero(np.isfinite(held[:, 0, 0])):
            turn = rotation((data.pair_planet_tooth.values[0, m, slot] - 1) * planet.pitch_angle)
            motion = FieldAt(body).weights(cut @ turn.T) @ field @ turn
            both = np.einsum("srqci,ci->srq", tables.both_cuts(roots["planet"]), motion)
            rim[slot] = both[0 if of_planet.sense > 0 else 1]
        assert np.abs(rim).max() > 0.05 * np.nanmax(held)
        largest = data.root_stress.sel(pair_member="planet").values[0, m]
        assert largest == pytest.approx(np.nanmax(held + rim), rel=1e-3)
