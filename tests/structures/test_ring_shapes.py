"""What the rim of an FE ring yields along the face within a tooth, beyond the rigid motion of its
node: against the whole ring's FE mesh, its symmetries and limits, and when it counts."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from flexgear.coupling.build import build_system
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.results.report.tables import rim_rows
from flexgear.structures import estimate
from flexgear.structures.bodies import rigid_motion, rotation, turn
from flexgear.structures.estimate import PROMISED
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions
from flexgear.structures.fem.assembly import facet_sample, point_sample
from flexgear.structures.fem.ties import averaging_tie
from flexgear.structures.reduced import ReducedBody, normal_displacement
from flexgear.structures.sources.of_case import fe_sources
from flexgear.structures.sources.planet import source as planet_source
from flexgear.structures.sources.ring import source as ring_source
from flexgear.structures.tooth_influence import of_case, rim
from flexgear.structures.tooth_influence.influence import influence_of
from flexgear.structures.tooth_influence.rim import (
    cut_flexibility,
    rim_flexibility,
    shape_tie,
)

OPTIONS = {
    "solver.fidelity": "quick", "stage.gear_mesh.model": "face_load",
    "stage.gear_mesh.tooth_compliance": "fe", "stage.gear_mesh.slices": "5",
}  # fmt: skip
CASE = load_case("ev-reducer", OPTIONS).view()
FLEXIBLE_PLANET = {"stage.planet.bore_diameter_mm": "40", "stage.planet.fe.tie": "root"}
THIN_PLANET = load_case("ev-reducer", {**OPTIONS, **FLEXIBLE_PLANET})
TEETH = CASE.ring_gear.teeth
TOOTH = 20  # any but those whose answers are kept
COARSE = SegmentDivisions(flank=4, fillet=2, tooth=2, rim=2, layers=4)


class Gear:
    """A thin wide gear on its supports: FE model, condensation, flexibility of its nodes, rim."""

    def __init__(self, source):
        self.teeth = source.parameters.teeth
        self.model, self.condensed = source.condensed()
        self.stiffness = self.condensed.stiffness
        self.supports = source.supports(self.condensed.interface.node_names, self.stiffness)
        segment = source.segment
        self.tooth = segment.tooth
        self.first, self.cut = rim.first_line(segment), rim.cut_of(segment)
        self.shapes = rim.shape_displacements(
            self.model, self.condensed, self.first, self.teeth, self.cut
        )
        self.rim = rim_flexibility(self.shapes, self.stiffness, self.supports, self.first)
        self.held = np.linalg.inv(self.stiffness + self.supports)

    def nodes(self, one, two):
        """Flexibility (6, 6) between the nodes of two teeth, along their axes."""
        block = self.held[6 * one : 6 * one + 6, 6 * two : 6 * two + 6]
        return turn(-2 * np.pi * one / self.teeth) @ block @ turn(2 * np.pi * two / self.teeth)


class Line:
    """Points along a −θ flank at pitch height: rows (m, 3n) of the motion along the normal there,
    G (m, 6 + shapes), and a load (m,) N that changes along the face."""

    def __init__(self, ring, tooth):
        share, weights = np.polynomial.legendre.leggauss(12)
        self.line = replace(ring.first, angle=2 * np.pi * tooth / ring.teeth)
        flank = estimate._Flank(ring.model, f"tooth_flank_{tooth + 1:03d}")
        z = 0.5 * self.line.face_width * share
        points, normals = flank.at(self.line.radius, z)
        sample = point_sample(ring.model, points, weights, slack=estimate._SLACK)
        parts = [sp.diags_array(n) @ sample.interpolation for n in normals.T]
        self.rows = sp.kron(parts[0], [[1, 0, 0]])
        for c in (1, 2):
            self.rows = self.rows + sp.kron(parts[c], [np.eye(3)[c]])
        self.rows = sp.csr_matrix(self.rows)
        back = rotation(self.line.angle)  # row vectors turn by its transpose
        self.motion = normal_displacement(ring.first, ring.rim.less, points @ back, normals @ back)
        self.load = weights * (1.0 + 2.0 * (1.5 * share**2 - 0.5) + 0.5 * share)
        self.even, self.tilt = np.ones_like(share), share

    def bent(self, motion):
        """What of a motion (m,) is neither even nor tilted."""
        flat = np.column_stack([self.even, self.tilt])
        return motion - flat @ np.linalg.lstsq(flat, motion, rcond=None)[0]


def gear_of(source):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rim, "SAMPLED_TEETH", 1)  # all are alike
        return Gear(source)


@pytest.fixture(scope="module")
def ring():
    """In a spline."""
    return gear_of(ring_source(CASE))


@pytest.fixture(scope="module")
def planet():
    """On its bearing; the rim is two modules thick."""
    return gear_of(planet_source(THIN_PLANET.view()))


@pytest.fixture(params=["ring", "planet"])
def gear(request):
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module")
def bending():
    """Path of the ring gear mesh and how its slices bend each other, by coarse segments."""

    forces = power_flow(CASE.case).stages[0].gear_mesh_forces
    path, force = stage_paths(CASE, forces)["ring", ""], forces["ring"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(of_case, "tooth_influence", coarse)
        return path, of_case.pair_bending(CASE, path, path.slices, force)


def coarse(case, slot):
    """Influence by a coarse segment."""
    parameters = replace(of_case.influence_parameters(case, slot), divisions=COARSE)
    return influence_of(parameters, 2.06e11, 0.3, tied=of_case.is_tied(case, slot))


def solved(ring, line):
    """Motion (3n,) of the whole ring on its supports under the load of a line."""
    load = line.rows.T @ line.load[:, None]
    form = ring.condensed.field_of(load)
    field = ring.condensed.supported_solve(form, ring.supports)
    return ring.condensed.dofs_of(field, ring.model.dofs)[:, 0]


def test_a_tooth_bends_along_its_face_as_in_the_whole_gear(gear):
    """Piece of the gear and node together miss a sixth of how the tooth bends along its face under
    a line load that changes there; with the rim's shapes it is a few per cent."""
    line = Line(gear, TOOTH)
    piece = cut_flexibility(gear.model, line.line, line.rows, gear.teeth, gear.cut)
    root = facet_sample(gear.model, gear.model.fe_mesh.facets[f"tooth_root_{TOOTH + 1:03d}"])
    tie = averaging_tie("tooth", line.line.place, root).rows
    held = cut_flexibility(gear.model, line.line, tie, gear.teeth, gear.cut)
    held = turn(-line.line.angle) @ held @ turn(line.line.angle)
    rigid = line.motion[:, :6]
    node = rigid @ (gear.nodes(TOOTH, TOOTH) - held) @ rigid.T
    rim_alone = line.motion @ gear.rim.tooth @ line.motion.T
    truth = line.rows @ solved(gear, line)
    size = np.abs(line.bent(truth - node @ line.load)).max()
    without, with_shapes = (
        np.abs(line.bent(truth - (piece + node + more) @ line.load)).max() / size
        for more in (0.0 * rim_alone, rim_alone)
    )
    print(f"\nown: {100 * without:.1f} % without, {100 * with_shapes:.1f} % with shapes")
    assert without > 0.15
    assert with_shapes < 0.08


@pytest.mark.parametrize(("steps", "share"), [(1, 0.5), (2, 0.65)])
def test_the_next_teeth_bend_with_it(gear, steps, share):
    """What their nodes alone leave of that, the rim's shapes nearly halve and more."""
    line, beyond = Line(gear, TOOTH), Line(gear, TOOTH + steps)
    node = line.motion[:, :6] @ gear.nodes(TOOTH, TOOTH + steps) @ beyond.motion[:, :6].T
    rim_alone = line.motion @ gear.rim.beside[steps - 1] @ beyond.motion.T
    truth = line.rows @ solved(gear, beyond)
    without, with_shapes = (
        np.abs(line.bent(truth - (node + more) @ beyond.load)).max()
        for more in (0.0 * rim_alone, rim_alone)
    )
    print(f"\n{steps} apart: {without:.2e} without, {with_shapes:.2e} m with shapes")
    assert with_shapes < share * without


def test_shapes_hold_neither_rigid_motion_nor_each_other(ring):
    """Rigid motion has no shapes; each shape has itself alone, and none of the node's motion."""
    line = replace(ring.first, angle=2 * np.pi * TOOTH / TEETH)
    sample = facet_sample(ring.model, ring.model.fe_mesh.facets[f"tooth_root_{TOOTH + 1:03d}"])
    sample = replace(sample, interpolation=sp.eye_array(len(sample.points)).tocsr())
    rows, less = shape_tie(line, sample)
    node = averaging_tie("tooth", line.place, sample).rows
    rigid = rigid_motion(sample.points - line.place)
    shapes = line.shapes(sample.points) - rigid @ less
    for tie, motion, other in ((rows, shapes, rigid), (node, rigid, shapes)):
        one, none = (tie @ a.reshape(3 * len(a), -1) for a in (motion, other))
        length = np.sqrt(np.diag(motion.reshape(-1, len(one)).T @ motion.reshape(-1, len(one))))
        np.testing.assert_allclose(one * length[:, None] / length, np.eye(len(one)), atol=1e-9)
        size = np.asarray(np.abs(tie).sum(axis=1)).reshape(-1, 1) * np.abs(other).max(axis=(0, 1))
        assert np.abs(none / size).max() < 1e-9


def test_coast_flanks_are_drive_flanks_half_a_turn_about_the_radius(gear):
    """On a gear that is the same from either end: z -> −z, and one tooth is the next one's next."""
    tooth, half = gear.tooth, 0.5 * CASE.stage.face_width
    z = np.linspace(-0.9, 0.7, 7) * half
    roll = np.linspace(0.9, 1.1, 7) * tooth.roll_length(tooth.reference_radius)
    drive = rim.flank_motion(gear.rim, tooth, -1, (roll, z))
    coast = rim.flank_motion(gear.rim, tooth, 1, (roll, -z))
    pairs_of = [(gear.rim.tooth, gear.rim.tooth), *((b, b.T) for b in gear.rim.beside)]
    for flexibility, other in pairs_of:
        one, two = drive @ flexibility @ drive.T, coast @ other @ coast.T
        np.testing.assert_allclose(two, one, atol=2e-3 * np.abs(one).max())


def test_flexibility_is_symmetric_and_no_pair_gets_indefinite(ring, bending):
    """The rim by itself yields to shapes, G ΔT Gᵀ with a tooth's own influence to any load."""
    flexibility = ring.rim.tooth
    assert flexibility == pytest.approx(
        flexibility.T, rel=1e-6, abs=1e-9 * np.abs(flexibility).max()
    )
    shapes = flexibility[6:, 6:] / np.sqrt(
        np.outer(np.diag(flexibility)[6:], np.diag(flexibility)[6:])
    )
    assert np.linalg.eigvalsh(shapes)[0] > -1e-6
    path, pair = bending
    more, beside = rim.rim_bending(ring.rim, path, path.slices, 1)
    assert np.array_equal(more, more.swapaxes(1, 2))
    whole = pair.with_rim(more, beside)
    long = path.slices.width[:, 0] > 0.2 * path.slices.width.max()
    assert np.linalg.eigvalsh(whole.flexibility[long])[:, 0].min() > 0.0
    assert np.abs(more).max() < 0.2 * np.abs(pair.flexibility).max()


def test_right_halves_are_the_mirror_image(ring, bending):
    path, _ = bending
    right = replace(path, side="right", slope=-path.slope)
    slices = replace(path.slices, z=-path.slices.z)
    one, two = (
        rim.rim_bending(ring.rim, path, path.slices, 1),
        rim.rim_bending(ring.rim, right, slices, 1),
    )
    for a, b in zip(one, two, strict=True):
        np.testing.assert_allclose(b, a, atol=1e-12 * np.abs(a).max())


def test_shapes_count_where_the_static_error_without_them_is_above_the_promise(ring, monkeypatch):
    """A thin wide rim; a stiff one has next to none, and what is asked for wins."""
    monkeypatch.setattr(rim, "segment_influence", lambda *_, tied: coarse(CASE, "ring"))
    size = len(ring.stiffness)
    body = ReducedBody(
        "ring", ring.condensed.interface.node_names, ring.condensed.interface.positions,
        np.zeros((size, size)), ring.stiffness, 0, {}, *3 * [np.zeros((0, 3))],
    )  # fmt: skip

    def taken_in(case, body, shapes=ring.shapes):
        always = case.ring.tooth_shapes == "always"
        segment = ring_source(case).segment
        return rim.with_rim(body, shapes, segment, case.material, ring.supports, always=always)

    thin = taken_in(CASE, body)
    assert 0.05 < thin.report["rim_error"] < 0.15
    assert thin.report["rim_counts"] and thin.rim is not None
    (row,) = rim_rows(thin.report)
    assert "included" in row.label and row.value == thin.report["rim_error"]
    hard = replace(ring.shapes, fixed=1e-3 * ring.shapes.fixed, piece=1e-3 * ring.shapes.piece)
    stiff = taken_in(CASE, body.with_(stiffness=1e3 * ring.stiffness), hard)
    assert stiff.report["rim_error"] < 0.002 * thin.report["rim_error"]
    assert not stiff.report["rim_counts"] and stiff.rim is None
    always, none = (
        load_case("ev-reducer", {**OPTIONS, "stage.ring.fe.tooth_shapes": key}).view()
        for key in ("always", "none")
    )
    assert taken_in(always, body).rim is not None
    assert ring_source(none).segment is None
    loose = body.with_(stiffness=0.0 * ring.stiffness)
    assert taken_in(CASE, loose).rim is None  # supports alone hold no tooth


def test_a_thin_planet_keeps_the_promise_and_its_rim_is_in_pairs_of_sun_and_ring(monkeypatch):
    """Without the shapes a load at an end of its face would be some per cent wrong."""
    view = THIN_PLANET.view()
    influences = {part: coarse(view, part) for part in ("planet", "sun", "ring")}
    monkeypatch.setattr(of_case, "tooth_influence", lambda _, part: influences[part])
    monkeypatch.setattr(rim, "segment_influence", lambda *_, tied: influences["planet"])
    monkeypatch.setattr(rim, "SAMPLED_TEETH", 1)
    sources = fe_sources(view)
    (name,) = (n for n in sources if n.part == "planet")
    body = sources.pop(name).reduced()
    assert body.rim is not None
    assert body.report["static_error"] < PROMISED < body.report["rim_error"]
    assert max(body.report["static_error_cases"].values()) > 2 * PROMISED
    shaped, plain = (
        build_system(THIN_PLANET, {name: b}, list(sources)).pairs
        for b in (body, body.with_(rim=None))
    )
    for one, other in zip(shaped.table, plain.table, strict=True):
        stiffness, without = shaped.k_table[one], plain.k_table[other]
        change = np.abs(stiffness - without).max() / without.max()
        assert 1e-3 < change < 0.1


def test_without_load_along_the_face_a_planet_is_judged_by_even_loads():
    """As a ring is: no gear mesh can then load an end of the face alone."""
    options = {"solver.fidelity": "quick", **FLEXIBLE_PLANET}
    body = planet_source(load_case("ev-reducer", options).view()).reduced()
    assert body.report["static_error"] < PROMISED < max(body.report["static_error_cases"].values())
