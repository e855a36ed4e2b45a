"""Pictures of a dataset: ``data.fg.plot.ring_star()`` draws what ``flexgear run`` draws of it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import xarray as xr

from flexgear.gears.power_flow import power_flow
from flexgear.model.case import case_of_dict
from flexgear.model.errors import FlexgearError
from flexgear.results.run_folder import Folder, tuples_of

if TYPE_CHECKING:
    from flexgear.views.chart import Planned
    from flexgear.views.style import Figure


@xr.register_dataset_accessor("fg")
class Accessor:
    """What every dataset of flexgear has below ``.fg``."""

    def __init__(self, data: xr.Dataset) -> None:
        self._data = data

    @cached_property
    def plot(self) -> Plots:
        """Pictures; their names are those of the files that ``flexgear run`` writes."""
        return Plots(self._data)


class Plots:
    """Pictures of a dataset by name, each a function that returns the matplotlib figure."""

    def __init__(self, data: xr.Dataset) -> None:
        if "parameters" not in data.attrs:
            raise FlexgearError("cannot draw: the dataset is none of flexgear, or lost its attrs")
        self._data = data

    @cached_property
    def _plan(self) -> Mapping[str, Planned]:
        """All that can be drawn of the dataset alone."""
        from flexgear.views.chart import planned
        from flexgear.views.run_charts import RUN_CHARTS

        case = case_of_dict(tuples_of(json.loads(self._data.attrs["parameters"])))
        summary = {"variant": self._data.attrs["variant"]}
        run = Folder(case, power_flow(case), _by_file(self._data), {}, summary)
        plan: dict[str, Planned] = {}
        for subjects, charts in RUN_CHARTS:
            for chart in charts:
                try:
                    plan |= {} if chart.slow else planned(run, [(subjects, [chart])])
                except KeyError:  # a picture of another dataset or of the summary
                    continue
        return plan

    def __getattr__(self, name: str) -> Callable[[], Figure]:
        if name.startswith("_") or name not in self._plan:
            raise AttributeError(f"no picture {name!r} of this dataset: {self!r}")
        return self._plan[name].draw

    def __dir__(self) -> list[str]:
        return sorted(self._plan)

    def __repr__(self) -> str:
        return f"<pictures: {', '.join(self._plan)}>"


def _by_file(data: xr.Dataset) -> dict[str, xr.Dataset]:
    """The dataset by the name of the file in which a run keeps such results."""
    if "time" in data.dims:
        return {"transient": data}
    if "stage" in data.attrs:
        kind = "sharing" if "cycle_maximum" in data else "gear_mesh_cycles"
        return {f"{kind}_{data.attrs['stage']}": data}
    if "position" in data.dims:
        return {"equilibrium": data, "equilibrium_without_errors": data}
    parts = {"modes": "frequency", "campbell": "campbell_frequency"}
    return {name: data for name, variable in parts.items() if variable in data}
