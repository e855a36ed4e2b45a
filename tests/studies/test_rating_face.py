"""K_Hβ of a whole rating against closed forms: rigid bodies, slices that are springs side by side.

Spur gears with a helix deviation f over the face b, n pairs in contact with the stiffness c per
width each, under the normal force F. Flanks of rigid bodies that stand parallel approach by
δ − f z/b, |z| ≤ b/2, and every pair bears w(z) = c ⟨δ − f z/b⟩.

- All of the face touches: n ∫ w dz = F gives n c δ = F/b, so that n w(z) = F/b − n c f z/b. The
  mean over a gear-mesh cycle has the mean of n, which is the transverse contact ratio ε:
  K_Hβ = 1 + ε c f b/(2F), as long as no end leaves: F/b ≥ n c f/2 with the largest n, 2.
- Part of it touches, over b': ½ n c (f/b) b'² = F, and the end bears n c (f/b) b' = √(2 n c f F/b).
  The mean over the cycle has n = 2 for a share ε − 1 of it, else n = 1:
  K_Hβ = √(2 c f b/F) [(2 − ε) + (ε − 1) √2], as long as one pair alone does not touch all over:
  F/b ≤ c f/2.
"""

import math
from functools import cache

import pytest
from gears.rated_gears import PAIR, PLANETARY, case_of

from flexgear.model.load_cases import LoadCase
from flexgear.studies.rating import rate

STIFF = "support = { radial_n_per_m = 1e13, axial_n_per_m = 1e10, tilt_nm_per_rad = 1e13 }"
SLICES = """
[stage.gear_mesh]
model = "face_load"
slices = 61
path_only = true
pair_stiffness = "table"
[stage.gear_mesh.table.sun]
position = [0, 1]
stiffness_n_per_mm_um = [14, 14]
[stage.gear_mesh.table.ring]
position = [0, 1]
stiffness_n_per_mm_um = [14, 14]
[stage.errors]
sun_helix_slope_um = {}
[[inputs]]"""
C, F_HBETA, FACE = 14e9, 20e-6, 45e-3  # N/m², m, m
TORQUES = {"whole": 1600.0, "nearly whole": 700.0, "part": 150.0, "end": 20.0}  # N m


def _text(slope_um, support=STIFF):
    """Spur gears on supports that hold them straight."""
    text = PAIR.replace('helix_angle_deg = 8\nplanet_hand = "right"\n', "")
    text = text.replace("support = { radial_n_per_m = 1e9 }", support)
    return text.replace("[[inputs]]", SLICES.format(slope_um))


@cache
def _factors(folder, slope_um, reverse=False):
    """K_Hβ by load case of a spectrum in which part of the face carries in some cases."""
    text = _text(slope_um)
    states = list(TORQUES.items())[:: -1 if reverse else 1]
    cases = tuple(LoadCase(name=name, hours=10.0, torque=torque) for name, torque in states)
    keys = {"rating.positions_per_gear_mesh": 48, "rating.limits": "none"}
    rating = rate(case_of(folder, text, load_cases=cases, **keys), workers=1)
    (gear_mesh,) = rating.gear_meshes
    along = [of_bin["K_Hβ"] for of_bin in gear_mesh.factors]
    assert all(f.source.startswith("computed") for f in along)
    return {name: f.value for (name, _), f in zip(states, along, strict=True)}


def _contact_ratio():
    """ε_α of 21 and 67 teeth, module 5 mm, 20°, shifts 0.3 and −0.1, tips 1 + x modules high; the
    working angle by Newton's rule from inv α_w."""
    teeth, shifts, a0 = (21, 67), (0.3, -0.1), math.radians(20.0)
    involute = math.tan(a0) - a0 + 2 * math.tan(a0) * sum(shifts) / sum(teeth)
    angle = a0
    for _ in range(20):
        angle -= (math.tan(angle) - angle - involute) / math.tan(angle) ** 2
    base = [2.5 * z * math.cos(a0) for z in teeth]
    tip = [2.5 * z + 5 * (1 + x) for z, x in zip(teeth, shifts, strict=True)]
    path = sum(math.sqrt(r**2 - b**2) for r, b in zip(tip, base, strict=True))
    path -= sum(base) * math.tan(angle)
    return path / (5 * math.pi * math.cos(a0))


def _closed_form(torque):
    force, ratio = torque / (0.5 * 21 * 5e-3 * math.cos(math.radians(20.0))), _contact_ratio()
    tilt = C * F_HBETA
    if force / FACE >= tilt:
        return 1 + ratio * tilt * FACE / (2 * force)
    assert force / FACE <= tilt / 2
    return math.sqrt(2 * tilt * FACE / force) * (2 - ratio + (ratio - 1) * math.sqrt(2))


@pytest.mark.parametrize("slope_um", [20, -20])
def test_face_load_factor_of_a_tilted_face(tmp_path_factory, slope_um):
    """Whichever end is high, and while the whole face carries as well as when part of it does; the
    share of two pairs is known to one of 48 positions, an end to a slice of 61."""
    computed = _factors(tmp_path_factory.getbasetemp(), slope_um)
    for name, torque in TORQUES.items():
        assert computed[name] == pytest.approx(_closed_form(torque), rel=2e-3)
    assert computed["nearly whole"] < 2.0 < 3.0 < computed["part"]


def test_bins_do_not_know_each_other(tmp_path_factory):
    """The same factors whichever load case comes before."""
    folder = tmp_path_factory.getbasetemp()
    assert _factors(folder, 20, reverse=True) == pytest.approx(_factors(folder, 20), rel=1e-9)


def test_a_straight_face_is_loaded_evenly(tmp_path_factory):
    assert list(_factors(tmp_path_factory.getbasetemp(), 0).values()) == pytest.approx([1.0] * 4)


def test_the_factor_of_gears_that_cannot_tilt_gives_no_verdict(tmp_path):
    """On supports that give way as little as if they could not."""
    load = LoadCase(name="whole", hours=10.0, torque=TORQUES["whole"])
    for support in (STIFF, f'kinematics = "spatial"\n{STIFF}'):
        rating = rate(case_of(tmp_path, _text(20, support), load_cases=(load,)), workers=1)
        tilts = "spatial" in support
        (along,) = (of_bin["K_Hβ"] for of_bin in rating.gear_meshes[0].factors)
        assert along.value == pytest.approx(_closed_form(TORQUES["whole"]), rel=0.02)
        assert ("without tilt" in along.source) is not tilts
        remark = rating.not_assessed.get("pair pinion, tilting", "")
        assert remark.count('kinematics = "spatial"') == (0 if tilts else 2)
        teeth = [part for part in rating.parts if part.kind != "bearing"]
        assert {bool(part.estimates) for part in teeth} == {not tilts}


def test_a_face_without_torque_has_no_factors_and_is_no_remark(tmp_path):
    """Planets that what is left of rounding presses on one end share nothing."""
    support = "support = { radial_n_per_m = 1e9 }\n"
    held = PLANETARY.replace("[stage.carrier]\n", f"[stage.carrier]\n{support}")
    held = held.replace("profile_shift = 0.2\nbore", f"{support}profile_shift = 0.2\nbore")
    held = held.replace(
        "[stage.planet_bearing]\n",
        '[stage.gear_mesh]\nmodel = "face_load"\nslices = 5\n'
        "[stage.errors]\nring_tooth_um = 5\n[stage.planet_bearing]\n",
    )
    case = case_of(
        tmp_path,
        held,
        load_cases=(
            LoadCase(name="on", hours=1.0, torque=9e3, moment=(300.0, 0.0, 0.0)),
            LoadCase(name="idle", hours=1.0, torque=0.0),
        ),
        **{"rating.gear_mesh_cycles": 1, "rating.positions_per_gear_mesh": 2},
    )
    rating = rate(case, workers=1)
    assert all(g.factors[0] and not g.factors[1] for g in rating.gear_meshes)
    assert not {"stage sun", "stage ring"} & set(rating.not_assessed)
