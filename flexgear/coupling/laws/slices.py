"""Tooth pair with independent slices of its contact line: load along the face.

The pair has two rows, at z_c − ρ and z_c + ρ on its contact line, with its centre of stiffness z_c
and the radius of gyration ρ of its stiffness. For rigid flanks the approach is affine along the
line, so that slice j at z_j is compressed by

    x_j = (1 − t_j) δ_a + t_j δ_b − g_j,    t_j = (z_j − z_c + ρ)/(2 ρ),

g_j being the gap, and its force f_j acts on the rows by F_a = Σ (1 − t_j) f_j and F_b = Σ t_j f_j,
which is exact in resultant and moment. With this z_c and ρ the rows are two uncoupled springs of
half the stiffness each while the whole line touches.

Slices are independent springs f = k ⟨x⟩. Damping is τ ḟ of the elastic force, neither pulls nor
exceeds it, and with one slice is that of the one-sided law. Parameters: number of slices, τ s, a
constant damper on each row (``basic``), N s/m, then t, k N/m and g m of all slices.
"""

from flexgear.coupling.laws.basic import add_damper, clear
from flexgear.coupling.laws.law import Law, compiled_law

COUNT, RELAXATION, DAMPER, FIRST = range(4)
LEAST_TANGENT = 1e-9  # of a pair out of contact, over its stiffness


@compiled_law
def _slices(parameters, motion, force, tangent):
    """Sums over the slices; a pair out of contact has a small tangent, and no elastic force."""
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
        tangent[0, 0, 0] = tangent[0, 1, 1] = 0.5 * LEAST_TANGENT * stiffness
    tangent[0, 1, 0], tangent[1, 1, 0] = tangent[0, 0, 1], tangent[1, 0, 1]
    add_damper(parameters[DAMPER], motion, force, tangent)
    return energy


SLICES = Law("slices", _slices)
