"""SciPy's solve_ivp on the same coupled system in kept modes: y = [eta, v].

The right-hand side is compiled (flexgear's own contact solution at a given state), so that what is
compared is the number of its evaluations and the work of the integrator, not Python against numba.
"""

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.stages import copied
from flexgear.analysis.step_space import accelerate, begin, step_data, work_space, zero_step
from flexgear.analysis.transient import State
from flexgear.coupling.modal import ModalSystem


class Integrator:
    """Work space and tolerances of one system."""

    def __init__(self, modal: ModalSystem, torque: float, method: str, rtol: float) -> None:
        self.modal, self.method, self.rtol = modal, method, rtol
        self.torque = np.array([torque])
        self.space = work_space(modal)
        self.data = zero_step(step_data(modal, 1e-4), modal)
        begin(self.space, self.data)
        self.evaluations = 0

    def run(self, start: State, span: float) -> np.ndarray:
        """Modal coordinates after a span of time, s."""
        state, n = copied(start), len(start.eta)
        state.energy_in[0] = np.inf  # trial states may lie far off: that is no motion that ran away

        def slope(_: float, y: np.ndarray) -> np.ndarray:
            state.eta[:], state.velocity[:] = y[:n], y[n:]
            if accelerate(self.modal, self.data, state, self.torque, self.space):
                raise ArithmeticError("no contact state")
            return np.concatenate([state.velocity, state.acceleration])

        elastic = np.abs(start.eta[self.modal.rigid_count :]).max()
        speed = np.abs(start.velocity).max()
        scale = np.concatenate([np.full(n, elastic), np.full(n, speed)])
        solution = solve_ivp(
            slope,
            (0.0, span),
            np.concatenate([start.eta, start.velocity]),
            method=self.method,
            rtol=self.rtol,
            atol=self.rtol * scale,
            t_eval=[span],
        )
        if not solution.success:
            raise ArithmeticError(solution.message)
        self.evaluations = solution.nfev
        return solution.y[:n, -1]
