"""Random sets of errors for any system."""

from dataclasses import fields, replace

import numpy as np

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.error_sets import ErrorSets


def random_sets(pairs, count, size, seed=0):
    """All errors that pair data can hold, normal with standard deviation ``size`` m or less."""
    rng = np.random.default_rng(seed)

    def normal(shape, share=1.0):
        return rng.normal(0.0, share * size, (count, *shape))

    return ErrorSets(
        amplitude=normal(pairs.error_amplitude.shape, 0.3),
        phase=rng.uniform(0, 2 * np.pi, (count, *pairs.error_phase.shape)),
        offset=normal(pairs.error_offset.shape),
        slope=normal(pairs.error_slope.shape) / pairs.half_face,
        gear=normal(pairs.error_gear.shape, 0.1),
        planet=normal(pairs.error_planet.shape, 0.1),
        runout_amplitude=normal(pairs.runout_amplitude.shape),
        runout_phase=rng.uniform(0, 2 * np.pi, (count, *pairs.runout_phase.shape)),
    )


def picked(sets, at):
    """Some of the sets, whose flanks are those of the case."""
    names = [f.name for f in fields(ErrorSets) if f.name != "gaps"]
    return ErrorSets(**{name: getattr(sets, name)[at] for name in names})


def revolutions(modal, input_angles, torque, sets):
    """Forces (p, M, J) by one revolution a set."""
    forces = []
    for j in range(len(sets)):
        system = modal.system.with_(pairs=sets.pairs(modal.system.pairs, j))
        forces.append(
            revolution(replace(modal, system=system), input_angles, torque).pair_load.sum(-1)
        )
    return np.stack(forces, axis=-1)
