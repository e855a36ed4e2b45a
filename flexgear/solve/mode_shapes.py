"""Shapes of bodies in the natural modes that move them, on their FE mesh."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexgear.analysis.modes import Modes
from flexgear.results.quantities import AXES
from flexgear.solve.deformed import reduced_field, require_bending
from flexgear.solve.model import Model

SHOWN = 4  # modes of a body
LEAST_SHARE = 0.1  # of a mode's kinetic energy in a body that it moves
APART = 0.01  # of a frequency: modes nearer to each other are one shape, turned


def lowest_modes(model: Model) -> Modes:
    """Modes at rest with the mean stiffness of the gear meshes, up to the band's top."""
    return model.natural_modes(model.pace.band)


def moving_modes(modes: Modes, body: str) -> list[int]:
    """Indices of the lowest modes in which a body has a tenth of the kinetic energy or more; of
    modes that turn into each other, as those of round bodies do in pairs, the first."""
    indices: list[int] = []
    for k in np.flatnonzero((modes.energy[body] >= LEAST_SHARE) & (modes.frequencies > 0.0)):
        if not indices or modes.frequencies[k] > (1.0 + APART) * modes.frequencies[indices[-1]]:
            indices.append(int(k))
    return indices[:SHOWN]


def mode_shapes(model: Model, body: str, modes: Modes) -> xr.Dataset:
    """``mode_displacement`` (mode, vertex, axis), u = Φ_r φ over the largest |u| of the mode, and
    ``frequency`` (mode,) Hz of a body in its ``moving_modes``.

    body: one of ``bending_bodies``; mode: numbers from 1 as in ``modes``. Vertices are those of
    ``deformed``.
    """
    require_bending(model, body)
    dofs, numbers = model.system.slice_of(body), moving_modes(modes, body)
    reduced, at_modes = reduced_field(model, body, modes.shapes[dofs][:, numbers])
    shapes = np.zeros((len(numbers), len(reduced.points), 3))
    for shape, coordinates in zip(shapes, at_modes.T, strict=True):
        field = reduced.recover(coordinates)
        shape[:] = field / np.linalg.norm(field, axis=-1).max()
    attributes = {"units": "1", "long_name": "displacement in a mode over the largest of the body"}
    return xr.Dataset(
        {
            "mode_displacement": (("mode", "vertex", "axis"), shapes, attributes),
            "frequency": (
                "mode",
                modes.frequencies[numbers],
                {"units": "Hz", "long_name": "natural frequency"},
            ),
        },
        coords={"mode": [k + 1 for k in numbers], "axis": list(AXES)},
    )
