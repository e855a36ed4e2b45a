"""A planet made of beams: a rim from tooth to tooth, spokes to the bore."""

import numpy as np
from cheap_bodies import body_of
from scipy.linalg import block_diag

from flexgear.structures.shaft import BeamSection, beam_element


def beam_planet(teeth, radius, *, young=2.06e11, poisson=0.3, density=7800.0):
    """A free body with a node at each tooth, on the circle of a radius, and one in its bore."""
    angles = 2 * np.pi * np.arange(teeth) / teeth
    places = radius * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    places = np.vstack([places, np.zeros(3)])
    size = 6 * len(places)
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for j in range(teeth):
        for other, diameter in (((j + 1) % teeth, 0.3 * radius), (teeth, 0.1 * radius)):
            along = places[other] - places[j]
            length = np.linalg.norm(along)
            axes = np.array(
                [[0.0, 0.0, 1.0], np.cross(along / length, [0, 0, 1.0]), along / length]
            )
            turned = block_diag(axes, axes, axes, axes)
            section = BeamSection(length, diameter, 0.0)
            at = np.r_[6 * j : 6 * j + 6, 6 * other : 6 * other + 6]
            for matrix, of_beam in zip(
                (stiffness, mass),
                beam_element(section, length, young, poisson, density),
                strict=True,
            ):
                matrix[np.ix_(at, at)] += turned.T @ of_beam @ turned
    names = (*(f"tooth_{j + 1:03d}" for j in range(teeth)), "bore")
    return body_of("planet", names, places, mass, stiffness)
