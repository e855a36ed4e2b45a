"""Plain planet bearings: Reynolds' equation by quadrature, Ocvirk's locus, speed, energy."""

import itertools

import numpy as np
import pytest
from law_response import respond
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq
from stepped import energy_closes, jump, stepped
from trains import stage_train

from flexgear.analysis.orbit import orbit_elements
from flexgear.analysis.start import start_state
from flexgear.coupling.build import build_system
from flexgear.coupling.kernels.elements import pair_rows, row_motions
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.laws import LAW_NUMBERS
from flexgear.coupling.modal import modal_system
from flexgear.coupling.pair_data import carrying_flanks
from flexgear.model.errors import FlexgearError, InputError

OIL, DIAMETER, LENGTH, CLEARANCE = 0.03, 0.08, 0.04, 60e-6
FILM = {"diameter_mm": "80", "length_mm": "40", "clearance_um": "60", "viscosity_mpa_s": "30"}
CENTERING = 1e-4 * 5e8  # N/m, which stays a spring beside the film
PLANET = 94 / 34  # turns of a planet in its carrier's frame for one of the carrier, backwards


def with_film(folder, film=FILM, **settings):
    keys = {f"stage.planet_bearing.journal.{k}": v for k, v in film.items()}
    return stage_train(folder, planets=3, **keys, **settings)


def short_bearing(load, speed):
    """Eccentricity and attitude angle of Ocvirk's short bearing that carries a load, N."""
    scale = OIL * speed * DIAMETER / 2 * LENGTH**3 / CLEARANCE**2

    def excess(e):
        return scale * e / (4 * (1 - e**2) ** 2) * np.sqrt(np.pi**2 * (1 - e**2) + 16 * e**2) - load

    e = brentq(excess, 1e-9, 0.9999)
    return e, np.arctan2(np.pi * np.sqrt(1 - e**2), 4 * e)


def pin(dataset, at):
    """Where the pin of planet 1 stands in its bore, over the clearance, and the load on it, N, both
    as complex numbers of the carrier's frame."""
    planet, carrier = (
        dataset.body_displacement.sel(body=f"stage.{name}").values[at]
        for name in ("planet_1", "carrier")
    )
    assert abs(carrier[:2]).max() < 1e-12
    off = -complex(*planet[:2])
    force = dataset.planet_bearing_force.values[at, 0, :2]
    return off / CLEARANCE, -complex(*force) - CENTERING * off


@pytest.mark.parametrize(
    ("x", "y", "vx", "vy", "speed"),
    [(3e-5, -2e-5, 0.0, 0.0, 40.0), (-5e-5, 1e-5, 2e-3, -1e-3, -30.0), (1e-5, 0.0, -5e-2, 0, 9.0)],
)
def test_the_film_is_the_half_of_reynolds_pressure_that_presses(x, y, vx, vy, speed):
    """Short bearing, d/dz(h³/12η dp/dz) = ω̄ dh/dψ + dh/dt, bore and pin moved as they are, the
    negative half of the pressure left out; and it takes power as shear and pressure do."""
    mean = 0.5 * speed  # the planet turns, the pin stands

    def pressing(psi):
        """∫ p dz at the angle ψ of the bore, where the bore has come near by x cos ψ + y sin ψ on
        the other side."""
        h = CLEARANCE + x * np.cos(psi) + y * np.sin(psi)
        turning = -x * np.sin(psi) + y * np.cos(psi)
        squeeze = vx * np.cos(psi) + vy * np.sin(psi)
        return max(-OIL * LENGTH**3 / h**3 * (mean * turning + squeeze), 0.0)

    def integral(weight):
        turn = np.linspace(0, 2 * np.pi, 41)
        return sum(
            quad(lambda p: pressing(p) * weight(p), a, b, epsabs=0, limit=200)[0]
            for a, b in itertools.pairwise(turn)
        )

    parameters = [OIL, DIAMETER / 2, LENGTH, CLEARANCE, 1e-6, 5e8]
    motion = np.array([[x, y, 7.0], [vx, vy, speed]])
    energy, force, _ = respond(LAW_NUMBERS["journal"], parameters, motion)
    on_bore = [DIAMETER / 2 * integral(f) for f in (np.cos, np.sin)]
    assert -force[0, :2] == pytest.approx(on_bore, rel=1e-6)
    shear = 2 * np.pi * OIL * (DIAMETER / 2) ** 3 * LENGTH
    shear /= CLEARANCE * np.sqrt(1 - (x**2 + y**2) / CLEARANCE**2)
    squeezed = np.array([vx + mean * y, vy - mean * x])
    taken = shear * speed**2 + force[0, :2] @ squeezed
    assert force[0] @ motion[1] == pytest.approx(taken, rel=1e-12)
    assert energy == 0.0 and (force[1] == 0.0).all()


def coefficients(e, size):
    """Stiffness and damping (2, 2) along and across e of a film of the size S/(c ω), over ω and 1:
    of F_r = S ε²/(1 − ε²)², F_t = ¼ π S ε/(1 − ε²)^(3/2), S = η ω R L³/c², and of squeezing."""
    s, cross = 1 - e**2, -2 * e / (1 - e**2) ** 2
    by_e = [2 * e * (1 + e**2) / s**3, -np.pi * (1 + 2 * e**2) / (4 * s**2.5)]
    stiffness = np.column_stack([by_e, [np.pi / (4 * s**1.5), e / s**2]])
    damping = [[np.pi * (1 + 2 * e**2) / (2 * s**2.5), cross], [cross, np.pi / (2 * s**1.5)]]
    return size * stiffness, size * np.array(damping)


@pytest.mark.parametrize("eccentricity", [0.1, 0.5, 0.9])
def test_stiffness_and_damping_are_those_of_the_short_bearing(eccentricity):
    """The eight coefficients of Ocvirk's bearing in closed form."""
    e, scale = eccentricity, OIL * DIAMETER / 2 * LENGTH**3 / CLEARANCE**3
    parameters = [OIL, DIAMETER / 2, LENGTH, CLEARANCE, 1e-7, 5e8]
    motion = np.array([[e * CLEARANCE, 0, 0], [0, 0, 20.0]])
    _, force, tangent = respond(LAW_NUMBERS["journal"], parameters, motion)
    radial, across = e**2 / (1 - e**2) ** 2, np.pi * e / (4 * (1 - e**2) ** 1.5)
    assert force[0, :2] == pytest.approx(
        20 * scale * CLEARANCE * np.array([radial, -across]), rel=1e-9
    )
    stiffness, damping = coefficients(e, scale)
    assert tangent[0, :2, :2] == pytest.approx(20 * stiffness, rel=1e-9)
    assert tangent[1, :2, :2] == pytest.approx(damping, rel=1e-9)


@pytest.mark.parametrize("torque", ["200", "1000", "4000"])
def test_a_planet_stands_on_its_film_where_ocvirk_says(tmp_path, torque):
    case = with_film(tmp_path, **{"inputs.0.torque_nm": torque})
    result = case.assemble().static(angle_deg=[0, 1.3])
    off, load = pin(result, 1)
    speed = 100 * np.pi / 30 * PLANET
    eccentricity, attitude = short_bearing(abs(load), speed)
    assert abs(off) == pytest.approx(eccentricity, rel=1e-6)
    film = CLEARANCE * (1 - eccentricity)
    assert result.film_thickness.values[1, 0] == pytest.approx(film, rel=1e-5)
    # the bore turns backwards, and takes the pin with it from the direction of the load
    assert np.angle(off / load) == pytest.approx(-attitude, rel=1e-5)
    drag = 2 * np.pi * OIL * (DIAMETER / 2) ** 3 * LENGTH / CLEARANCE * speed
    lost = 3 * PLANET * drag / np.sqrt(1 - eccentricity**2)  # at the carrier; the wedge's beside
    carried = 94 / 26 + 1  # turns of the sun
    missing = float(torque) + carried * float(result.port_torque.sel(port="stage.sun")[1])
    wedge = 3 * PLANET * 0.5 * abs(off) * CLEARANCE * abs(load) * np.sin(attitude)
    assert missing == pytest.approx(lost + wedge, rel=1e-3)


@pytest.mark.parametrize(("viscosity", "torque"), [("5", "3000"), ("30", "12000")])
def test_loaded_films_beside_pins_off_their_places_are_in_equilibrium(tmp_path, viscosity, torque):
    """Newton's steps turn such pins in their bores; their forces balance the torque, but for the
    drag of the films."""
    errors = {"stage.errors.pin_tangential_um": "[30, 0, -20]", "inputs.0.torque_nm": torque}
    train = with_film(tmp_path, FILM | {"viscosity_mpa_s": viscosity}, **errors)
    data = train.assemble().static(angle_deg=[0.0, 3.0, 10.0])
    tangential = data.planet_bearing_force.values[:, :, 1].sum(axis=1)
    arm = (94 - 34) / 2 * 4e-3  # m
    assert np.abs(tangential) * arm == pytest.approx(float(torque), rel=1e-3)
    assert data.attrs["closure_max"] < 1e-8


def test_surfaces_touch_where_no_film_carries(tmp_path):
    """With next to no oil a pin stands in its bore as in a bearing with that clearance."""
    thin = FILM | {"viscosity_mpa_s": "1e-6", "least_film_um": "1"}
    result = with_film(tmp_path, thin).assemble().static(angle_deg=[0.0])
    off, load = pin(result, 0)
    closer = abs(off) * CLEARANCE - (CLEARANCE - 1e-6)
    assert abs(load) == pytest.approx((5e8 - CENTERING) * closer, rel=1e-4)


def test_the_film_follows_the_speed_of_the_moment(tmp_path):
    """Held at half of its rated speed, a train runs on the film of that speed, not the rated one;
    viscosity of the lubricant times density is that of the film."""
    film = {k: v for k, v in FILM.items() if k != "viscosity_mpa_s"}
    oil = {"viscosity_40_mm2_per_s": "100", "operating_viscosity_mm2_per_s": "30"}
    keys = {f"lubricant.{k}": v for k, v in oil.items()} | {"lubricant.density_kg_per_m3": "1000"}
    machine = {"law": '"speed"', "kind": '"ramp"', "times_s": "[0, 1]", "speeds_rpm": "[50, 50]"}
    keys |= {f"inputs.0.machine.{k}": v for k, v in machine.items()}
    case = with_film(tmp_path, film, **keys)
    run = case.assemble().transient(duration=0.004)
    off, load = pin(run, -1)
    eccentricity, attitude = short_bearing(abs(load), 50 * np.pi / 30 * PLANET)
    assert abs(off) == pytest.approx(eccentricity, rel=1e-5)
    assert np.angle(off / load) == pytest.approx(-attitude, rel=1e-4)


def test_plain_bearings_are_asked_for_no_rating(tmp_path):
    parts = [p for p in with_film(tmp_path).rate().parts if p.alike.endswith("bearings")]
    assert len(parts) == 3
    assert all(p.missing.startswith("a plain bearing has no rating life") for p in parts)
    rating = {"dynamic_rating_kn": "100", "rolling": '"roller"'}
    with pytest.raises(InputError, match="rolling elements, and a journal"):
        with_film(tmp_path, **{f"stage.planet_bearing.{k}": v for k, v in rating.items()})


def test_energy_closes_on_a_film(tmp_path):
    system = build_system(with_film(tmp_path, **{"stage.gear_mesh.model": "per_pair"}))
    modal, rated = modal_system(system, 3000.0), system.rated_torque
    energy_closes(modal, jump(rated, 0.5 * rated, 0.002), 0.01)


def test_a_response_does_not_leave_the_film_out(tmp_path):
    """Periodic states know no speed of shafts, and say so."""
    case = with_film(tmp_path, **{"stage.gear_mesh.model": "per_pair"})
    with pytest.raises(FlexgearError, match="have no shaft speeds"):
        orbit_elements(modal_system(build_system(case)), 0, 16)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"length_mm": "90"}, "length_mm: is more than the diameter"),
        ({"least_film_um": "40"}, "least_film"),
        ({"viscosity_mpa_s": None}, r"journal.viscosity_mpa_s"),
    ],
)
def test_impossible_films_are_one_line(tmp_path, keys, message):
    film = {k: v for k, v in (FILM | keys).items() if v is not None}
    with pytest.raises(InputError, match=message):
        with_film(tmp_path, film).assemble()


def test_a_small_change_of_torque_rings_down_as_the_coefficients_say(tmp_path):
    """A thousandth of torque more: the train with closed-form stiffness and damping of its films in
    place of them, a matrix exponential, moves as the transient does."""
    system = build_system(with_film(tmp_path, **{"inputs.0.torque_nm": "1500"}))
    modal, rated = modal_system(system), system.rated_torque
    run = stepped(modal, jump(rated, 1.001 * rated, 0.0), 0.02, 4e-6, 1e-4)
    state = start_state(modal, rated)
    rest = modal.modes @ state.eta
    stiffness, damping = system.stiffness.copy(), np.zeros_like(system.stiffness)
    rows = pair_rows(system.pairs)
    n, _ = build_rows(
        system.pairs, rows, np.zeros(len(system.angles)), carrying_flanks(system.pairs)
    )
    teeth = row_motions(rows, n, system.blocks)[rows.row["kind"][:n] >= 0]
    stiffness += (teeth.T * rows.row["stiffness"][: len(teeth)]) @ teeth
    damping += (teeth.T * rows.row["damping"][: len(teeth)]) @ teeth
    speed, scale = -100 * np.pi / 30 * PLANET, OIL * DIAMETER / 2 * LENGTH**3 / CLEARANCE**3
    for bearing in system.bearings:
        v = bearing.relative[[0, 1, 5]]
        off = v[:2] @ rest
        e, n = np.hypot(*off) / CLEARANCE, off / np.hypot(*off)
        axes = np.column_stack([n, np.sign(speed) * np.array([-n[1], n[0]])])
        k, c = coefficients(e, scale)
        film = axes @ [
            abs(speed) * e**2 / (1 - e**2) ** 2,
            -abs(speed) * np.pi * e / (4 * (1 - e**2) ** 1.5),
        ]
        stiffness += v[:2].T @ (axes @ (abs(speed) * k) @ axes.T) @ v[:2]
        damping += v[:2].T @ (axes @ c @ axes.T) @ v[:2]
        damping += v[:2].T @ np.outer(scale * CLEARANCE * film / speed, v[2])  # F ~ ω
    brake = system.machines[-1].rated_torque / system.machines[-1].rated_speed
    damping += brake * np.outer(system.ports[-1].row, system.ports[-1].row)
    d, solve = len(rest), np.linalg.inv(system.mass)
    force = 0.001 * rated * system.ports[0].row
    zero, one = np.zeros((d, d)), np.eye(d)
    rate = np.block([[zero, one], [-solve @ stiffness, -solve @ damping]])
    rate = np.block(
        [[rate, np.r_[np.zeros(d), solve @ force][:, None]], [np.zeros((1, 2 * d + 1))]]
    )
    onwards, y, expected = expm(rate * run.time[0]), np.r_[np.zeros(2 * d), 1.0], []
    for _ in run.time:
        y = onwards @ y
        expected.append(y[:d])
    v = system.bearings[0].relative[:2]
    moved = run.eta @ modal.modes.T @ v.T - v @ rest
    expected = np.array(expected) @ v.T
    assert np.abs(moved - expected).max() < 0.005 * np.abs(expected).max()
