"""Dynamic factors of gear meshes from the train's own motion at one speed and torque.

    K_v = max_{t,i} F_i(t) / max_{p,i} F_i,p

with the gear-mesh forces F_i of planet i over a transient t that has settled and over quasi-static
positions p. The whole train vibrates, with its bodies and bearings and the errors of the case; what
the model lacks (a mean stiffness does not excite, teeth have no deviations unless the case states
them) is not in it, where method B of ISO 6336-1 takes deviations from an accuracy grade.
"""

from __future__ import annotations

from collections.abc import Mapping

from flexgear.model.case import Case
from flexgear.model.names import GroupName
from flexgear.results.labelled_dataset import groups_of
from flexgear.results.settling import window_of
from flexgear.solve.model import assemble
from flexgear.solve.transient import simulate

PERIODS = 40.0  # of the slowest gear mesh that is simulated


def dynamic_factors(case: Case, quasi_static: Mapping[GroupName, float]) -> dict[GroupName, float]:
    """K_v by group of gear meshes, of those in ``quasi_static``, their largest forces, N; none of a
    train at rest. Of a motion that has not settled the start counts, too."""
    model = assemble(case)
    frequencies = [s.gear_mesh_frequency for s in model.flow.stages if s.gear_mesh_frequency]
    if not frequencies or not quasi_static:
        return {}
    data = simulate(model, duration=PERIODS / min(frequencies)).data
    force = abs(data["gear_mesh_force"].sel(time=slice(window_of(data).start, None)).to_numpy())
    return {
        group: float(force[:, at].max()) / quasi_static[group]
        for group, at in groups_of(model.gear_meshes.names, 1).items()
        if group in quasi_static
    }
