"""Order analysis of signals whose orders are known, and of transients of small stages."""

import json
import warnings

import numpy as np
import pytest
import xarray as xr

from flexgear.face.accessor import Accessor
from flexgear.model.errors import FlexgearError, FlexgearWarning, InputError
from flexgear.model.load import load_case
from flexgear.results import run_orders
from flexgear.results.orders import amplitudes_at, envelope, order_map, order_spectrum, synchronous
from flexgear.results.run_orders import (
    history_over_turns,
    member_turns,
    over_time,
    planet_averages,
    synchronous_average,
)

LINES = {4.0: 2.0, 12.37: 0.5, 31.9: 1.25}


def run_up(seconds=4.0, hz=4000, first=10.0, last=20.0):
    """Times, turns of a member whose speed rises evenly from first to last 1/s."""
    time = np.arange(round(seconds * hz)) / hz
    turns = first * time + 0.5 * (last - first) / seconds * time**2
    return time, turns


def labelled(time, values, **coords):
    return xr.DataArray(values, {"time": time, **coords}, "time", "force", {"units": "N"})


def turns_of(time, turns):
    return xr.DataArray(turns, {"time": time}, "time", attrs={"long_name": "turns of sun"})


def chirp(time, turns):
    phase = 2 * np.pi * np.asarray(turns)
    return 7.0 + sum(a * np.cos(o * phase + o) for o, a in LINES.items())


def test_chirp_within_a_thousandth():
    """Speed varies by two; lines at and between whole orders, read off the spectrum's peaks and at
    the exact orders; a frequency at rest beside them does not alias into them."""
    time, turns = run_up()
    high = 0.8 * np.cos(2 * np.pi * 1700.0 * time)  # 85 to 170 orders, above the highest
    x = synchronous(labelled(time, chirp(time, turns) + high), turns_of(time, turns), 40.0)
    spectrum = order_spectrum(x)
    exact = amplitudes_at(x, list(LINES))
    for order, amplitude in LINES.items():
        near = spectrum.sel(order=slice(order - 0.5, order + 0.5))
        assert float(near.max()) == pytest.approx(amplitude, rel=1e-3)
        assert float(near.idxmax()) == pytest.approx(order, abs=0.02)
        assert float(exact.sel(order=order)) == pytest.approx(amplitude, rel=1e-3)
    quiet = spectrum.sel(order=slice(14, 30))
    assert float(quiet.max()) < 1e-3
    assert float(spectrum.sel(order=slice(0, 2)).max()) < 1e-3  # its mean is off
    for window in ("flattop", "blackman"):
        assert float(order_spectrum(x, window).max()) == pytest.approx(2.0, rel=1e-3)


def test_sampling_at_the_limit_still_holds():
    """At four samples a period of the highest order, where speed is highest."""
    time, turns = run_up(hz=1000)
    highest = 1 / (4 * np.diff(turns).max())
    line = 3.0 * np.cos(2 * np.pi * 0.99 * highest * turns)
    x = synchronous(labelled(time, line), turns_of(time, turns))
    amplitudes = amplitudes_at(x, [0.99 * highest])
    assert float(amplitudes[0]) == pytest.approx(3.0, rel=1e-3)


def test_map_holds_orders_at_all_speeds():
    """Constant at every speed for a line of constant amplitude; speeds are those of the run; what
    has a fixed frequency moves through the orders."""
    time, turns = run_up(seconds=8.0, hz=5000)
    signal = chirp(time, turns) + 0.7 * np.sin(2 * np.pi * 250.0 * time)
    mapped = order_map(synchronous(labelled(time, signal), turns_of(time, turns), 60.0), 8.0)
    ridge = mapped.sel(order=4.0, method="nearest")
    assert ridge.to_numpy() == pytest.approx(np.full(len(ridge), 2.0), rel=1e-2)
    speed = mapped["speed"].to_numpy() / (2 * np.pi)
    assert speed == pytest.approx(10.0 + 10.0 / 8.0 * mapped["time"].to_numpy(), rel=1e-3)
    above = mapped.sel(order=slice(13.5, 30))
    at = above.idxmax("order").to_numpy()
    inside = (250.0 / speed > 13.6) & (250.0 / speed < 29.9)
    assert at[inside] == pytest.approx(250.0 / speed[inside], rel=0.02)


def test_envelope_of_a_modulated_carrier():
    """A carrier at 60 orders modulated at order 3 by a third: the envelope has that line alone."""
    time, turns = run_up(hz=16_000)
    phase = 2 * np.pi * turns
    signal = 4.0 * (1 + 0.3 * np.cos(3 * phase)) * np.cos(60 * phase) + np.cos(5 * phase)
    x = synchronous(labelled(time, signal), turns_of(time, turns), 80.0)
    spectrum = order_spectrum(envelope(x, (50.0, 70.0)))
    assert float(spectrum.sel(order=3.0, method="nearest")) == pytest.approx(1.2, rel=1e-2)
    assert float(spectrum.where(abs(spectrum["order"] - 3) > 0.5).max()) < 0.02


def test_average_leaves_what_repeats():
    """Of a sine of the member and one of another that is no multiple of it."""
    time, turns = run_up(seconds=20.0)
    signal = np.cos(2 * np.pi * 7 * turns) + np.cos(2 * np.pi * 7.61803 * turns)
    mean = synchronous_average(synchronous(labelled(time, signal), turns_of(time, turns), 20.0))
    assert mean.attrs["turns"] >= 298
    expected = np.cos(2 * np.pi * 7 * mean["phase"].to_numpy())
    assert np.abs(mean.to_numpy() - expected).max() < 0.02


@pytest.fixture(scope="module")
def stage():
    """Twelve turns of the carrier of a stage: planets of 23 teeth, ring of 70, N = 4."""
    case = load_case("lin-parker", {"stage.planet.teeth": "23", "stage.ring.teeth": "74"})
    seconds, speed = 24.0, 2 * np.pi
    time = np.arange(0.0, seconds, 1 / 2500)
    angle = speed * time * (1 + 0.2 * time / seconds)
    member = case.inputs[0].member
    data = xr.Dataset(
        {"input_angle": (("time", "input_coordinate"), angle[:, None])},
        {"time": time, "input_coordinate": [member]},
        {"parameters": json.dumps(case.to_dict())},
    )
    return case, data


def test_sensors_have_a_clock_of_their_own(stage):
    """A signal over sensor_time goes with the angles sampled beside it, not with others."""
    _, data = stage
    slow = {"time": "sensor_time"}
    angle = data["input_angle"].isel(time=slice(None, None, 4)).rename(slow)
    phase = 2 * np.pi * member_turns(data, "carrier")
    signal = np.cos(5 * phase).isel(time=slice(None, None, 4)).rename(slow)
    both = data.assign(sensor_signal=signal, sensor_input_angle=angle)
    spectrum = order_spectrum(history_over_turns(both, "sensor_signal", "carrier"))
    assert float(spectrum.max()) == pytest.approx(1.0, rel=1e-3)
    assert float(spectrum.idxmax()) == pytest.approx(5.0, abs=0.01)


def test_a_history_that_jumps_warns_of_aliases_and_a_smooth_one_does_not(stage):
    """The lines of a square wave fall as 1/n: a share of about √(1/4 n) lies in the upper quarter
    of a band that holds n of them. A sensor's signal was filtered before it was sampled."""
    _, data = stage
    wave = np.sin(2 * np.pi * np.arange(data.sizes["time"]) / 20.7)
    data = data.assign(smooth=("time", wave), jumps=("time", np.sign(wave)))
    with pytest.warns(FlexgearWarning, match=r"jumps is not filtered .*output_interval_ms"):
        Accessor(data).orders("jumps", "carrier")
    slow = {"time": "sensor_time"}
    data = data.assign(sensor_signal=data["jumps"].drop_vars("time").rename(slow),
                       sensor_input_angle=data["input_angle"].rename(slow))  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error", FlexgearWarning)
        Accessor(data).orders("smooth", "carrier")
        Accessor(data).orders("sensor_signal", "carrier")


def test_turns_of_members(stage):
    """By tooth counts: Willis' formula, a planet against the carrier, the one stage left out."""
    case, data = stage
    ring, sun, planet = (getattr(case.stages[0], p).teeth for p in ("ring", "sun", "planet"))
    of_carrier = member_turns(data, "carrier")
    assert float(member_turns(data, "sun")[-1] / of_carrier[-1]) == pytest.approx(1 + ring / sun)
    against = member_turns(data, "stage.planet", "stage.carrier")
    assert float(against[-1] / of_carrier[-1]) == pytest.approx(-ring / planet)
    assert not member_turns(data, "ring").any()


def test_planets_are_told_apart(stage):
    """Each planet has a pattern of its own over its turn, heard as it passes: the average of each
    has its own and, as the others are silent then, nothing of them. A sensor at 40°."""
    case, data = stage
    (of,) = case.stages
    turns = member_turns(data, "carrier").to_numpy()
    at = np.radians(40.0)
    signal = np.zeros(len(turns))
    for i, phi in enumerate(of.planet_angles):
        d = np.mod(turns + (phi - at) / (2 * np.pi) + 0.5, 1.0) - 0.5
        heard = np.where(np.abs(d) < 1 / 8, np.cos(4 * np.pi * d) ** 2, 0.0)
        signal += heard * np.cos(2 * np.pi * (i + 1) * turns * of.ring.teeth / of.planet.teeth)
    data = data.assign(sound=("time", signal))
    means = planet_averages(data, "sound", "stage", sensor_angle=at)
    spectra = 2 * np.abs(np.fft.rfft(means.to_numpy(), axis=1)) / means.sizes["phase"]
    of_itself = spectra[range(4), range(1, 5)]
    assert of_itself == pytest.approx(np.full(4, of_itself[0]), rel=2e-2)
    assert of_itself[0] == pytest.approx(0.5 + 4 / (3 * np.pi), rel=0.01)  # mean of W h over W
    other = spectra[:, 1:5][~np.eye(4, dtype=bool)]
    assert other.max() < 0.03 * of_itself[0]  # of a run that is no whole number of cycles


def test_the_time_is_named_at_which_a_member_turns_back():
    """Also where it turns further back than it turned before."""
    time, turns = run_up()
    history, end = labelled(time, chirp(time, turns)), time[-1] - time[0]
    for first, last in ((-1.0, 2.0), (1.2, 3.0)):
        back = turns_of(time, np.sin(np.linspace(first, last, len(time))))
        at = time[0] + end * (np.pi / 2 - first) / (last - first)
        with pytest.raises(InputError, match="passes zero at") as refused:
            synchronous(history, back)
        assert f"at {at:.3g}"[:6] in str(refused.value)


def test_bad_input_is_refused_in_one_line(stage):
    """One line each."""
    _, data = stage
    data = data.assign(sound=("time", np.ones(data.sizes["time"])))
    time, turns = run_up()
    history = labelled(time, chirp(time, turns))
    back = turns_of(time, np.sin(np.linspace(-1, 2, len(time))))
    for call, text in (
        (lambda: member_turns(data, "wheel"), "wheel: is no member"),
        (lambda: over_time(data.drop_vars("input_angle"), "sound"), "input_angle: is not in"),
        (lambda: over_time(data, "noise"), "noise: is no history of this file -- name one of inp"),
        (lambda: synchronous(history, turns_of(time, 0 * turns)), "does not rotate"),
        (lambda: synchronous(history, back), "passes zero"),
        (lambda: synchronous(history, turns_of(time, turns), 5e3), "samples a period"),
        (lambda: order_spectrum(synchronous(history, turns_of(time, turns), 40.0), "x"), "window"),
        (lambda: order_map(synchronous(history, turns_of(time, turns), 40.0), 1e4), "do not fit"),
        (lambda: envelope(history, (10.0, 1e6)), "band"),
        (lambda: planet_averages(data, "sound", "x"), "planetary"),
        (lambda: planet_averages(data.isel(time=slice(0, 9000)), "sound", "stage"), "every tooth"),
    ):  # fmt: skip
        with pytest.raises((InputError, FlexgearError), match=text) as fault:
            call()
        assert "\n" not in str(fault.value)


def test_a_part_of_a_run_up_is_known_by_its_speed():
    """From 1 to 2 rad/s, by tenths 1.05 to 1.95; none at constant speed."""
    t = np.linspace(0.0, 1.0, 1001)
    for angle, change in ((t + 0.5 * t**2, 1.95 / 1.05 - 1.0), (-t, 0.0)):
        run = {"input_angle": (("time", "input_coordinate"), angle[:, None])}
        assert run_orders.speed_change(xr.Dataset(run, {"time": t})) == pytest.approx(change)
