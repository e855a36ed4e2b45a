"""Motions that are not small beside what the linear frame takes them to be small against."""

import json
import math

import numpy as np
import pytest
import xarray as xr

from flexgear import load_case
from flexgear.solve.result_warnings import large_motions, largest_motions, motion_histories
from flexgear.studies.measures import WARNING
from flexgear.studies.sweep import failures, planned, run_sweep

CASE = load_case("wind-5mw")  # module 18 mm, one-sided contact
SOFT = {"stage.ring.support.tangential_n_per_m": "1e5"}


def line(law="one-sided", **motions):
    case = load_case("wind-5mw", {"stage.gear_mesh.contact_law": f'"{law}"'})
    named = {f"stage.{name.replace('teeth', ' teeth')}": size for name, size in motions.items()}
    return "".join(large_motions(case, named))


@pytest.mark.parametrize(("size", "warned"), [(1.79e-3, False), (1.81e-3, True)])
def test_a_tenth_of_the_module_is_worth_a_warning(size, warned):
    for name in ("planet_3", "shaft", "ringteeth"):
        text = line(**{name: size})
        assert ("the module of 18 mm" in text) == warned and "roots" not in text


def test_all_that_moves_is_named_the_largest_first():
    text = line(planet_1=2e-3, planet_3=3e-3, ringteeth=18e-3, shaft=1e-3)
    assert "ring teeth by 18 mm, planet 3 by 3 mm." in text
    assert "tips and roots" in text  # a quarter of the module, which a planet's circle is not along
    assert "tips and roots" not in line(planet_1=18e-3)
    assert not large_motions(CASE, {"another.sun": 1.0})


def test_backlash_that_linear_contact_does_not_know():
    """0.5 mm along the normal close where a gear moves by j/(2 sin α cos β_b), the wider working
    angle first: α_t of 20° at β 7.5° by hand, and up to a hundredth more for profile shifts."""
    alpha = math.atan(math.tan(math.radians(20)) / math.cos(math.radians(7.5)))
    base_helix = math.asin(math.sin(math.radians(7.5)) * math.cos(math.radians(20)))
    most = 0.5e-3 / (2 * math.sin(alpha) * math.cos(base_helix))
    assert "the backlash of 500 µm" in line("linear", shaft=1.02 * most)
    assert not line("linear", shaft=0.98 * most) and not line("one-sided", shaft=1.02 * most)


def test_the_largest_of_all_samples_bodies_and_teeth():
    rng = np.random.default_rng(3)
    bodies, teeth = rng.normal(size=(5, 2, 6)), rng.normal(size=(5, 7, 3))
    data = xr.Dataset(
        {
            "body_displacement": (("position", "body", "dof"), bodies),
            "tooth_displacement": (("position", "tooth", "axis"), teeth),
        },
        {
            "body": ["a.sun", "b.sun"],
            "dof": ["ux", "uy", "uz", "rx", "ry", "rz"],
            "axis": ["x", "y", "z"],
            "tooth_stage": ("tooth", ["a"] * 4 + ["b"] * 3),
        },
    )
    far, radial = abs(bodies[..., 0] + 1j * bodies[..., 1]), abs(teeth[..., 0] + 1j * teeth[..., 1])
    assert largest_motions(motion_histories(data)) == pytest.approx({
        "a.sun": far[:, 0].max(), "b.sun": far[:, 1].max(),
        "a.ring teeth": radial[:, :4].max(), "b.ring teeth": radial[:, 4:].max(),
    })  # fmt: skip


def test_sweeps_keep_a_warning_for_each_point(tmp_path, monkeypatch):
    """A ring on 1e5 N/m under tooth forces of 1 kN turns by centimetres, and planets follow."""
    monkeypatch.setenv("FLEXGEAR_CACHE", str(tmp_path))
    (key,) = SOFT
    plan = planned("lin-parker", {key: (1e5, 1e8)}, measures=["frequencies"])
    ((where, text),) = failures(run_sweep(plan, workers=1), WARNING)
    assert where == f"{key} = 100000" and "the module of 2.947 mm: planet" in text


def test_the_figure_in_it_is_the_displacement_of_the_bodies():
    model = load_case("lin-parker", SOFT).assemble()
    data = model.static([0, 17])
    (text,) = large_motions(model.case, largest_motions(motion_histories(data)))
    across = data["body_displacement"].sel(body="stage.planet_1", dof=["ux", "uy"])
    most = float(np.sqrt((across**2).sum("dof")).max())
    assert f"{1e3 * most:.4g} mm" in text


def test_commands_say_it(tmp_path, capsys):
    from flexgear.cli.entry import run

    (soft,) = (f"{k}={v}" for k, v in SOFT.items())
    for command in (["static"], ["simulate", "--duration-s", "0.002"]):
        for settings, expected in (["--set", soft], 1), ([], 0):
            assert run([command[0], "lin-parker", *command[1:], "--json", "-q", *settings]) == 0
            shown = json.loads(capsys.readouterr().out)
            lines = shown.get("transient", shown)["neglected"]
            assert sum("the module of 2.947 mm" in text for text in lines) == expected
