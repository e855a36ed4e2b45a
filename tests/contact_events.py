"""Motion under the law of tooth pairs, by an integrator that stops at every event of their contact.

The law is written down here once more, as four states of a row that closes by δ, and the events
between them; its elastic part is k δ, its damped part c δ̇:

    open: k δ < 0, no load      pulling: k δ + c δ̇ < 0, no load
    closed: k δ + c δ̇           limited: 2 k δ, as c δ̇ > k δ
"""

import numpy as np
from scipy.integrate import solve_ivp

LOADS = {
    "open": lambda elastic, damped: 0.0, "pulling": lambda elastic, damped: 0.0,
    "closed": lambda elastic, damped: elastic + damped,
    "limited": lambda elastic, damped: 2 * elastic,
}  # fmt: skip
EVENTS = {
    "touch": lambda elastic, damped: elastic,
    "pull": lambda elastic, damped: elastic + damped,
    "limit": lambda elastic, damped: elastic - damped,
}
WATCHED = {"open": ["touch"], "pulling": ["touch", "pull"], "closed": ["pull", "limit"],
           "limited": ["limit", "touch"]}  # fmt: skip


def state_of(elastic, damped):
    if elastic <= 0.0:
        return "open"
    if elastic + damped <= 0.0:
        return "pulling"
    return "limited" if damped > elastic else "closed"


class EventIntegrator:
    """What the subclass says: ``contact(t, y)``, k δ and c δ̇ (n,) of its rows, and
    ``slope(t, y, loads)``, the rate of y under their loads (n,)."""

    def loads(self, t, y, states):
        parts = zip(states, *self.contact(t, y), strict=True)
        return np.array([LOADS[state](*part) for state, *part in parts])

    def pieces(self, y, times, stop):
        """From y at times[0] to ``stop``, between two events: states of the rows, numbers (k,) of
        the times there, y (k, d) at these, and y at the end."""
        t, done, step = times[0], -np.inf, 1e-7 * (times[1] - times[0])
        while t < stop * (1 - 1e-14):
            states = [state_of(*part) for part in zip(*self.contact(t, y), strict=True)]

            def slope(t, y, states=states):
                return self.slope(t, y, self.loads(t, y, states))

            solved = solve_ivp(
                slope, (t, stop), y, method="DOP853", rtol=1e-10, atol=1e-16, dense_output=True,
                events=[self._event(i, of) for i, s in enumerate(states) for of in WATCHED[s]],
            )  # fmt: skip
            t, y = solved.t[-1], solved.y[:, -1]
            at = np.flatnonzero((times > done) & (times <= t))
            motion = solved.sol(times[at]).T if len(at) else np.zeros((0, len(y)))
            yield states, at, motion, y
            done = t
            if solved.status == 1:  # off the event
                y, t = y + step * np.asarray(slope(t, y)), t + step

    def _event(self, row, of):
        def event(t, y):
            return EVENTS[of](*(part[row] for part in self.contact(t, y)))

        event.terminal = True
        return event
