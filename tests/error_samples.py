"""Random sets of errors for any system."""

import numpy as np

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
