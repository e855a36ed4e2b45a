"""Rules as the paper prints or applies them, where statics says otherwise. For comparing only.

After its equations 18 to 22 and Table 5 and, where these do not give the printed figures, after
the figures themselves (source.md). Speeds rad/s, rotors positive in their own sense; torques N m,
forces N.
"""

PLANETS = 3
P_1, P_2 = 2.947, 5.167  # z_b/z_a as rounded with Table 2's ratios, 3.947 and 6.167
RADIUS_1 = 0.810  # m, half the sum of reference diameters; the planets sit at 0.863 m
RADIUS_2 = 0.516  # m, read from the eight printed forces; no source in the paper
RADIUS_2_SINGLE = 0.567  # m, half the sum of reference diameters; in the life ratio only
EXPONENT = 10 / 3


def _unshifted(p: float) -> float:
    """z_b/z_c if z_c were (z_b − z_a)/2, which profile shift has changed: 2p/(p − 1)."""
    return 2 * p / (p - 1)


def bearing_speed_1(carrier: float, ring: float) -> float:
    """ω_1 = p_1 (ω_x + ω_b), rotors counter-rotating; statics has z_b/z_c in place of z_b/z_a."""
    return P_1 * (carrier + ring)


def bearing_speed_2(carrier: float, ring: float) -> float:
    """ω_2 = 2 p_2/(p_2 − 1) [(1 + p_1) ω_x + p_1 ω_b]."""
    return _unshifted(P_2) * ((1 + P_1) * carrier + P_1 * ring)


def bearing_force_1(carrier_torque: float) -> float:
    """F_c1 = T_x1/(C_s R_x1), eq. 18."""
    return carrier_torque / (PLANETS * RADIUS_1)


def bearing_force_2(carrier_torque: float) -> float:
    """F_c2 = T_x2/(C_s R_x2), eq. 19."""
    return carrier_torque / (PLANETS * RADIUS_2)


def life_1(speed: float, force: float, single_speed: float, single_torque: float) -> float:
    """L_1 over the single rotor's; two rules for the bearing's speed are mixed.

    speed, force: ω_1 and F_c1 of the double rotor; single_…: carrier speed and torque.
    """
    single = _unshifted(P_1) * single_speed
    return single / speed * (bearing_force_1(single_torque) / force) ** EXPONENT


def life_2(speed: float, force: float, single_speed: float, single_torque: float) -> float:
    """L_2 over the single rotor's; two radii are mixed.

    single_speed: of the carrier of stage 1; single_torque: of that of stage 2.
    """
    reference_force = single_torque / (PLANETS * RADIUS_2_SINGLE)
    return bearing_speed_2(single_speed, 0.0) / speed * (reference_force / force) ** EXPONENT
