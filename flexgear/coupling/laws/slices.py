"""A tooth pair whose contact line is cut into slices: load along the face.

The pair has two rows, at z_c − ρ and z_c + ρ on its contact line: its centre of stiffness and the
radius of gyration of its stiffness about it. For rigid flank bodies the approach is affine along
the line, so that slice j at z_j closes by

    x_j = (1 − t_j) δ_a + t_j δ_b − g_j,    t_j = (z_j − z_c + ρ)/(2 ρ),

g_j being what its flanks lack there, and its force f_j acts on the rows by F_a = Σ (1 − t_j) f_j
and F_b = Σ t_j f_j, which is resultant and moment exactly. While the whole line touches, the rows
are two springs of half its stiffness each, not coupled: so z_c and ρ are chosen.

Slices are springs f = k ⟨x⟩ beside each other. Damping takes the rate of the elastic force, τ ḟ,
and neither pulls nor exceeds it; with one slice that is the law of pairs that are one spring.
Parameters: number of slices, τ s, a damper on each of the two rows that acts always (see
``basic``), N s/m, then t, k N/m and g m of all.
"""

from __future__ import annotations

from flexgear.coupling.laws.basic import add_damper, clear
from flexgear.coupling.laws.law import Law, compiled_law

COUNT, RELAXATION, DAMPER, FIRST = range(4)
LOOSE = 1e-9  # share of its stiffness in the tangent of a pair that does not touch


@compiled_law
def _slices(parameters, motion, force, tangent):
    """Sums over the slices; a pair in the air keeps a small tangent, and no elastic force."""
    count, relaxation = int(parameters[COUNT]), parameters[RELAXATION]
    clear(force, tangent)
    energy = stiffness = touching = 0.0
    for j in range(count):
        at = FIRST + j
        b, k = parameters[at], parameters[at + count]
        a = 1.0 - b
        stiffness += k
        x = a * motion[0, 0] + b * motion[0, 1] - parameters[at + 2 * count]
        if not x > 0.0:
            continue
        touching += k
        elastic = k * x
        damping = relaxation * k * (a * motion[1, 0] + b * motion[1, 1])
        spring, damper = k, relaxation * k
        if abs(damping) > elastic:
            limited = 1.0 if damping > 0.0 else -1.0
            damping, spring, damper = limited * elastic, (1.0 + limited) * k, 0.0
        f = elastic + damping
        energy += 0.5 * elastic * x
        force[0, 0] += a * f
        force[0, 1] += b * f
        force[1, 0] += a * elastic
        force[1, 1] += b * elastic
        tangent[0, 0, 0] += a * a * spring
        tangent[0, 0, 1] += a * b * spring
        tangent[0, 1, 1] += b * b * spring
        tangent[1, 0, 0] += a * a * damper
        tangent[1, 0, 1] += a * b * damper
        tangent[1, 1, 1] += b * b * damper
    if touching == 0.0:
        tangent[0, 0, 0] = tangent[0, 1, 1] = 0.5 * LOOSE * stiffness
    tangent[0, 1, 0], tangent[1, 1, 0] = tangent[0, 0, 1], tangent[1, 0, 1]
    add_damper(parameters[DAMPER], motion, force, tangent)
    return energy


SLICES = Law("slices", _slices)
