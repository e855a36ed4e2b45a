"""Parametric instability of trains against closed forms of one and two degrees of freedom."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq
from trains import spur_pair, stage_train, write

import flexgear as fg

MEAN, RATIO = 4e8, 1.6  # N/m, contact ratio
MASS = 0.8  # kg on the line of action, of pinion and gear with 1.2 and 2.4 kg
RATED = 2 * np.pi * 60 * 50.0  # gear-mesh frequency, rad/s


def pair_text(damping=0.0, step="", gears='kinematics = "torsional"'):
    """Two gears that turn only: one elastic mode, with a stiffness of two levels."""
    turning = gears + ", teeth = {}, mass_kg = {}, equivalent_mass_kg = {}"
    return spur_pair(
        turning.format(30, 3, 1.2), turning.format(60, 9, 2.4), f"""model = "rectangular"
contact_law = "linear"
sun_stiffness_n_per_m = {MEAN}
sun_contact_ratio = {RATIO}
damping_ratio = {damping}
{step}""",
        speed=3000, sections="[damping]\nratio = 0.0", output="brake_exponent = 0",
    )  # fmt: skip


def pair(folder, *options):
    return fg.load_case(write(folder, pair_text(*options))).assemble()


def exact_growth(factor, levels, dampers):
    """ln|μ|/T of m ẍ + c ẋ + k x = 0 with two levels: product of two 2 × 2 solutions (Meissner)."""
    period = 2 * np.pi / (RATED * factor)
    out = np.eye(2)
    for k, c, share in zip(levels, dampers, (RATIO - 1.0, 2.0 - RATIO), strict=True):
        decay, t = 0.5 * c / MASS, share * period
        omega = np.sqrt(k / MASS - decay**2)
        cos, sin = np.cos(omega * t), np.sin(omega * t) / omega
        free = [[cos + decay * sin, sin], [-k / MASS * sin, cos - decay * sin]]
        out = np.exp(-decay * t) * np.array(free) @ out
    return np.log(np.abs(np.linalg.eigvals(out)).max()) / period


def exact_edges(levels, dampers, first, last):
    """Speed factors at which growth begins or ends, by a fine search and bisection."""
    fine = np.geomspace(first, last, 6001)
    sign = np.array([exact_growth(f, levels, dampers) for f in fine]) - 1e-3 > 0.0
    ends = np.flatnonzero(sign[1:] != sign[:-1])
    return np.array(
        [
            brentq(lambda f: exact_growth(f, levels, dampers) - 1e-3, fine[k], fine[k + 1])
            for k in ends
        ]
    )


@pytest.mark.parametrize("count", [50, 121])
@pytest.mark.parametrize(
    ("damping", "step", "low"),
    [
        (0.0, "", MEAN / RATIO),
        (0.01, "", MEAN / RATIO),
        (0.0, "sun_stiffness_step_n_per_m = 1e8", MEAN - 0.6e8),
        (0.01, 'damping_law = "always"', MEAN / RATIO),
    ],
)
def test_bands_of_two_levels_begin_and_end_where_meissner_says(tmp_path, damping, step, low, count):
    """c = 2 ζ √(m k) of either level, with the law "always" of the mean, a constant damper; one
    pair has ``low``; growth beyond 1e-3 a second. Order 5 has no band to first order."""
    high = low + 1e8 if "stiffness" in step else 2 * low
    levels = high, low
    dampers = [2 * damping * np.sqrt(MASS * (MEAN if "always" in step else k)) for k in levels]
    data = pair(tmp_path, damping, step).stability(speeds=(0.4, 2.6), count=count)
    exact = exact_edges(levels, dampers, 0.4, 2.6)
    ours = np.sort(np.concatenate([data["band_lower_factor"], data["band_upper_factor"]]))
    assert len(exact) >= 8
    assert ours == pytest.approx(exact, rel=2e-4)
    growth = [exact_growth(f, levels, dampers) for f in data["band_peak_factor"].to_numpy()]
    assert data["band_growth_rate"].to_numpy() == pytest.approx(np.array(growth), rel=0.01)
    bands = zip(data["band_lower_factor"], data["band_upper_factor"], growth, strict=True)
    for lower, upper, fastest in bands:
        inside = np.linspace(float(lower), float(upper), 101)
        assert max(exact_growth(f, levels, dampers) for f in inside) <= 1.002 * fastest
    orders = data["band_order"].to_numpy().tolist()
    assert orders == sorted(orders, reverse=True)
    assert orders[-1] == 1
    assert np.all(data["band_modes"] == 2)  # the rotation of the train is mode 1


def test_two_modes_that_meet_an_order_together_grow(tmp_path):
    """Gears that also give way along the line of action, 4 coordinates x₁, u₁, x₂, u₂ (u = r φ):
    growth at the sum of two frequencies is that of a Runge–Kutta solution over one period."""
    gears = 'kinematics = "planar", support = {{ radial_n_per_m = 4e8 }}'
    path = write(tmp_path, pair_text(gears=gears))
    mass, row = np.diag([3, 1.2, 9, 2.4]), np.array([1.0, 1.0, -1.0, -1.0])
    bearings, mesh = np.diag([4e8, 0.0, 4e8, 0.0]), np.outer(row, row)
    omega = np.sqrt(np.abs(eigh(bearings + MEAN * mesh, mass, eigvals_only=True)))[1:]
    at = float((omega[0] + omega[2]) / RATED)
    data = fg.load_case(path).assemble().stability(speeds=(0.97 * at, 1.03 * at), count=9)
    assert data.sizes["band"] >= 1
    k = int(np.argmax(data["band_growth_rate"].to_numpy()))
    low, high = (float(data["kept_frequency"].sel(kept_mode=m)) for m in data["band_modes"][k])
    assert [low, high] == pytest.approx(omega[[0, 2]] / (2 * np.pi), rel=2e-3)
    factor = float(data["band_peak_factor"][k])
    period = 2 * np.pi / (RATED * factor)

    def rate(stiffness):
        matrix = -np.linalg.solve(mass, bearings + stiffness * mesh)

        def of_state(_, y):
            motion, velocity = y.reshape(2, 4, 8)
            return np.concatenate([velocity, matrix @ motion]).ravel()

        return of_state

    y = np.eye(8).ravel()
    for stiffness, share in ((2 * MEAN / RATIO, 0.6), (MEAN / RATIO, 0.4)):
        y = solve_ivp(rate(stiffness), (0, share * period), y, rtol=1e-9, atol=1e-12).y[:, -1]
    growth = np.log(np.abs(np.linalg.eigvals(y.reshape(8, 8))).max()) / period
    assert float(data["band_growth_rate"][k]) == pytest.approx(growth, rel=0.01)


def test_both_modes_of_a_combination_are_named_although_one_is_undamped():
    """Planets opposite in phase couple the rotation at 1537 Hz, which the brake damps, with their
    mode at 1808 Hz, which nothing damps and has nearly all the energy (Lin and Parker 1999)."""
    waves = {"model": "fourier", "damping_ratio": "0", "sun_harmonic_shares": "[0.3]",
             "ring_harmonic_shares": "[0.0]"}  # fmt: skip
    case = fg.load_case(
        "lin-parker", {f"stage.gear_mesh.{k}": v for k, v in waves.items()} | {"damping.ratio": "0"}
    )
    data = case.assemble().stability(speeds=(9.8, 9.9), limit_hz=3000.0, count=5)
    pair = dict(zip(data["kept_mode"].values, data["kept_frequency"].values, strict=True))
    (modes,) = data["band_modes"].values
    assert [pair[k] for k in modes] == pytest.approx([1536.5, 1808.2], rel=1e-3)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"speeds": (-0.5, 1.5)}, "goes through zero speed"),
        ({"speeds": (1.0, 1.0)}, "is no range"),
        ({"speeds": (1.5, 0.5)}, "falls in speed -- write 0.5 to 1.5"),
        ({"limit_hz": -3.0}, "is not positive"),
    ],
)
def test_options_of_stability_that_do_not_fit_are_one_line(tmp_path, options, words):
    with pytest.raises(fg.InputError, match=words) as refused:
        pair(tmp_path).stability(**options)
    assert "\n" not in str(refused.value)


def test_damping_beyond_what_varying_stiffness_feeds_leaves_no_band(tmp_path):
    data = pair(tmp_path, 0.3).stability(speeds=(0.3, 3.0))
    assert data.sizes["band"] == 0
    assert np.all(data["growth_rate"] == 0.0)
    assert np.all(data["largest_multiplier"] < 1.0)


def test_modes_above_the_limit_follow_the_gear_meshes():
    """Modes 2 and 4 by themselves grow at speeds up to 0.3 % higher."""
    keys = {"gear_mesh.model": '"fourier"', "gear_mesh.sun_harmonic_shares": "[0.6]"}
    keys |= {"gear_mesh.damping_ratio": "0.2"}
    keys = {f"stage.{key}": text for key, text in keys.items()}
    model = fg.load_case(
        "lin-parker", keys | {"inputs.0.speed_rpm": "5000", "damping.ratio": "1e-4"}
    ).assemble()
    edges = []
    for limit in (1200.0, None):
        data = model.stability(speeds=(1.0, 1.1), count=41, limit_hz=limit)
        assert data.band_modes.to_numpy().tolist() == [[2, 4]]
        edges.append([float(data.band_lower_factor[0]), float(data.band_upper_factor[0])])
    assert edges[0] == pytest.approx(edges[1], rel=2e-4)


@pytest.mark.slow
def test_modes_of_flexible_bodies_above_the_limit_follow_the_gear_meshes():
    """13 modes by themselves grow by a fifth less, at speeds 0.04 % higher, than 60."""
    keys = {"solver.fidelity": '"quick"', "damping.ratio": "1e-4"}
    keys |= {"stage.gear_mesh.damping_ratio": "1e-3"}
    model = fg.load_case("star-ring", keys).assemble()
    few, many = (
        model.stability(speeds=(1.122, 1.128), count=7, limit_hz=limit)
        for limit in (1500.0, 8000.0)
    )
    rates = [np.interp(1.1243, d.speed_factor, d.growth_rate[:, 0]) for d in (few, many)]
    assert few.sizes["kept_mode"] < many.sizes["kept_mode"] / 4
    assert rates[0] == pytest.approx(rates[1], rel=0.03)
    assert _edges(few) == pytest.approx(_edges(many), rel=5e-5)


def _edges(data):
    """Ends of the band in which mode 13 grows."""
    at = data.band_modes.to_numpy().tolist().index([13, 13])
    return [float(data.band_lower_factor[at]), float(data.band_upper_factor[at])]


def test_constant_stiffness_grows_nothing(tmp_path):
    data = pair(tmp_path).case.with_(**{"stages.stage_1.gear_mesh.model": "constant"})
    assert data.assemble().stability(speeds=(0.3, 3.0)).sizes["band"] == 0


def test_two_gears_answer_as_one_mass_on_a_spring(tmp_path):
    """Levels k₁, k₂ = 2 k₁ of shares 2 − ε, ε − 1: |x_l| = 2 F̄ (1/k₁ − 1/k₂) |sin πl(ε − 1)|/πl,
    q = k̄ x/(k̄ − m ω² + iω c̄), F = (k̄ + iω c̄) q − k̄ x."""
    model = pair(tmp_path, 0.05)
    data = model.linear_response((0.2, 2.0), count=37, orders=3)
    low = MEAN / RATIO
    dampers = 2 * 0.05 * np.sqrt(MASS * np.array([low, 2 * low]))
    damper = dampers @ [2 - RATIO, RATIO - 1]
    force = 500 / (0.12 * np.cos(np.radians(20)))
    for order in (1, 2, 3):
        error = 2 * force * 0.5 / low * abs(np.sin(np.pi * order * (RATIO - 1))) / (np.pi * order)
        static = data.static_transmission_error_amplitude[0, order - 1]
        assert float(static) == pytest.approx(error, rel=0.01)  # of 120 positions
        w = order * RATED * data["speed_factor"].to_numpy()
        motion = MEAN * error / (MEAN - MASS * w**2 + 1j * w * damper)
        exact = np.abs((MEAN + 1j * w * damper) * motion - MEAN * error)
        ours = data.linear_force_amplitude[:, 0, order - 1].to_numpy()
        assert ours == pytest.approx(exact, rel=0.03, abs=0.02 * exact.max())
    w = float(data.peak_order[0] * data.peak_factor[0]) * RATED
    part = MEAN / (MEAN - MASS * w**2 + 1j * w * damper) * (MEAN + 1j * w * damper)
    share = (part * np.conj(part - MEAN)).real / abs(part - MEAN) ** 2
    assert float(data.peak_mode_share[0, 0]) == pytest.approx(share, abs=0.01)
    weak = data.assign(linear_force_amplitude=1e-3 * data.linear_force_amplitude)
    axes = [x.fg.plot.linear_response().axes[0] for x in (data, weak)]  # 1 kN as 1 N
    assert [ax.get_ylabel().split()[-1] for ax in axes] == ["(kN)", "(N)"]
    assert axes[0].get_ylim() == pytest.approx(axes[1].get_ylim())


def test_peaks_narrower_than_the_distance_of_speeds_have_their_height(tmp_path):
    """Closed form over 400 001 speeds; 37 are forty half widths of a peak apart."""
    ratio, low = 0.001, MEAN / RATIO
    data = pair(tmp_path, ratio).linear_response((0.2, 2.0), count=37, orders=2)
    dampers = 2 * ratio * np.sqrt(MASS * np.array([low, 2 * low]))
    damper = dampers @ [2 - RATIO, RATIO - 1]
    for order in (1, 2):
        error = float(data.static_transmission_error_amplitude[0, order - 1])
        w = order * RATED * np.linspace(0.2, 2.0, 400_001)
        motion = MEAN * error / (MEAN - MASS * w**2 + 1j * w * damper)
        exact = np.abs((MEAN + 1j * w * damper) * motion - MEAN * error).max()
        (peak,) = data.peak_force.to_numpy()[data.peak_order.to_numpy() == order]
        assert peak == pytest.approx(exact, rel=0.01)
        assert float(data.linear_force_amplitude[:, 0, order - 1].max()) == pytest.approx(
            peak, rel=1e-9
        )


def test_peaks_of_two_gear_meshes_between_the_same_speeds_have_their_heights():
    """Beside heavy planets sun and ring vibrate by themselves, here at √(2k/m) and 0.6 % above."""
    keys = {"planets": "2", "gear_mesh.model": '"fourier"', "gear_mesh.damping_ratio": "1e-3"}
    keys |= {f"gear_mesh.{g}_harmonic_shares": "[1e-3]" for g in ("sun", "ring")}
    keys |= {"planet.mass_kg": "1000", "planet.equivalent_mass_kg": "1000"}
    keys |= {"sun.equivalent_mass_kg": "0.4", "ring.equivalent_mass_kg": "0.79"}
    case = {f"stage.{key}": text for key, text in keys.items()}
    case |= {"inputs.0.speed_rpm": "30000", "damping.ratio": "1e-3"}
    model = fg.load_case("lin-parker", case).assemble()
    force = {
        count: model.linear_response((0.2, 1.9), count=count, orders=1, limit_hz=3e4)
        .linear_force_amplitude.max("speed_factor")
        .to_numpy()
        for count in (18, 20001)
    }
    assert force[18] == pytest.approx(force[20001], rel=0.01)


def test_slow_gears_follow_the_transmission_error_whatever_the_limit_of_modes():
    """Torque alone closes the gear meshes, so their forces do not vary: not by k̄ x."""
    keys = {f"stage.gear_mesh.{g}_harmonic_shares": "[1e-3]" for g in ("sun", "ring")}
    keys |= {"stage.planets": "2", "stage.gear_mesh.model": '"fourier"'}
    model = fg.load_case("lin-parker", keys).assemble()
    data = model.linear_response((0.01, 0.02), count=2, orders=1, limit_hz=2000)
    force = data.linear_force_amplitude[0].to_numpy()
    assert np.all(force < 0.01 * 5e8 * data.static_transmission_error_amplitude.to_numpy())


def test_forces_of_inertia_and_dampers_do_not_depend_on_the_limit_of_modes():
    keys = {"stage.planets": "2", "stage.errors.sun_tooth_um": "1", "damping.ratio": "1e-5"}
    keys |= {"stage.gear_mesh.model": '"fourier"', "stage.gear_mesh.damping_ratio": "0.2"}
    model = fg.load_case("lin-parker", keys).assemble()
    every, few = (
        model.linear_response((0.1, 0.2), count=2, orders=1, limit_hz=limit).linear_force_amplitude
        for limit in (2e4, 2e3)
    )
    assert few.to_numpy() == pytest.approx(every.to_numpy(), rel=1e-3)


def test_rounding_of_constant_stiffness_is_no_peak():
    """Of a bundled case: 5e-11 N was listed, with its modes."""
    data = fg.load_case("nrel-5mw").assemble().linear_response((0.2, 1.2), count=101)
    assert data.sizes["peak"] == 0 and not data.linear_force_amplitude.any()


def test_load_that_moves_along_the_face_tilts_the_gears():
    """Two helical gears that tilt: forces of steady states of all rows of the tooth pairs."""
    support = {"radial_n_per_m": 5e8, "axial_n_per_m": 3e8, "tilt_nm_per_rad": 1e6}
    gears = {name: {"teeth": z, "support": support} for name, z in (("pinion", 27), ("gear", 52))}
    stage = {"kind": "parallel", "normal_module_mm": 3, "face_width_mm": 40, "planet_hand": "right"}
    stage |= {"pressure_angle_deg": 20, "helix_angle_deg": 28, "gear_mesh": {"model": "per_pair"}}
    case = fg.Case(
        name="helical", kinematics="spatial", stages=[stage | gears],
        material={"young_modulus_gpa": 206, "poisson_ratio": 0.3, "density_kg_per_m3": 7850},
        inputs=[
            {"member": "stage_1.pinion", "speed_rpm": 900, "torque_nm": 300, "inertia_kg_m2": 0.05}
        ],
        output={"member": "stage_1.gear", "inertia_kg_m2": 0.2},
        damping={"kind": "modal", "ratio": 0.05},
    )  # fmt: skip
    model = case.assemble()
    linear = model.linear_response((0.999, 1.0), count=2, orders=3)
    steady = model.response((0.999, 1.0), harmonics=4).response_gear_mesh_force_amplitude
    assert linear.linear_force_amplitude[-1, 0].to_numpy() == pytest.approx(
        steady[-1, 0, :3].to_numpy(), rel=0.05
    )


def test_planets_that_do_not_stand_evenly_are_excited_by_their_own_forces(tmp_path):
    """x_1 = F̄ a/k̄ of a wave k̄ (1 + a cos ψ), to first order, with F̄ of the equilibrium."""
    wave = {"model": '"fourier"', "sun_harmonic_shares": "[1e-4]", "ring_harmonic_shares": "[1e-4]"}
    keys = {f"stage.gear_mesh.{key}": text for key, text in wave.items()}
    places = {
        "stage.planet_positions_deg": "[0, 84, 183, 270]",
        "stage.sun.support.radial_n_per_m": "1e8",
    }
    model = stage_train(tmp_path, **keys, **places).assemble()
    static = model.linear_response((0.9, 1.0), count=2).static_transmission_error_amplitude[:, 0]
    stiffness = np.where(static.kind == "ring", 8e8, 6e8)
    force = model.static(0.0).gear_mesh_force[0].to_numpy()
    assert np.ptp(force) > 0.02 * force.mean()
    assert static.to_numpy() * stiffness / 1e-4 == pytest.approx(force, rel=1e-3)


def test_dampers_in_proportion_to_masses_take_half_their_rate_off_growth(tmp_path):
    """M q̈ + γ M q̇ + K(t) q = 0 with q = e^{−γt/2} y: y has K − γ²/4 M, beyond notice here."""
    gears = 'kinematics = "planar", support = {{ radial_n_per_m = 4e8 }}'
    path, gamma = write(tmp_path, pair_text(gears=gears)), 40.0
    radii = np.array([0.06, 0.12]) * np.cos(np.radians(20))
    across, about = gamma * np.array([3, 9]), gamma * np.array([1.2, 2.4]) * radii**2
    keys = {
        "output.damping_nm_s_per_rad": f"{about[0]}",
        "inputs.0.damping_nm_s_per_rad": f"{about[1]}",
    }
    for gear, c in zip(("pinion", "gear"), across, strict=True):
        keys[f"stages.0.{gear}.support.damping.radial_n_s_per_m"] = f"{c}"
    free, damped = (
        fg.load_case(path, k).assemble().stability(speeds=(0.4, 2.6), count=31) for k in ({}, keys)
    )
    speeds = np.intersect1d(free.speed_factor, damped.speed_factor)
    free, damped = (x.sel(speed_factor=speeds).growth_rate.to_numpy() for x in (free, damped))
    assert free.max() > 2 * gamma
    growing = damped > 0
    assert damped[growing] == pytest.approx(free[growing] - gamma / 2, rel=2e-3, abs=0.2)
    assert free[~growing].max() < gamma / 2 * 1.01
