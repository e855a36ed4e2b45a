"""Methods of result datasets (``data.fg.plot.ring_star()``), and comparison of several results."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from flexgear.gears.power_flow import power_flow
from flexgear.model.arguments import Positive, checked
from flexgear.model.errors import FlexgearError, InputError
from flexgear.results.dataset_file import reopened
from flexgear.results.report.wording import scale
from flexgear.results.run_folder import Run
from flexgear.results.sinks import TIME, ranges_of

if TYPE_CHECKING:
    from flexgear.views.chart import Chart
    from flexgear.views.style import Figure


@xr.register_dataset_accessor("fg")
class Accessor:
    """Methods of every dataset of flexgear, as ``data.fg``."""

    def __init__(self, data: xr.Dataset) -> None:
        self._data = data

    def __repr__(self) -> str:
        methods = (name for name in dir(self) if not name.startswith("_"))
        return f"<methods of a flexgear dataset: {', '.join(methods)}>"

    @cached_property
    def plot(self) -> Plots:
        """Pictures; their names are those of the files that ``flexgear run`` writes."""
        return Plots(self._data)

    @checked
    def orders(
        self,
        name: str,
        member: str = "",
        *,
        against: str = "",
        highest: Positive | None = None,
        window: str = "hann",
        band_hz: tuple[float, float] | None = None,
    ) -> xr.DataArray:
        """Amplitudes (order, …) of a variable, by multiples of the rotation frequency of a member.

        member: "<stage>.<part>", planets too; the first input if left out; against: member relative
        to which it turns, space if left out; highest: highest order, all that the sampling allows
        if left out; window: name in scipy.signal.windows; band_hz: band (low, high) Hz, of whose
        envelope the spectrum is taken.
        """
        from flexgear.results.orders import order_spectrum

        history = self._over_turns(name, member, against, highest, band_hz)
        return order_spectrum(history, window)

    def _over_turns(
        self,
        name: str,
        member: str,
        against: str,
        highest: float | None,
        band_hz: tuple[float, float] | None = None,
    ) -> xr.DataArray:
        """A variable over the angle of a member; FlexgearWarning where it may contain aliases."""
        from flexgear.results.run_orders import history_over_turns, warn_of_aliases

        data = self._data
        history = history_over_turns(data, name, member, against, highest=highest, band_hz=band_hz)
        warn_of_aliases(data, data[name])
        return history

    @checked
    def order_map(
        self,
        name: str,
        member: str = "",
        *,
        against: str = "",
        highest: Positive | None = None,
        block_turns: Positive | None = None,
        window: str = "hann",
        band_hz: tuple[float, float] | None = None,
    ) -> xr.DataArray:
        """Order spectra (block, order, …) of consecutive blocks of turns with their ``speed`` and
        ``time``: a run-up map. block_turns: turns of a block; other arguments as in ``orders``."""
        from flexgear.results.orders import order_map

        history = self._over_turns(name, member, against, highest, band_hz)
        return order_map(history, block_turns, window)

    @checked
    def synchronous_average(
        self, name: str, member: str = "", *, against: str = "", highest: Positive | None = None
    ) -> xr.DataArray:
        """Mean (phase, …) of a variable over the whole turns of a member."""
        from flexgear.results.run_orders import synchronous_average

        return synchronous_average(self._over_turns(name, member, against, highest))

    @checked
    def planet_averages(
        self,
        name: str,
        stage: str,
        *,
        sensor_angle_deg: float = 0.0,
        width: Positive | None = None,
        on_ring: bool = False,
    ) -> xr.DataArray:
        """Means (planet, phase, …) of a variable over the turns of each planet of a stage, from one
        sensor that the planets pass; width: carrier turns round each pass that are evaluated."""
        from flexgear.results.run_orders import planet_averages

        angle = math.radians(sensor_angle_deg)
        return planet_averages(
            self._data, name, stage, sensor_angle=angle, width=width, on_ring=on_ring
        )


class Plots:
    """Pictures of a dataset by name, each a function that returns the matplotlib figure."""

    def __init__(self, data: xr.Dataset) -> None:
        if "parameters" not in data.attrs:
            raise FlexgearError(
                "cannot draw: the dataset is not one of flexgear, or has lost its attributes"
            )
        self._data = data

    @cached_property
    def _plan(self) -> Mapping[str, Callable[[], Figure]]:
        """Pictures by name that need no other dataset: measures of a sweep over its keys,
        distributions of random samples, pictures of a run."""
        from flexgear.results.run_orders import case_of
        from flexgear.results.tolerance_dataset import SPREADS
        from flexgear.views.chart import planned
        from flexgear.views.run_charts import RUN_CHARTS
        from flexgear.views.study_charts import tolerance_chart
        from flexgear.views.sweep_charts import drawn_variables, sweep_chart

        if swept := drawn_variables(self._data):
            return {name: partial(sweep_chart, self._data, name) for name in swept}
        if "load_sharing_max" in self._data:
            drawn = [name for name, spread in SPREADS.items() if spread.variable in self._data]
            return {name: partial(tolerance_chart, self._data, name) for name in drawn}
        case = case_of(self._data)
        summary = {"variant": self._data.attrs["variant"]}
        run = Run(case, power_flow(case), _by_file(self._data), {}, summary)
        plan: dict[str, Chart] = {}
        for subjects, charts in RUN_CHARTS:
            for chart in charts:
                try:
                    plan |= {} if chart.slow else planned(run, [(subjects, [chart])])
                except KeyError:  # the picture needs another dataset or the summary
                    continue
        return {name: picture.draw for name, picture in plan.items()}

    def __getattr__(self, name: str) -> Callable[[], Figure]:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in self._plan:
            raise AttributeError(f"no picture {name!r} of this dataset: {self!r}")
        return self._plan[name]

    def __getstate__(self) -> dict[str, Any]:
        """The dataset alone: other processes list the pictures anew."""
        return {"_data": self._data}

    def __dir__(self) -> list[str]:
        return sorted(self._plan)

    def __repr__(self) -> str:
        return f"<pictures: {', '.join(self._plan)}>"


def _by_file(data: xr.Dataset) -> dict[str, xr.Dataset]:
    """The dataset under the file name that it has in the folder of a run."""
    if "time" in data.dims:
        return {"transient": data}
    if "response_branch" in data:
        return {"response": data}
    if "stage" in data.attrs:
        kind = "sharing" if "cycle_maximum" in data else "gear_mesh_cycles"
        return {f"{kind}_{data.attrs['stage']}": data}
    if "position" in data.dims:
        return {"equilibrium": data, "equilibrium_without_errors": data}
    parts = {
        "modes": "frequency",
        "campbell": "campbell_frequency",
        "stability": "growth_rate",
        "linear_response": "linear_force_amplitude",
    }
    return {name: data for name, variable in parts.items() if variable in data}


@dataclass(frozen=True, repr=False)
class Comparison:
    """Transients or equilibria of several models by label."""

    runs: Mapping[str, xr.Dataset]

    @property
    def figures(self) -> xr.Dataset:
        """Maximum over all samples of each run: ``gear_mesh_force`` (run, gear_mesh), N, and
        ``planet_load_factor`` (run, gear_mesh)."""
        names = ["gear_mesh_force", "planet_load_factor"]
        largest = [
            ranges_of(data[names], lambda piece: piece).largest if TIME in data.dims
            else data[names].max("position")
            for data in self.runs.values()
        ]  # fmt: skip
        runs = xr.IndexVariable("run", list(self.runs))
        return xr.concat(largest, runs, combine_attrs="drop_conflicts")

    def plot(self) -> Figure:
        """Force of the most loaded planet and load sharing of every gear mesh, over time or turns
        of the reference member."""
        from flexgear.views.sharing_charts import comparison_chart

        return comparison_chart(self.runs)

    def __repr__(self) -> str:
        return str(self._table().to_string(index=False, float_format="{:.4g}".format))

    def _repr_html_(self) -> str:
        return str(self._table().to_html(index=False, float_format="{:.4g}".format))

    def _table(self) -> Any:
        """Largest force and load factor of every run, as a data frame of pandas."""
        largest = self.figures.max("gear_mesh")
        unit, by = scale(largest["gear_mesh_force"].to_numpy(), "N")
        columns = {
            f"largest gear-mesh force ({unit})": by * largest["gear_mesh_force"],
            "largest load factor": largest["planet_load_factor"],
        }
        return xr.Dataset(columns).to_dataframe().dropna(axis="columns").reset_index()


def open_dataset(path: str | Path) -> xr.Dataset:
    """A dataset from a netCDF file, with the methods of ``data.fg``.

    Small files are read into memory, large ones where used. InputError for other files."""
    return reopened(path)


def compare(**runs: xr.Dataset) -> Comparison:
    """Comparison of transients or equilibria: ``compare(flexible=run, rigid=other).plot()``."""
    if len(runs) < 2:
        raise InputError(
            "flexgear.compare()", "runs", "are fewer than two", "give two results or more by name"
        )
    for name, data in runs.items():
        if "gear_mesh_force" not in data:
            remedy = "give transients, or equilibria"
            raise InputError("flexgear.compare()", name, "has no gear_mesh_force", remedy)
    return Comparison(runs)
