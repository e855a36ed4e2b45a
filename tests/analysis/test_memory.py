"""A time step reads and writes its own arrays only: nothing else is checked in compiled loops."""

import numpy as np
import pytest
from coupled import make_system
from trains import stage_train

from flexgear.analysis.kernels.refinement import control
from flexgear.analysis.kernels.step import advance
from flexgear.analysis.kernels.step_arrays import Space
from flexgear.analysis.start import start_state
from flexgear.analysis.step_space import (
    consistent_acceleration,
    empty_samples,
    step_data,
    work_space,
)
from flexgear.analysis.transient import largest_rated_load
from flexgear.coupling.build import build_system
from flexgear.coupling.kernels.elements import law_functions
from flexgear.coupling.modal import modal_system
from flexgear.model.load import load_case

ROOM = 64  # numbers before and behind an array: more than one step of a vector sum reaches
TICKS = 240


def guarded(value, rooms):
    """The same arrays of floats, each with NaN before and behind it; ``rooms`` gets all of them."""
    if isinstance(value, tuple):
        return type(value)(*(guarded(v, rooms) for v in value))
    if not isinstance(value, np.ndarray) or value.dtype != np.float64:
        return value
    room = np.full(value.size + 2 * ROOM, np.nan)
    room[ROOM : ROOM + value.size] = value.ravel()
    rooms.append(room)
    return room[ROOM : ROOM + value.size].reshape(value.shape)


def arrays(samples):
    """All arrays by name, those of tuples within among them."""
    for name, value in samples._asdict().items():
        yield from arrays(value) if isinstance(value, tuple) else [(name, value)]


def stepped(modal, sizes, tolerance, guard):
    """Samples of two chunks through a reversal of the drive, energies booked."""
    rooms = []

    def copied(value):
        return guarded(value, rooms) if guard else value

    laws = law_functions(modal.system.pairs)
    rated = modal.system.rated_port_torques[:-1]
    plain = work_space(modal, track_energy=True, sizes=len(sizes))
    data, state = (
        copied(step_data(modal, sizes)),
        copied(start_state(modal, modal.system.rated_torque)),
    )
    space = Space(*(copied(part) for part in plain))
    levels = control(len(sizes), tolerance, largest_rated_load(modal), every=8)
    saved = []
    for share in (1.0, -0.2):
        torques = copied(share * np.tile(rated, (TICKS, 1)))
        first = copied(share * rated)
        assert consistent_acceleration(modal, data, state, first, space) == 0
        samples = copied(empty_samples(modal, TICKS // 8))
        status, count = advance(data, laws, torques, 0, state, space, samples, levels)
        assert (status, count) == (0, TICKS // 8)
        saved.append(samples)
    for room in rooms:
        assert np.isnan(room[:ROOM]).all() and np.isnan(room[len(room) - ROOM :]).all()
    return saved


def bending(**changes):
    return make_system(**{"stage.gear_mesh.contact_law": "one-sided", **changes})


def with_clearance(folder):
    return build_system(stage_train(folder, **{"stage.planet_bearing.clearance_um": "15"}))


SYSTEMS = {
    "one-sided": lambda _: bending(),
    "linear": lambda _: bending(**{"stage.gear_mesh.contact_law": "linear"}),
    "rigid-ring": lambda _: make_system(["ring"]),
    "clearance": with_clearance,
    "gyroscopic": lambda _: build_system(load_case("lin-parker")),
}


@pytest.mark.parametrize(
    ("system", "sizes", "tolerance"),
    [*((name, [1e-4], 0.0) for name in SYSTEMS), ("one-sided", [2e-5, 4e-5, 8e-5], 5e-3)],
)
def test_numbers_around_the_arrays_of_a_step_neither_count_nor_change(
    system, sizes, tolerance, tmp_path
):
    modal = modal_system(SYSTEMS[system](tmp_path), 3000.0)
    plain, within = (stepped(modal, sizes, tolerance, guard) for guard in (False, True))
    for a, b in zip(plain, within, strict=True):
        for (name, one), (_, other) in zip(arrays(a), arrays(b), strict=True):
            assert np.array_equal(one, other), name
        assert np.isfinite(a.energy).all() and a.energy[-1].any()
