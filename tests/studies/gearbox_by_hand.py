"""A gearbox that nobody has, and its ISO 6336 rating as text books print it; nothing of flexgear.

Two planetary stages: "low" helical, "high" spur; rings cut by shapers, six kinds of steel. N, mm,
N/mm², µm, r/min.
"""

import math
from itertools import pairwise
from math import asin, atan, cos, log, pi, radians, sin, sqrt, tan

import numpy as np
from scipy.optimize import brentq

# tooth number, profile shift, tool's tip radius, steel, grade, HV, σ_Hlim, σ_Flim by ISO 6336-5,
# R_z of flank and root, accuracy grade, bore or rim, ρ' of the notch
GEAR = (
    "z", "x", "fillet", "steel", "grade", "hv", "s_h", "s_f", "rz_flank", "rz_root", "accuracy",
    "size", "layer",
)  # fmt: skip
GEARS = ("sun", "planet", "ring")
STAGES = {
    "low": {
        "planets": 4, "m": 12.0, "beta": 7.5, "b": 260.0, "cutter": (29, 0.1),
        "k_gamma": 1.13, "k_h_beta": {"sun": 1.21, "ring": 1.18},
        "sun": (23, 0.35, 0.38, "case_hardened", "ME", 720, 1650, 525, 4.8, 18, 5, 90, 0.003),
        "planet": (37, 0.2, 0.38, "case_hardened", "MQ", 690, 1500, 500, 5, 20, 5, 300, 0.003),
        "ring": (97, -0.75, 0.2, "nitrided_through_hardening", "MQ", 520, 998, 363, 7, 25, 6, 30,
                 0.1005),
    },
    "high": {
        "planets": 3, "m": 7.0, "beta": 0.0, "b": 190.0, "cutter": (25, 0.0),
        "k_gamma": 1.07, "k_h_beta": {"sun": 1.12, "ring": 1.15},
        "sun": (21, 0.3, 0.3, "induction_hardened", "MQ", 560, 0.541 * 560 + 882,
                0.138 * 560 + 290, 6, 16, 4, 60, 0.003),
        "planet": (30, 0.1, 0.3, "nitrided", "ME", 700, 1450, 468, 5, 14, 3, 150, 0.1005),
        "ring": (81, -0.5, 0.2, "through_hardened", "MQ", 300, 1.313 * 300 + 373,
                 0.425 * 300 + 187, 12, 30, 7, 18, 0.0194 + 0.75 * (0.0064 - 0.0194)),
    },
}  # fmt: skip
RATED, SPEED, K_A, VISCOSITY = 4e5, 75.0, 1.05, 220.0  # N m and r/min of low.carrier, mm²/s
ALPHA = radians(20)
NITRIDED = ("nitrided", "nitrided_through_hardening")


def inv(angle):
    return tan(angle) - angle


def working_angle(involute):
    return brentq(lambda a: inv(a) - involute, 1e-3, 1.2)


class ByHand:
    """One stage."""

    def __init__(self, name, edition):
        self.edition, data = edition, STAGES[name]
        self.n, self.m, self.b = data["planets"], data["m"], data["b"]
        wider = {"low": {"planet": 290.0}, "high": {"ring": 200.0}}[name]
        self.width = {g: min(wider.get(g, self.b), self.b + 2 * self.m) for g in data if g in GEARS}
        self.k_gamma, self.k_h_beta = data["k_gamma"], data["k_h_beta"]
        self.of = {g: dict(zip(GEAR, data[g], strict=True)) for g in GEARS}
        self.beta = beta = radians(data["beta"])
        self.at, self.bb = atan(tan(ALPHA) / cos(beta)), asin(sin(beta) * cos(ALPHA))
        z = {g: self.of[g]["z"] for g in GEARS}
        self.zn = {g: n / (cos(self.bb) ** 2 * cos(beta)) for g, n in z.items()}
        self.d = {g: n * self.m / cos(beta) for g, n in z.items()}
        self.db = {g: d * cos(self.at) for g, d in self.d.items()}
        sign = {"sun": 1, "planet": 1, "ring": -1}
        x = {g: self.of[g]["x"] for g in GEARS}
        self.da = {g: self.d[g] + sign[g] * 2 * self.m * (1 + x[g]) for g in GEARS}
        self.df = {g: self.d[g] - sign[g] * 2 * self.m * (1.25 - x[g]) for g in GEARS}
        self.z0, self.x0 = data["cutter"]
        self.cutter_tip = self.z0 * self.m / cos(beta) + 2 * self.m * (1.25 + self.x0)
        turned = 2 * tan(ALPHA) * (-x["ring"] - self.x0) / (z["ring"] - self.z0)
        distance = (z["ring"] - self.z0) * self.m / cos(beta) * cos(self.at) / 2
        distance /= cos(working_angle(inv(self.at) + turned))
        self.df["ring"] = 2 * distance + self.cutter_tip
        self.mesh = {"sun": self._mesh("sun", 1), "ring": self._mesh("ring", -1)}
        self.roots = {("planet", role): self._root("planet", role) for role in ("sun", "ring")} | {
            ("sun", "sun"): self._root("sun", "sun"),
            ("ring", "ring"): self._ring_root() if edition == 2019 else self._substitute_root(),
        }

    def _mesh(self, role, sign):
        """Working angle, centre distance, ε_α, ε_β, roll lengths from the tangent points."""
        gear, planet = self.of[role], self.of["planet"]
        teeth = gear["z"] + sign * planet["z"]
        shift = sign * gear["x"] + planet["x"] * (1 if sign > 0 else -1)
        angle = working_angle(inv(self.at) + 2 * tan(ALPHA) * shift / teeth)
        a = teeth * self.m / cos(self.beta) / 2 * cos(self.at) / cos(angle)
        pitch = pi * self.m / cos(self.beta) * cos(self.at)
        tip = {g: sqrt((self.da[g] / 2) ** 2 - (self.db[g] / 2) ** 2) for g in ("planet", role)}
        path = tip["planet"] + sign * (tip[role] - a * sin(angle))
        e_alpha, e_beta = path / pitch, self.b * sin(self.beta) / (pi * self.m)
        return {"angle": angle, "a": a, "pitch": pitch, "tip": tip, "e_alpha": e_alpha,
                "e_beta": e_beta, "sign": sign}  # fmt: skip

    def _root(self, part, role):
        """Y_F without f_ε, Y_S, q_s of a gear cut by a rack: ISO 6336-3, 6.2."""
        m, zn, x, gear = self.m, self.zn[part], self.of[part]["x"], self.of[part]
        fillet, e_n = gear["fillet"], self.mesh[role]["e_alpha"] / cos(self.bb) ** 2
        big_e = pi / 4 - 1.25 * tan(ALPHA) - (1 - sin(ALPHA)) * fillet / cos(ALPHA)
        g = fillet - 1.25 + x
        theta = pi / 6
        for _ in range(300):
            theta = 2 * g / zn * tan(theta) - 2 / zn * (pi / 2 - big_e) + pi / 3
        s = zn * sin(pi / 3 - theta) + sqrt(3) * (g / cos(theta) - fillet)
        rho = fillet + 2 * g**2 / (cos(theta) * (zn * cos(theta) ** 2 - 2 * g))
        tip, base = zn / 2 + (self.da[part] - self.d[part]) / 2 / m, zn / 2 * cos(ALPHA)
        roll = sqrt(tip**2 - base**2) - pi * cos(ALPHA) * (e_n - 1)
        angle = atan(roll / base)
        gamma = (pi / 2 + 2 * tan(ALPHA) * x) / zn + inv(ALPHA) - inv(angle)
        load, at = angle - gamma, base / cos(angle)
        h = (cos(gamma) - sin(gamma) * tan(load)) * at - zn / 2 * cos(pi / 3 - theta)
        return self._form(s, h - g / cos(theta) / 2 + fillet / 2, rho, load)

    def _ring_root(self):
        """Of the ring by the path of the round tip of its cutter, point by point, in modules of the
        normal section; the section is where the tangent makes 60° with the tooth's middle."""
        zn, x, fillet = self.zn["ring"], self.of["ring"]["x"], self.of["ring"]["fillet"]
        z0 = self.z0 / (cos(self.bb) ** 2 * cos(self.beta))
        angle = working_angle(inv(ALPHA) + 2 * tan(ALPHA) * (-x - self.x0) / (zn - z0))
        distance, pitch = ((k * cos(ALPHA) / cos(angle) / 2) for k in (zn - z0, zn))
        centre = (
            z0 / 2 + (self.cutter_tip - self.z0 * self.m / cos(self.beta)) / 2 / self.m - fillet
        )
        base = z0 / 2 * cos(ALPHA)
        half = (pi / 2 + 2 * self.x0 * tan(ALPHA)) / z0 + inv(ALPHA) - fillet / base
        half -= inv(math.acos(base / centre))

        def curve(turn):  # of the cutter, rad; complex, the tooth's middle is the real axis
            c = distance + centre * np.exp(1j * (half + turn))
            c += fillet * (c - pitch) / abs(c - pitch)
            return np.conj(c * np.exp(-1j * (turn * z0 / zn + pi / zn)))

        def slope(turn):
            step = curve(turn + 1e-6) - curve(turn - 1e-6)
            return abs(math.atan2(abs(step.imag), abs(step.real)))

        turns = np.linspace(-half - 0.5, -half + 0.5, 2001)  # the tip is deepest about −half
        steep = [t for t in turns if curve(t).imag > 0]
        inside = [(s, t) for s, t in pairwise(steep)
                  if (slope(s) - pi / 3) * (slope(t) - pi / 3) < 0]  # fmt: skip
        place = min((brentq(lambda t: slope(t) - pi / 3, *ends) for ends in inside),
                    key=lambda t: curve(t).imag)  # fmt: skip
        h, points = 1e-4, curve(place + 1e-4 * np.array([-1, 0, 1]))
        first, second = (
            (points[2] - points[0]) / 2 / h,
            (points[2] - 2 * points[1] + points[0]) / h**2,
        )
        rho = abs(first) ** 3 / abs((np.conj(first) * second).imag)
        section = points[1]
        e_n = self.mesh["ring"]["e_alpha"] / cos(self.bb) ** 2
        tip = zn / 2 + (self.da["ring"] - self.d["ring"]) / 2 / self.m
        base = zn / 2 * cos(ALPHA)
        roll = sqrt(tip**2 - base**2) + pi * cos(ALPHA) * (e_n - 1)
        at = atan(roll / base)
        load = at + (pi / 2 + 2 * x * tan(ALPHA)) / zn - inv(ALPHA) + inv(at)
        return self._form(2 * section.imag, section.real - base / cos(load), rho, load)

    def _substitute_root(self):
        """Of the ring by the rack in place of its cutter: ISO 6336-3:2006, 6.2, corrected in 2007,
        z_n < 0. h_fP from the root circle of the cutter."""
        zn, x, tip = -self.zn["ring"], self.of["ring"]["x"], self.of["ring"]["fillet"]
        depth = (self.df["ring"] - self.d["ring"]) / 2 / self.m + x
        round_tip = tip + (self.x0 + depth - tip) ** 1.95 / (3.156 * 1.036**self.z0)  # ρ_fPv
        big_e = pi / 4 - depth * tan(ALPHA) - (1 - sin(ALPHA)) * round_tip / cos(ALPHA)
        g, big_h = round_tip - depth + x, 2 / zn * (pi / 2 - big_e) - pi / 6
        theta = brentq(lambda t: 2 * g / zn * tan(t) - big_h - t, 0.1, 1.2, xtol=1e-15)
        q = g / cos(theta) - round_tip
        s, rho = zn * sin(pi / 6 - theta) + q, 2 * g**2 / cos(theta)
        rho = round_tip + rho / (abs(zn) * cos(theta) ** 2 - 2 * g)
        e_n = self.mesh["ring"]["e_alpha"] / cos(self.bb) ** 2
        tip_diameter = zn - (self.da["ring"] - self.d["ring"]) / self.m
        base = zn * cos(ALPHA)
        roll = sqrt((tip_diameter / 2) ** 2 - (base / 2) ** 2) + pi * cos(ALPHA) * (e_n - 1)
        loaded = -2 * sqrt(roll**2 + (base / 2) ** 2)  # d_en
        at = math.acos(base / loaded)
        gamma = (pi / 2 + 2 * x * tan(ALPHA)) / zn + inv(ALPHA) - inv(at)
        load = at - gamma
        h = (cos(gamma) - sin(gamma) * tan(load)) * loaded
        h -= zn * cos(pi / 6 - theta) + sqrt(3) * q
        return self._form(s, h / 2, rho, load)

    @staticmethod
    def _form(s, h, rho, load):
        slim, notch = s / h, s / 2 / rho
        form = 6 * h * cos(load) / (s**2 * cos(ALPHA))
        tooth = {
            "h_Fe/m_n": h, "s_Fn/m_n": s, "ρ_F/m_n": rho, "α_Fen": math.degrees(load),
        }  # fmt: skip
        return form, (1.2 + 0.13 * slim) * notch ** (1 / (1.21 + 2.3 / slim)), notch, tooth

    def _tolerance(self, kind, grade, d):
        """µm, ISO 1328-1: of 1995 at geometric means of the ranges, of 2013 as calculated; both
        rounded."""
        m = self.m
        if self.edition == 2006:
            ends = [end for end in (125, 280, 560, 1000, 1600, 2500) if end >= d]
            below = {280: 125, 560: 280, 1000: 560, 1600: 1000}[ends[0]]
            d, m = sqrt(ends[0] * below), sqrt({12.0: 10 * 16, 7.0: 6 * 10}[m])
            fifth = {
                "pitch": 0.3 * (m + 0.4 * sqrt(d)) + 4,
                "profile": 2.5 * sqrt(m) + 0.17 * sqrt(d) + 0.5,
            }[kind]
        else:
            fifth = {"pitch": 0.001 * d + 0.4 * m + 5, "profile": 0.55 * m + 5}[kind]
        value = fifth * sqrt(2) ** (grade - 5)
        per_micron = 10 if value < 5 else 2 if value <= 10 else 1
        return math.floor(value * per_micron + 0.5) / per_micron

    def factors(self, role, force, v):
        """K_A … K_Fα by method B."""
        mesh, pair = self.mesh[role], [self.of[g] for g in ("planet", role)]
        order = sorted(pair, key=lambda g: g["z"])
        ends = [g["z"] / (cos(self.bb) ** 2 * cos(self.beta)) for g in order]
        x1, x2 = (g["x"] for g in order)
        if role == "ring":
            ends[1] = math.inf
        q = 0.04723 + 0.15551 / ends[0] + 0.25791 / ends[1] - 0.00635 * x1 - 0.11654 * x1 / ends[0]
        q += -0.00193 * x2 - 0.24188 * x2 / ends[1] + 0.00529 * x1**2 + 0.00182 * x2**2
        full = 0.8 / q * 0.975 * cos(self.beta)
        e_gamma = mesh["e_alpha"] + mesh["e_beta"]
        w = force * K_A * self.k_gamma / self.b
        c = full * min(w / 100, 1) ** 0.25
        deviations = [
            max(self._tolerance(kind, self.of[g]["accuracy"], self.d[g]) for g in ("planet", role))
            for kind in ("pitch", "profile")
        ]
        deviations[0] *= cos(self.at)

        def run_in(f, gear):
            if gear["steel"] != "through_hardened":
                return min(0.075 * f, 3.0)
            most = math.inf if v <= 5 else (12800 if v <= 10 else 6400) / gear["s_h"]
            return min(160 / gear["s_h"] * f, most)

        pitch_error, profile = (f - sum(run_in(f, g) for g in pair) / 2 for f in deviations)

        def inertia(g):  # of a disc over b r_b², kg/mm
            middle = (self.da[g] + self.df[g]) / 2
            inertia = pi / 32 * 7.83e-6 * (middle**4 - self.of[g]["size"] ** 4)
            return inertia / (self.db[g] / 2) ** 2

        mass = inertia("planet")
        if role == "sun":
            mass = 1 / (1 / mass + self.n / inertia("sun"))
        frequency = 1e3 * v / (pi * self.m / cos(self.beta))
        c_gamma = c * (0.75 * mesh["e_alpha"] + 0.25)
        resonance = 2 * pi * frequency / sqrt(1e6 * c_gamma / mass)
        b_p, b_f = c * pitch_error / w, c * profile / w
        relief = sum((g["s_h"] / 97 - 18.45) ** 2 / 18 + 1.5 for g in pair) / 2
        b_k = 1.0 if max(g["accuracy"] for g in pair) >= 6 else abs(1 - c * relief / w)
        assert resonance < 0.5, "subcritical at any load"
        c2, c3 = 0.34, 0.23
        if e_gamma > 2:
            c2, c3 = 0.57 / (e_gamma - 0.3), 0.096 / (e_gamma - 1.56)
        k_v = 1 + resonance * (0.32 * b_p + c2 * b_f + c3 * b_k)
        k_v, k_h = max(k_v, 1.0), self.k_h_beta[role]
        slim = max(abs(self.da[g] - self.df[g]) / 2 / self.width[g] for g in ("planet", role))
        uneven = c_gamma * max(pitch_error, profile) / (w * k_v * k_h)
        across = e_gamma / 2 * (0.9 + 0.4 * uneven)
        if e_gamma > 2:
            across = 0.9 + 0.4 * sqrt(2 * (e_gamma - 1) / e_gamma) * uneven
        most = e_gamma / (mesh["e_alpha"] * self.z_epsilon(role) ** 2)
        most_root = e_gamma / (0.25 * mesh["e_alpha"] + 0.75)
        return {
            "K_A": K_A, "K_γ": self.k_gamma, "K_v": k_v, "K_Hβ": k_h,
            "K_Fβ": k_h ** (1 / (1 + slim + slim**2)),
            "K_Hα": max(1.0, min(across, most)), "K_Fα": max(1.0, min(across, most_root)),
            "c′_th": 1 / q, "c′": c, "c_γα": c_gamma, "m_red": mass, "N": resonance,
            "f_pb,eff": pitch_error, "f_fα,eff": profile,
        }  # fmt: skip

    def z_epsilon(self, role):
        e_alpha, e_beta = (self.mesh[role][e] for e in ("e_alpha", "e_beta"))
        return sqrt((4 - e_alpha) / 3 * (1 - e_beta) + e_beta / e_alpha)

    def flank(self, part, role, force, v, k):
        """Factors, and life curve."""
        mesh, gear, mate = (
            self.mesh[role],
            self.of[part],
            self.of["planet" if part == role else role],
        )
        small = min(("planet", role), key=lambda g: self.of[g]["z"])
        u = max(self.of[g]["z"] for g in ("planet", role)) / self.of[small]["z"]
        working, sign, helix = mesh["angle"], mesh["sign"], cos(self.beta)
        f = {
            "F_t": force, "v": v,
            "Z_H": sqrt(2 * cos(self.bb) * cos(working) / (cos(self.at) ** 2 * sin(working))),
            "Z_E": sqrt(206e3 / (2 * pi * (1 - 0.3**2))),
            "Z_ε": self.z_epsilon(role),
            "Z_β": 1 / sqrt(helix),  # 2006 by its corrigendum of 2008
        }  # fmt: skip
        line = force / (self.d[small] * self.b) * (u + sign) / u
        f["σ_H0"] = f["Z_H"] * f["Z_E"] * f["Z_ε"] * f["Z_β"] * sqrt(line)
        rho = {g: self.db[g] / 2 * tan(working) for g in ("planet", role)}
        between, single = mesh["a"] * sin(working), 1.0
        if part != "ring":  # curvatures at the inner point of single contact
            inner = mesh["tip"][part] - mesh["pitch"]
            other = between - sign * inner  # of the mate
            ratio = sqrt(rho["planet"] * rho[role] / (inner * other))
            single = max(1.0, ratio - mesh["e_beta"] * (ratio - 1))
        f["Z_B" if part == small else "Z_D"] = single
        product = math.prod(k[s] for s in ("K_A", "K_γ", "K_v", "K_Hβ", "K_Hα"))
        f["σ_H"] = single * f["σ_H0"] * sqrt(product)
        softer = min(max(min(gear["s_h"], mate["s_h"]), 850), 1200)
        c_l = 0.83 + 0.08 * (softer - 850) / 350
        rough = (gear["rz_flank"] + mate["rz_flank"]) / 2
        reduced = rho["planet"] * rho[role] / (rho[role] + sign * rho["planet"])
        rough *= (10 / reduced) ** (1 / 3)
        f |= {
            "σ_Hlim": gear["s_h"],
            "Z_L": c_l + 4 * (1 - c_l) / (1.2 + 134 / VISCOSITY) ** 2,
            "Z_v": c_l + 0.02,
            "Z_R": (3 / rough) ** (0.32 - 0.0002 * softer),
            "Z_W": 1.0, "Z_X": 1.0,
        }  # fmt: skip
        if v > 0:
            f["Z_v"] += 2 * (0.98 - c_l) / sqrt(0.8 + 32 / v)
        if gear["steel"] == "through_hardened":
            hard = mate["rz_flank"] * (10 / reduced) ** 0.33
            hard *= (mate["rz_flank"] / gear["rz_flank"]) ** 0.66
            hard /= (max(v, 1e-9) * VISCOSITY / 1500) ** 0.33
            soft = 1.2 - (0.95 * gear["hv"] - 130) / 1700
            f["Z_W"] = soft * (3 / min(max(hard, 3), 16)) ** 0.15
        strength = math.prod(f[s] for s in ("σ_Hlim", "Z_L", "Z_v", "Z_R", "Z_W"))
        first = (1e5, 1.3), (2e6, 1.0)
        if gear["steel"] not in NITRIDED:
            first = (1e5, 1.6), (5e7, 1.0)
        return f, Curve([*first, (1e10, 0.85)], strength / f["σ_H"])

    def root(self, part, role, force, k):
        """Factors, and life curve."""
        mesh, gear = self.mesh[role], self.of[part]
        form, notch, q_s, tooth = self.roots[part, role]
        e_n, e_beta = mesh["e_alpha"] / cos(self.bb) ** 2, mesh["e_beta"]
        tilt = 1 - e_beta * math.degrees(self.beta) / 120
        if self.edition == 2019:
            assert e_n < 2
            form *= sqrt(1 - e_beta + e_beta / e_n)
            tilt /= cos(self.beta) ** 3
        if part == "ring":
            rim = max(1.0, 1.15 * log(8.324 * self.m / gear["size"]))
        else:
            height = (self.da[part] - self.df[part]) / 2
            rim = max(1.0, 1.6 * log(2.242 * height / ((self.df[part] - gear["size"]) / 2)))
        f = {"Y_F": form, "Y_S": notch, "Y_β": tilt, "Y_DT": 1.0, "Y_B": rim}
        f["σ_F0"] = force / (self.width[part] * self.m) * math.prod(f.values())
        f["σ_F"] = f["σ_F0"] * math.prod(k[s] for s in ("K_A", "K_γ", "K_v", "K_Fβ", "K_Fα"))
        soft, layer = gear["steel"] == "through_hardened", gear["layer"]
        rough = 1.674 - 0.529 * (gear["rz_root"] + 1) ** 0.1
        if gear["steel"] in NITRIDED:
            rough = 4.299 - 3.259 * (gear["rz_root"] + 1) ** 0.0058
        ratio = 0.3 if gear["steel"] == "nitrided" else 0.8 - 0.15 * notch
        f |= {
            "σ_Flim": gear["s_f"], "Y_ST": 2.0,
            "Y_δrelT": (1 + sqrt(layer * (1 + 2 * q_s) / 5)) / (1 + sqrt(layer * 1.2)),
            "Y_RrelT": rough,
            "Y_X": 1.03 - 0.006 * self.m if soft else 1.05 - 0.01 * self.m,
            "Y_M": 1 / (1 + 1.2 * (1 - ratio) / (1 + ratio)) if part == "planet" else 1.0,
        }  # fmt: skip
        f |= tooth
        last = ("σ_Flim", "Y_ST", "Y_δrelT", "Y_RrelT", "Y_X", "Y_M")
        first = (1e4 if soft else 1e3, 1.6 if gear["steel"] in NITRIDED else 2.5)
        curve = Curve([first, (3e6, 1.0), (1e10, 0.85)], math.prod(f[s] for s in last) / f["σ_F"])
        return f, curve


class Curve:
    """Safety over cycles, straight between knees in logarithms and on; level before the first."""

    def __init__(self, knees, safety):
        self.knees, self.safety = knees, safety

    def at(self, cycles):
        """Life factor and safety."""
        (n1, f1), (n2, f2), last = self.knees
        if cycles > n2:
            (n1, f1), (n2, f2) = (n2, f2), last
        factor = f1 * (max(cycles, n1) / n1) ** (log(f2 / f1) / log(n2 / n1))
        return factor, factor * self.safety

    def damage(self, cycles, more=1.0):
        """n/N at stresses ``more`` times as large."""
        (n1, f1), (n2, f2), last = self.knees
        stress = more / self.safety
        if stress > f1:
            return math.inf
        if stress < f2:
            (n1, f1), (n2, f2) = (n2, f2), last
        return cycles / (n1 * (stress / f1) ** (log(n2 / n1) / log(f2 / f1)))


def loads(torque, speed):
    """By stage: F_t, v, and turns per minute of sun, ring and planet against the carrier."""
    out = {}
    for name, data in STAGES.items():
        sun, planet, ring = (data[g][0] for g in ("sun", "planet", "ring"))
        ratio = 1 + ring / sun
        torque /= ratio
        diameter = sun * data["m"] / cos(radians(data["beta"]))
        turns = {"sun": speed * (ratio - 1), "planet": speed * ring / planet, "ring": speed}
        velocity = pi * diameter * turns["sun"] / 60e3
        out[name] = 2e3 * torque / data["planets"] / diameter, velocity, turns
        speed *= ratio
    return out
