"""A planar or spatial lumped planetary stage written down independently of flexgear's builder.

Central members and planets have coordinates (x, y, rz) or all six; planets in own axes (x radial
outward, y tangential). Sun gear mesh n = (sin α, −cos α), ring gear mesh n = (−sin α, −cos α) on
the planet, N = cosβ n + sinβ e_z; compression = N·(u_gear(C) − u_planet(C)).
Data of Lin & Parker 1999, J. Vib. Acoust. 121:316.
"""

from dataclasses import dataclass, field

import numpy as np

from flexgear.model.names import BodyName
from flexgear.structures.bodies import Body

PLANAR = (0, 1, 5)
SPATIAL = (0, 1, 2, 3, 4, 5)
ALPHA = np.radians(24.6)
MASS = {"sun": 0.4, "ring": 2.35, "carrier": 5.43, "planet": 0.66}
EQUIVALENT = {"sun": 0.39, "ring": 3.0, "carrier": 6.29, "planet": 0.61}  # I/r²
RADIUS = {"sun": 0.03871, "ring": 0.137515, "carrier": 0.0884, "planet": 0.050175}
GEAR_MESH, BEARING, RING_TORSION = 5e8, 1e8, 1e9


@dataclass(frozen=True)
class LumpedStage:
    """bodies; mass, stiffness without gear meshes (d, d); rows (n, d) and stiffness (n,) of the
    gear meshes, ring then sun, planet by planet; springs: name -> (rows, matrix) of all others."""

    bodies: tuple[Body, ...]
    mass: np.ndarray
    support: np.ndarray
    rows: np.ndarray
    gear_mesh_stiffness: np.ndarray
    springs: dict = field(default_factory=dict)

    @property
    def stiffness(self):
        return self.support + (self.rows.T * self.gear_mesh_stiffness) @ self.rows

    def modes(self):
        """Frequencies in Hz and M-orthonormal shapes."""
        from scipy.linalg import eigh

        values, shapes = eigh(self.stiffness, self.mass)
        return np.sqrt(np.clip(values, 0, None)) / (2 * np.pi), shapes


def _body(name, mass, polar, dofs):
    full = np.diag([mass, mass, mass, 0.6 * polar, 0.6 * polar, polar])
    at = np.ix_(dofs, dofs)
    return Body(
        BodyName.parse(name), (name,), np.zeros((1, 3)), full[at], np.zeros((len(dofs),) * 2),
        np.eye(6)[:, dofs], np.eye(6)[list(dofs)], rigid=True,
    )  # fmt: skip


def lin_parker(planets=3, *, dofs=PLANAR, helix=0.0, ring_torsion=RING_TORSION, angles=None,
               axial=1e8, tilt=1e5, gear_mesh=GEAR_MESH, planet_bearing=BEARING,
               central=None, sun_torsion=0.0, carrier_torsion=0.0):  # fmt: skip
    """The stage with any number of planets, planar or spatial (axial N/m, tilt N m/rad a body).

    central: radial support N/m by name of central member, where it is not the published one;
    …_torsion: support k of u = r θ, N/m.
    """
    phi = 2 * np.pi * np.arange(planets) / planets if angles is None else np.asarray(angles)
    names = ["sun", "ring", "carrier"] + [f"planet_{i + 1}" for i in range(planets)]
    kinds = ["sun", "ring", "carrier"] + ["planet"] * planets
    bodies = tuple(
        _body(n, MASS[k], EQUIVALENT[k] * RADIUS[k] ** 2, dofs)
        for n, k in zip(names, kinds, strict=True)
    )
    w, size = len(dofs), len(dofs) * len(bodies)

    def motion(name):
        rows = np.zeros((6, size))
        i = names.index(name)
        rows[:, i * w : (i + 1) * w] = bodies[i].node_map
        return rows

    def at(name, angle, radius):
        """Motion of a point at (radius, angle) of a central member in axes turned by angle."""
        c, s = np.cos(angle), np.sin(angle)
        u = motion(name)
        turn = np.kron(np.eye(2), np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
        u = turn @ u
        u[1] += radius * u[5]
        u[2] -= radius * u[4]
        return u

    springs, support = {}, np.zeros((size, size))
    for name, torsion in (
        ("sun", sun_torsion),
        ("ring", ring_torsion),
        ("carrier", carrier_torsion),
    ):
        twist = torsion * RADIUS[name] ** 2
        radial = (central or {}).get(name, BEARING)
        matrix = np.diag([radial, radial, axial, tilt, tilt, twist])
        springs[f"{name}_support"] = (motion(name), matrix)
    for i, angle in enumerate(phi):
        pin = at("carrier", angle, RADIUS["carrier"]) - motion(f"planet_{i + 1}")
        pin[5] = 0.0
        matrix = np.diag([planet_bearing, planet_bearing, axial, tilt, tilt, 0.0])
        springs[f"planet_bearing_{i + 1}"] = (pin, matrix)
    for rows, matrix in springs.values():
        support += rows.T @ matrix @ rows
    mesh_rows = []
    for gear, side in (("ring", -1.0), ("sun", 1.0)):
        hand = -1.0 if gear == "sun" else 1.0
        for i, angle in enumerate(phi):
            n = np.cos(helix) * np.array([side * np.sin(ALPHA), -np.cos(ALPHA), 0.0])
            n[2] = hand * np.sin(helix)
            gear_u, planet_u = at(gear, angle, 0.0), motion(f"planet_{i + 1}")
            # contact point: foot of the line of action on the base circle will do in the plane
            arm_p = RADIUS["planet"] * np.array([-side * np.cos(ALPHA), -np.sin(ALPHA), 0.0])
            arm_g = arm_p + np.array([RADIUS["carrier"], 0.0, 0.0])
            row = n @ _point(gear_u, arm_g) - n @ _point(planet_u, arm_p)
            # the printed base radii and centre distance do not close; base radii decide
            moment = -np.cos(helix) * RADIUS[gear] * gear_u[5]
            mine = (arm_g[0] * n[1] - arm_g[1] * n[0]) * gear_u[5]
            mesh_rows.append(row + moment - mine)
    rows = np.array(mesh_rows)
    return LumpedStage(
        bodies, _block(bodies), support, rows, np.full(len(rows), gear_mesh), springs
    )


def _point(u, arm):
    skew = np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
    return u[:3] - skew @ u[3:]


def _block(bodies):
    from scipy.linalg import block_diag

    return block_diag(*[b.mass for b in bodies])
