"""A planet as a reduced body that floats: against ring theory and unreduced FE models made here."""

from dataclasses import replace
from functools import cache
from math import radians

import numpy as np
import pytest
import scipy.linalg as sla
import skfem
from scipy.sparse.linalg import SuperLU, splu
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from flexgear.model.bodies import Material, Planet
from flexgear.model.member import PlanetBearing
from flexgear.model.names import BodyName
from flexgear.structures.bodies import rigid_rows, rigid_variant, turn
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.gears import PlanetFeMeshParameters
from flexgear.structures.fe_mesh.solids import solid_of_fe_mesh
from flexgear.structures.reduced import ReducedBody, elastic_modes, floating
from flexgear.structures.sources.planet import PlanetSource

YOUNG, POISSON, DENSITY = 210e9, 0.3, 7850.0
HELICAL = PlanetFeMeshParameters(
    teeth=33, normal_module=0.018, helix_angle=np.radians(7.5), dedendum=1.4, root_fillet=0.39,
    bore_diameter=0.42, face_width=0.43, fidelity="quick",
)  # fmt: skip
SPUR = replace(HELICAL, helix_angle=0.0)
SMOOTH = PlanetFeMeshParameters(  # an annulus of 20 by 20 mm on a mean radius of 90 mm
    teeth=60, normal_module=0.2 / 60, helix_angle=0.0, addendum=5e-3, dedendum=1e-2,
    root_fillet=5e-3, bore_diameter=0.16, face_width=0.02,
)  # fmt: skip
NAME = BodyName.of("stage", "planet", 0)


pytestmark = pytest.mark.usefixtures("one_thread")


def source(mesh: PlanetFeMeshParameters, young: float = YOUNG, modes: int = 20) -> PlanetSource:
    return PlanetSource(
        key=BodyName.of("stage", "planet"),
        section=Planet(fixed_interface_modes=modes),
        parameters=mesh,
        material=Material(young_modulus=young, poisson_ratio=POISSON, density=DENSITY),
        cyclic=True,
        limit_hz=2000.0,
        reference_radius=mesh.tooth.reference_radius,
        segment=None,
        along_face=True,
        bearing=PlanetBearing(radial=4e9, axial=1e9, tilt=1.6e8),
    )


@cache
def reduced(mesh: PlanetFeMeshParameters, young: float = YOUNG) -> ReducedBody:
    return source(mesh, young).reduced()


class Unreduced:
    """The same FE mesh as a free body of 20-node hexahedra, made without the package."""

    def __init__(self, fe_mesh: FeMesh) -> None:
        self.mesh = skfem.MeshHex1(fe_mesh.points.T.copy(), fe_mesh.cells.T.copy())
        self.element = skfem.ElementVector(skfem.ElementHexS2())
        basis = skfem.Basis(self.mesh, self.element, intorder=4)
        self.stiffness = linear_elasticity(*lame_parameters(YOUNG, POISSON)).assemble(basis)
        self.mass = skfem.BilinearForm(lambda u, v, w: DENSITY * dot(u, v)).assemble(basis)
        self.patches = fe_mesh.facets
        corners = np.sort(self.mesh.facets, axis=0).T.tolist()
        self.number = {tuple(ids): k for k, ids in enumerate(corners)}

    def spread(self, patch: str, traction) -> tuple[np.ndarray, float, np.ndarray]:
        """∫ N·t dA (d,) of a traction t(x), the patch's area and centroid."""
        facets = np.array([self.number[tuple(sorted(ids))] for ids in self.patches[patch].tolist()])
        basis = skfem.InteriorFacetBasis if "root" in patch else skfem.FacetBasis
        at = basis(self.mesh, self.element, facets=facets, intorder=5)
        form = skfem.LinearForm(lambda v, w: dot(traction(w.x), v))
        moments = [skfem.Functional(lambda w, i=i: w.x[i]).assemble(at) for i in range(3)]
        area = skfem.Functional(lambda w: 1.0 + 0.0 * w.x[0]).assemble(at)
        return form.assemble(at), float(area), np.array(moments) / area

    def compliance(self, loads: np.ndarray) -> np.ndarray:
        """Fᵀ K⁺ F of loads in equilibrium (d, k): six dofs of three vertices are held, which react
        to nothing."""
        far = [
            int(np.argmax(self.mesh.p.T @ np.array(d))) for d in ((1, 0, 1), (-1, 0, 1), (0, 1, 0))
        ]
        first, second, third = (skfem.Basis(self.mesh, self.element).nodal_dofs[:, i] for i in far)
        held = [*first, second[1], second[2], third[2]]
        free = np.setdiff1d(np.arange(len(loads)), held)
        solution = factored(self.stiffness[free][:, free]).solve(loads[free])
        return loads[free].T @ solution


def factored(matrix) -> SuperLU:
    """Factors of a symmetric positive definite matrix."""
    order = {"permc_spec": "MMD_AT_PLUS_A", "options": {"SymmetricMode": True}}
    return splu(matrix.tocsc(), diag_pivot_thresh=0.0, **order)


@cache
def unreduced(mesh: PlanetFeMeshParameters) -> Unreduced:
    return Unreduced(source(mesh).fe_mesh())


def annulus(inner: float, outer: float, n: int, order: int = 5):
    """Stiffness and mass (2 order + 2,)² of u_r = Σ a_k P_k(r) cos nθ, u_θ = Σ b_k P_k(r) sin nθ of
    an annulus of unit width in plane stress, and P_k at the outer radius: exact ring theory."""
    s, w = np.polynomial.legendre.leggauss(order + 6)
    half = (outer - inner) / 2
    r, w = (outer + inner) / 2 + half * s, w * half
    p = np.polynomial.legendre.legvander(s, order)
    slopes = [np.polynomial.legendre.Legendre.basis(k).deriv()(s) for k in range(order + 1)]
    d, zero = np.column_stack(slopes) / half, np.zeros_like(p)
    e_r, e_t = np.hstack([d, zero]), np.hstack([p, n * p]) / r[:, None]
    shear = np.hstack([-n * p / r[:, None], d - p / r[:, None]])
    plane, modulus = YOUNG / (1 - POISSON**2), YOUNG / (2 + 2 * POISSON)
    around = (np.pi if n else 2 * np.pi) * w * r
    along = np.pi * w * r if n else 0 * r
    stiffness = plane * (
        (e_r.T * around) @ e_r + (e_t.T * around) @ e_t
        + POISSON * ((e_r.T * around) @ e_t + (e_t.T * around) @ e_r)
    ) + modulus * (shear.T * along) @ shear  # fmt: skip
    radial, tangential = np.hstack([p, zero]), np.hstack([zero, p])
    mass = DENSITY * ((radial.T * around) @ radial + (tangential.T * along) @ tangential)
    return stiffness, mass, np.ones(order + 1)


def test_free_rim_has_frequencies_of_the_thick_ring() -> None:
    """In the plane, two of each n; the annulus is as wide as thick, so in plane stress."""
    values, shapes = elastic_modes(reduced(SMOOTH))
    z = shapes[2 : 6 * SMOOTH.teeth : 6]
    moving = shapes[: 6 * SMOOTH.teeth].reshape(-1, 6, len(values))[:, :3]
    plane = np.sum(z**2, axis=0) < 1e-3 * np.sum(moving**2, axis=(0, 1))
    frequencies = np.sqrt(values[plane])
    for n in (2, 3):
        stiffness, mass, _ = annulus(SMOOTH.bore_radius, SMOOTH.tooth.root_radius, n)
        theory = np.sqrt(sla.eigvalsh(stiffness, mass)[0])
        assert frequencies[2 * n - 4 : 2 * n - 2] == pytest.approx(theory, rel=1e-2)


def test_rim_under_opposite_forces_widens_across_them_as_the_thick_ring() -> None:
    """Radial unit forces on teeth 1 and 31 of 60; the diameter through teeth 16 and 46."""
    body, (ahead, behind) = floating(reduced(SMOOTH), NAME), (0, 30)
    load = np.zeros(len(body.mass))
    for tooth, sign in ((ahead, -1.0), (behind, 1.0)):
        load += sign * body.node(f"tooth_{tooth + 1:03d}")[0]
    motion = np.append(np.zeros(6), load[6:] / np.diag(body.stiffness)[6:])
    widened = (body.node("tooth_016")[1] - body.node("tooth_046")[1]) @ motion
    theory = 0.0
    for n in range(0, 40, 2):  # opposite forces have even waves alone: 2 cos nθ/(π or 2π) each
        stiffness, _, edge = annulus(SMOOTH.bore_radius, SMOOTH.tooth.root_radius, n)
        part = slice(0, len(edge)) if n == 0 else slice(None)
        force = np.append(edge, 0 * edge)[part] * -2.0 / SMOOTH.face_width
        amplitude = np.linalg.lstsq(stiffness[part, part], force, rcond=1e-13)[0]
        theory += 2.0 * (edge @ amplitude[: len(edge)]) * np.cos(n * np.pi / 2)
    assert widened == pytest.approx(theory, rel=1e-2)


def self_equilibrated(teeth: tuple[int, int], angle: float) -> list[tuple[str, np.ndarray]]:
    """Unit forces of two gear meshes at 0-based teeth, each at an angle from its tooth's radius, in
    the opposite sense of rotation, and the bearing's answer in the bore."""
    out = []
    for tooth, sense in zip(teeth, (1.0, -1.0), strict=True):
        direction = 2 * np.pi * tooth / SPUR.teeth + sense * angle
        out.append(
            (f"tooth_{tooth + 1:03d}", -np.array([np.cos(direction), np.sin(direction), 0.0]))
        )
    return [*out, ("bore", -(out[0][1] + out[1][1]))]


CASES = [self_equilibrated(teeth, radians(70)) for teeth in ((0, 17), (5, 21), (8, 9))]


@pytest.mark.slow
def test_two_gear_meshes_on_a_planet_in_its_bearing_act_as_on_its_unreduced_model() -> None:
    """Compliances of the elastic body for forces in the middle of base sections, spread evenly, and
    the pressure ~ cos of the bearing; the moment of both forces about the axis is zero but for the
    flat base sections' centres, which the pressure does not take: it is put on the bore."""
    model, body = unreduced(SPUR), floating(reduced(SPUR), NAME)
    loads, elastic = [], []
    for case in CASES:
        load, coordinates, moment = 0.0, np.zeros(len(body.mass)), np.zeros(3)
        for name, force in case:
            patch = "bore" if name == "bore" else name.replace("tooth", "tooth_root")
            if name == "bore":

                def traction(x, force=force):
                    normal = np.stack([x[0], x[1], 0 * x[0]]) / np.hypot(x[0], x[1])
                    return normal * np.einsum("i,i...->...", force, normal)
            else:

                def traction(x, force=force):
                    return force[:, None, None] + 0 * x

            spread, area, centre = model.spread(patch, traction)
            load = load + spread * (2.0 if name == "bore" else 1.0) / area
            place = centre - body.position(name)
            wrench = np.concatenate([force, np.cross(place, force)])
            coordinates += body.node(name).T @ wrench
            moment += np.cross(centre, force)
        assert np.abs(moment).max() < 1e-9
        loads.append(load)
        elastic.append(coordinates[6:])
    omega2 = np.diag(body.stiffness)[6:]
    compliance = np.array(elastic) / omega2 @ np.array(elastic).T
    full = model.compliance(np.array(loads).T)
    assert compliance == pytest.approx(full, rel=1e-8, abs=1e-8 * np.diag(full).min())


def test_elastic_coordinates_are_orthonormal_and_have_no_momentum() -> None:
    values, shapes = elastic_modes(body := reduced(HELICAL))
    rigid = body.rigid_modes()
    assert shapes.T @ body.mass @ shapes == pytest.approx(np.eye(len(values)), abs=1e-9)
    scale = np.sqrt(np.diag(rigid.T @ body.mass @ rigid))
    assert np.abs(rigid.T @ body.mass @ shapes / scale[:, None]).max() < 1e-12
    strain = shapes.T @ body.stiffness @ shapes
    assert np.abs(strain - np.diag(values)).max() < 1e-9 * values[-1]
    assert values[0] > 0.0


def test_rigid_motion_has_the_mass_of_the_solid() -> None:
    of_source, body = source(HELICAL), floating(reduced(HELICAL), NAME, 0.4)
    meshed = solid_of_fe_mesh(of_source.fe_mesh()).rigid_mass(DENSITY)
    assert body.mass[:6, :6] == pytest.approx(meshed, rel=2e-5, abs=1e-9)
    exact = of_source.solid().rigid_mass(DENSITY)
    assert np.diag(body.mass)[:6] == pytest.approx(np.diag(exact), rel=1.5e-2)
    lumped = rigid_variant(body)
    assert lumped.mass == pytest.approx(meshed, rel=2e-5, abs=1e-9)
    assert np.array_equal(lumped.node(NAME), np.eye(6))
    assert not lumped.node("tooth_001").any()


@pytest.mark.parametrize("turned", [0.0, 1.1])
def test_loads_turned_by_a_tooth_give_turned_displacements(turned: float) -> None:
    body, pitch = floating(reduced(HELICAL), NAME, turned), HELICAL.tooth.pitch_angle
    elastic = body.node_map[6:, 6:]
    flexibility = elastic / np.diag(body.stiffness)[6:] @ elastic.T
    teeth, one = 6 * HELICAL.teeth, turn(pitch)
    wrenches = np.random.default_rng(1).normal(size=(4, 6)) * [1.0, 1.0, 1.0, 0.1, 0.1, 0.1]

    def displacement(shift: int) -> np.ndarray:
        load = np.zeros((len(elastic) // 6, 6))
        for k, wrench in zip((0, 3, 12), wrenches, strict=False):
            load[k + shift] = np.linalg.matrix_power(one, shift) @ wrench
        load[-1] = np.linalg.matrix_power(one, shift) @ wrenches[3]
        return (flexibility @ load.ravel()).reshape(-1, 6)

    first, second = displacement(0), displacement(1) @ one
    first[: teeth // 6] = np.roll(first[: teeth // 6], 1, axis=0)
    assert np.abs(second - first).max(axis=0) == pytest.approx(0.0, abs=1e-8 * np.abs(first).max())


def test_turned_body_is_the_same_body_with_its_nodes_elsewhere() -> None:
    plain, turned = (floating(reduced(HELICAL), NAME, angle) for angle in (0.0, 0.7))
    assert turned.stiffness == pytest.approx(plain.stiffness, rel=1e-12)
    for name in ("tooth_009", "bore"):
        assert turned.node(name)[:, 6:] == pytest.approx(turn(0.7) @ plain.node(name)[:, 6:])
        assert turned.position(name) == pytest.approx(turn(0.7)[:3, :3] @ plain.position(name))
    assert np.array_equal(turned.node(NAME)[:, :6], np.eye(6))


def test_all_planets_share_one_reduction_that_says_its_errors() -> None:
    body = reduced(HELICAL)
    assert body.node_names == (*(f"tooth_{j:03d}" for j in range(1, 34)), "bore")
    assert body.report["path"].startswith("cyclic: 33 sectors")
    assert body.report["frequency_error"] < 1e-2
    assert {case.split(" end")[0] for case in body.report["static_error_cases"]} == {
        "tip", "pitch", "root",
    }  # fmt: skip
    assert body.as_body().rigid_motions[:6] == pytest.approx(rigid_rows(body.positions)[:6])
