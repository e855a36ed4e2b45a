"""Numerical options of a case; options that are left out follow from it (``coupling/pace.py``)."""

from typing import Literal

from pydantic import Field

from flexgear.model.section import Refusal, Section
from flexgear.model.units import Frequency, Time

GEAR_MESH_ORDERS = 10  # that results resolve where a case does not state another number
MAX_STEP_HALVINGS = 12  # of the time step; a receptance is stored for each step size


class Solver(Section):
    """Numerical options of a case; those that are left out are derived.

    fidelity: fineness of the FE meshes; cyclic: whether a body whose FE mesh repeats by teeth or
    pins is reduced by sectors ("auto") or never ("off").

    gear_mesh_orders: highest order of the gear-mesh frequency that results resolve; steps, samples
    and modes follow from it; by default 10, of gears that turn far above their resonance on the
    gear mesh as few as 3. time_step: time step of steady running, and of histories that a machine
    or load follows unless step_time_step is given; output_interval: time between stored samples;
    duration: of a transient, by default start-up and a turn of the slowest stage. step_tolerance:
    largest error of a tooth load in a step, as a fraction of the largest rated tooth load; 0: fixed
    time steps. With a tolerance, time steps are doubled and halved between shortest_time_step and
    longest_time_step. shortest_time_step, longest_time_step: limits of variable time steps.
    modes_to: highest frequency of the modes that are used; modes_accuracy: largest relative error
    of the contact's flexibility up to modes_band; if both are given, modes_to is an upper bound;
    with neither, rigid bodies keep all modes. modes_band: see modes_accuracy. step_time_step: time
    step near jumps of the torque, and of histories; reduction_limit: frequency up to which reduced
    bodies are compared with unreduced ones; settle: start-up time excluded from results, in place
    of the time detected from the motion; positions_per_gear_mesh: quasi-static positions per
    gear-mesh cycle. line_loads_in_time: whether transients with face_load include the load along
    the face slice by slice, as equilibria do.
    """

    fidelity: Literal["quick", "standard", "fine"] = "standard"
    cyclic: Literal["auto", "off"] = "auto"
    gear_mesh_orders: int | None = Field(default=None, ge=1, le=1000)
    time_step: Time | None = Field(default=None, ge=1e-10, le=1e-1)
    output_interval: Time | None = Field(default=None, ge=1e-10, le=1e3)
    duration: Time | None = Field(default=None, ge=1e-6, le=1e6)
    step_tolerance: float = Field(default=0.0, ge=0.0, le=0.1)
    shortest_time_step: Time | None = Field(default=None, ge=1e-10, le=1e-1)
    longest_time_step: Time | None = Field(default=None, ge=1e-10, le=1e-1)
    modes_to: Frequency | None = Field(default=None, ge=1.0, le=1e9)
    modes_accuracy: float | None = Field(default=None, ge=1e-9, le=0.5)
    modes_band: Frequency | None = Field(default=None, ge=1e-3, le=1e9)
    step_time_step: Time | None = Field(default=None, ge=1e-10, le=1e-1)
    reduction_limit: Frequency | None = Field(default=None, ge=1e-3, le=1e9)
    settle: Time | None = Field(default=None, ge=0.0, le=1e6)
    positions_per_gear_mesh: int = Field(default=16, ge=2, le=10000)
    line_loads_in_time: bool = False

    @property
    def static_orders(self) -> int:
        """Highest order of the gear-mesh frequency that equilibria resolve, at any speed."""
        return self.gear_mesh_orders or GEAR_MESH_ORDERS

    def _check(self) -> None:
        shortest, longest = self.shortest_time_step, self.longest_time_step
        if self.step_tolerance == 0.0 or shortest is None or longest is None:
            return
        if not shortest <= longest <= shortest * 2**MAX_STEP_HALVINGS:
            problem = f"{shortest:g} s cannot be refined from steps of {longest:g} s"
            remedy = f"at most longest_time_step_s, and at least 1/{2**MAX_STEP_HALVINGS} of it"
            raise Refusal("shortest_time_step", problem, remedy)
