"""Amplitudes of known sines, and orders of a gear mesh with a sideband."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from flexgear.results.harmonics import amplitudes, force_spectra


def test_a_sine_shows_its_amplitude_at_its_frequency():
    t = np.arange(4000) / 1000.0
    hz, found = amplitudes([7.0 + 3.0 * np.sin(2 * np.pi * 40 * t + 0.3), 0 * t + 5.0], 1e-3)
    assert hz[found[0].argmax()] == pytest.approx(40.0)
    assert found[0].max() == pytest.approx(3.0, rel=1e-3)
    assert np.abs(found[1]).max() < 1e-12


def test_orders_and_sidebands_stand_where_they_should():
    """Order 1 with sidebands once a turn of the carrier, z = 20."""
    mesh, t = 20.0, np.arange(8000) / 1000.0
    force = 100 * (1 + 0.2 * np.cos(2 * np.pi * t)) * np.cos(2 * np.pi * mesh * t)
    stages, planets = ["stage", "stage", "stage_2"], [1, 2, 1]
    labels = {"stage": stages, "kind": ["ring"] * 3, "side": [""] * 3, "planet": planets}
    data = xr.Dataset(
        {"gear_mesh_force": (("time", "gear_mesh"), np.outer(force, [1.0, 2.0, 3.0]))},
        {"time": t, **{name: ("gear_mesh", values) for name, values in labels.items()}},
    )
    found = force_spectra(data, "stage", mesh)
    assert found["gear_mesh"].to_numpy().tolist() == ["ring"]
    line = found["amplitude"].isel(gear_mesh=0)
    assert float(line.sel(order=1.0, method="nearest")) == pytest.approx(100, rel=1e-3)
    for side in (0.95, 1.05):
        assert float(line.sel(order=side, method="nearest")) == pytest.approx(10, rel=1e-2)
    assert float(line["order"].max()) <= 10.5
