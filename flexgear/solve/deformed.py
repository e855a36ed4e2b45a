"""Displacement fields of FE bodies: in equilibrium, at a sample of a transient, in a mode."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.modes import Modes
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Transient
from flexgear.model.errors import InputError, echo
from flexgear.model.names import BodyName
from flexgear.model.read import nearest
from flexgear.results.labelled_dataset import variable
from flexgear.results.quantities import AXES
from flexgear.solve.dataset import result_attrs
from flexgear.solve.model import Model, first_torque, rated_rotations
from flexgear.structures.reduced import ReducedBody, elastic_modes
from flexgear.structures.strain import COMPONENTS, stress_of_strain, von_mises

LEAST_ENERGY = 1e-12  # share of a mode's kinetic energy below which a body does not move


def bending_bodies(model: Model) -> list[BodyName]:
    """Names of the flexible bodies with an FE mesh: "stage.ring", "stage.planet_1"."""
    return [
        body.name
        for body in model.system.bodies
        if not body.rigid
        and (reduced := model.bodies.get(body.name.alike)) is not None
        and len(reduced.points)  # bodies given as matrices have none
    ]


def reduced_field(
    model: Model, body: str, coordinates: NDArray[np.float64]
) -> tuple[ReducedBody, NDArray[np.float64]]:
    """The reduced body of one of ``bending_bodies``, and its coordinates from those (d_b[, k]) in
    the system; for planets without rigid motion, in the planet's frame."""
    name = BodyName.parse(body)
    reduced = model.bodies[name.alike]
    if name == name.alike:
        return reduced, coordinates
    return reduced, elastic_modes(reduced)[1] @ coordinates[6:]


def require_bending(model: Model, body: str) -> None:
    """Raise InputError unless ``body`` is one of ``bending_bodies``."""
    bodies = bending_bodies(model)
    if body not in bodies:
        remedy = nearest(body, bodies) if bodies else "no body of this model is one"
        raise InputError("deformed", echo(body), "is not a flexible FE body", remedy)


def deformed(
    model: Model,
    body: str,
    carrier_angle: float = 0.0,
    torque: float | None = None,
    *,
    run: xr.Dataset | None = None,
    time: float = 0.0,
) -> xr.Dataset:
    """Elastic displacement (p, 3) m and stress (p, 6) Pa at the vertices of a body's FE mesh.

    u = Φ_r q with the recovery matrix Φ_r of the reduction; stress by ``structures/strain.py``,
    smoothed where the FE mesh does not resolve it (tooth roots). carrier_angle: rotation of the
    reference member, rad; other arguments: see ``face.model.Model.deformed``. InputError for a body
    that is not one of ``bending_bodies``, or a time outside the run.
    """
    require_bending(model, body)
    if run is None and time:
        raise InputError("deformed", "time", "is that of no run", "give the transient as run, too")
    if run is not None:
        coordinates, attrs = _at(run, body, time)
    else:
        system = model.system
        torques = first_torque(system, torque)
        equilibrium = revolution(
            model.modal, rated_rotations(system, np.array([carrier_angle])), torques
        )
        coordinates = Recovery(equilibrium).coordinates(body)[0]
        attrs = {"carrier_angle": carrier_angle, "input_torque": torques}
    return _field(model, body, coordinates, attrs)


def mode_field(
    model: Model, body: str, mode: int, carrier_angle: float | None = None, largest: float = 1e-3
) -> xr.Dataset:
    """Displacement (p, 3) m and stress (p, 6) Pa of a body in a natural mode of the train.

    carrier_angle: rotation of the reference member, rad, at which the stiffness of gear meshes is
    taken instead of the mean; other arguments: see ``face.model.Model.mode_field``. Attribute
    ``frequency``: Hz. InputError for an unknown mode, or one in which the body does not move.
    """
    require_bending(model, body)
    modes = model.natural_modes(angle=carrier_angle)
    if not 1 <= mode <= len(modes.frequencies):
        problem = f"{mode} is not there"
        raise InputError("mode_field", "mode", problem, f"take 1 … {len(modes.frequencies)}")
    shape = modes.shapes[model.system.slice_of(body), mode - 1]
    reduced, coordinates = reduced_field(model, body, shape)
    peak = np.linalg.norm(reduced.recover(coordinates), axis=-1).max()
    if not modes.energy[body][mode - 1] > LEAST_ENERGY:
        raise InputError("mode_field", body, f"does not move in mode {mode}", "take another mode")
    attrs = {"frequency": float(modes.frequencies[mode - 1]), "mode": float(mode)}
    return _field(model, body, largest / peak * shape, attrs)


def _field(
    model: Model, body: str, coordinates: NDArray[np.float64], attrs: dict[str, float]
) -> xr.Dataset:
    """Dataset of displacement and stress of a body from its coordinates (d_b,) in the system."""
    reduced, coordinates = reduced_field(model, body, coordinates)
    material = model.case.view(BodyName.parse(body).stage).material
    strain = reduced.strain(coordinates)
    stress = stress_of_strain(strain, material.young_modulus, material.poisson_ratio)
    fields = {
        "point": np.asarray(reduced.points, dtype=float),
        "cell": np.asarray(reduced.cells, dtype=np.int32),
        "displacement": reduced.recover(coordinates),
        "stress": stress,
        "von_mises_stress": von_mises(stress),
    }
    return xr.Dataset(
        {name: variable(name, values) for name, values in fields.items()},
        {"axis": list(AXES), "component": list(COMPONENTS)},
        {"body": body, **result_attrs(model), **attrs},
    )


def body_coordinates(run: Transient, bodies: Sequence[str]) -> xr.Dataset:
    """Dataset with ``fe_coordinate`` (time, coordinates): coordinates of bodies in succession."""
    recovery = Recovery(run)
    values = [recovery.coordinates(body) for body in bodies]
    names = np.repeat(list(bodies), [v.shape[1] for v in values])
    data = xr.Dataset(coords={"time": run.time, "fe_coordinate_of": ("fe_coordinate_of", names)})
    return data.assign(fe_coordinate=variable("fe_coordinate", np.hstack(values), "time"))


def _at(run: xr.Dataset, body: str, time: float) -> tuple[NDArray[np.float64], dict[str, float]]:
    """Coordinates of a body at the sample of a transient nearest to a time, s, and attributes with
    the time of the sample. InputError for a body that was not saved or a time outside the run."""
    bodies = run["fe_coordinate_of"].to_numpy().tolist() if "fe_coordinate" in run else []
    if body not in bodies:
        problem = (
            f"is not kept in the run, which keeps {', '.join(dict.fromkeys(bodies)) or 'none'}"
        )
        raise InputError("deformed", body, problem, f'run it with fields=["{body}"]')
    times = run["time"].to_numpy()
    first, last = float(times[0]), float(times[-1])
    interval = (last - first) / max(len(times) - 1, 1)
    if not first - 1.5 * interval <= time <= last + 0.5 * interval:
        remedy = f"take one from {first:g} to {last:g} s"
        raise InputError("--time", f"{time:g}", "is not within the run", remedy)
    sample = run.sel(time=time, method="nearest")
    coordinates = sample["fe_coordinate"].to_numpy()[np.array(bodies) == body]
    return coordinates.astype(float), {"time": float(sample["time"])}


MAX_SHOWN = 4  # modes of a body
LEAST_SHARE = 0.1  # share of a body in the kinetic energy of a mode that is shown
APART = 0.01  # relative difference of frequencies below which two modes are one pair


def moving_modes(modes: Modes, body: str) -> list[int]:
    """Indices of the lowest modes in which a body has at least a tenth of the kinetic energy; of
    pairs with equal frequency, as in round bodies, only the first."""
    indices: list[int] = []
    for k in np.flatnonzero((modes.energy[body] >= LEAST_SHARE) & (modes.frequencies > 0.0)):
        if not indices or modes.frequencies[k] > (1.0 + APART) * modes.frequencies[indices[-1]]:
            indices.append(int(k))
    return indices[:MAX_SHOWN]


def mode_shapes(model: Model, body: str, modes: Modes) -> xr.Dataset:
    """Dataset with ``mode_displacement`` (mode, vertex, axis) of a body in its ``moving_modes``,
    u = Φ_r φ over the largest |u| of the mode, and ``frequency`` (mode,), Hz.

    body: one of ``bending_bodies``; mode: numbers from 1 as in ``modes``. Vertices are those of
    ``deformed``. InputError for another body.
    """
    require_bending(model, body)
    dofs, numbers = model.system.slice_of(body), moving_modes(modes, body)
    reduced, coordinates = reduced_field(model, body, modes.shapes[dofs][:, numbers])
    shapes = np.zeros((len(numbers), len(reduced.points), 3))
    for shape, q in zip(shapes, coordinates.T, strict=True):
        field = reduced.recover(q)
        shape[:] = field / np.linalg.norm(field, axis=-1).max()
    return xr.Dataset(
        {
            "mode_displacement": variable("mode_displacement", shapes),
            "frequency": variable("frequency", modes.frequencies[numbers], "mode"),
        },
        coords={"mode": [k + 1 for k in numbers], "axis": list(AXES)},
    )
