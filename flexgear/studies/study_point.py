"""A case at one point of a parameter study, with the results that measures share."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import xarray as xr

from flexgear.gears.error_cycle import TrainTurn, error_cycle
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError
from flexgear.results.settling import WindowedRanges, window_edges
from flexgear.results.sinks import MemorySink, Ranges, SinkGroup, recorded
from flexgear.results.summary import sharing_summary_of
from flexgear.solve.angles import samples_of_stage, stage_motions
from flexgear.solve.bodies import reduced_bodies
from flexgear.solve.model import Model, assemble
from flexgear.solve.result_warnings import (
    beyond_all_planets,
    large_motions,
    largest_motions,
    motion_histories,
    pulling_teeth,
)
from flexgear.solve.static import shared_stages, stages_sharing, static
from flexgear.solve.transient import fault_warnings, simulate, train_histories, usual_duration

CYCLES = 120  # gear-mesh cycles of each stage with equilibria for displacements


@dataclass(frozen=True)
class Point:
    """A point of a study: its case, the reference case, and results that several measures share,
    each computed once when first needed. modes: number of natural modes to list."""

    case: Case
    reference: Case
    modes: int

    @cached_property
    def flow(self) -> PowerFlow:
        """Speeds, torques and powers."""
        return power_flow(self.case)

    @cached_property
    def model(self) -> Model:
        """The assembled case."""
        return assemble(self.case, bodies=reduced_bodies(self.case))

    @cached_property
    def sharing(self) -> list[xr.Dataset]:
        """Quasi-static load sharing of every stage with planets, over its error cycle."""
        stages = shared_stages(self.model)
        if not stages:
            raise FlexgearError("no stage that turns has planets that share a load")
        return [stages_sharing(self.model, stage) for stage in stages]

    @cached_property
    def equilibria(self) -> xr.Dataset:
        """Equilibria in gear-mesh cycles of every stage.

        They are spread over the cycle of all possible errors, so that the positions do not depend
        on which errors a study sets to zero.
        """
        case = self.case
        motions = tuple(
            replace(m, turn=TrainTurn(error_cycle(stage), m.turn.rate))
            for m, stage in zip(stage_motions(case, self.flow), case.stages, strict=True)
        )
        lead = [
            samples_of_stage(case, motions, k, CYCLES, linear=False).angles
            for k, motion in enumerate(motions)
            if motion.theta != 0
        ]
        return static(self.model, np.concatenate(lead))

    @cached_property
    def transient(self) -> tuple[xr.Dataset, WindowedRanges]:
        """Transient at rated torque, without its samples, and the ranges of the samples."""
        span = usual_duration(self.case, self.model.flow)
        ranges = WindowedRanges(train_histories, window_edges(span, self.case.solver.settle))
        sink = SinkGroup([ranges, self.recorded])
        return simulate(self.model, sink=sink).data, ranges

    @property
    def settled(self) -> Ranges:
        """Ranges of the transient's samples after settling."""
        data, ranges = self.transient
        return ranges.since(float(data.attrs["settle_s"]))

    @cached_property
    def recorded(self) -> MemorySink:
        """Sink that stores the signals of sensors in the transient."""
        return MemorySink(recorded)

    @property
    def signals(self) -> xr.Dataset:
        """The signals of sensors in the transient."""
        attrs = self.transient[0].attrs
        return self.recorded.data.assign_attrs(attrs)

    @property
    def warnings(self) -> list[str]:
        """Warnings of large motions: in the equilibria and the transient of the measures, or in the
        equilibrium at zero rotation; of faulty teeth that a transient misrepresents; of teeth that
        pull; none for a train without load or one not assembled."""
        solved = self.__dict__
        if "model" not in solved or self.case.output is None:
            return []
        equilibria = solved["equilibria"] if "equilibria" in solved else static(self.model)
        motions = largest_motions(motion_histories(equilibria))
        if "transient" in solved:
            in_time = largest_motions(solved["transient"][1].since(0.0).largest)
            motions |= {name: max(size, motions[name]) for name, size in in_time.items()}
        lost = fault_warnings(self.model) if "transient" in solved else []
        shared = [*solved.get("sharing", []), *solved.get("transient", ())[:1]]
        factors = {
            group: factors["instantaneous"] or 0.0
            for data in shared
            for group, factors in sharing_summary_of(data).items()
        }
        pulled = pulling_teeth(self.case, beyond_all_planets(self.case, factors))
        return [*lost, *pulled, *large_motions(self.case, motions)]
