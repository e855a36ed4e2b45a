"""Results side by side: a row each, and one picture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

import xarray as xr

from flexgear.model.errors import InputError

if TYPE_CHECKING:
    from flexgear.views.style import Figure


@dataclass(frozen=True, repr=False)
class Comparison:
    """Transients, or equilibria, by label."""

    runs: Mapping[str, xr.Dataset]

    @property
    def figures(self) -> xr.Dataset:
        """Maximum over all samples of each run: ``gear_mesh_force`` (run, gear_mesh), N, and
        ``planet_load_factor`` (run, gear_mesh)."""
        names = ["gear_mesh_force", "planet_load_factor"]
        largest = [
            data[names].max("time" if "time" in data.dims else "position")
            for data in self.runs.values()
        ]
        return xr.concat(largest, xr.IndexVariable("run", list(self.runs)))

    def plot(self) -> Figure:
        """Force of the most loaded planet and load sharing of every gear mesh, over time or turns
        of the reference member."""
        from flexgear.views.comparison_chart import comparison_chart

        return comparison_chart(self.runs)

    def __repr__(self) -> str:
        return "\n".join("  ".join(row) for row in self._rows())

    def _repr_html_(self) -> str:
        head, *rows = self._rows()
        lines = (
            f"<tr>{''.join(f'<td>{escape(x.strip())}</td>' for x in row)}</tr>" for row in rows
        )
        titles = "".join(f"<th>{escape(x.strip())}</th>" for x in head)
        return f"<table><tr>{titles}</tr>{''.join(lines)}</table>"

    def _rows(self) -> list[list[str]]:
        """Text of a table: largest force and load factor of every run."""
        largest, width = self.figures.max("gear_mesh"), max(len(label) for label in self.runs)
        rows = [["run".ljust(width), "largest gear-mesh force (kN)", "largest load factor"]]
        for label in self.runs:
            of_run = largest.sel(run=label)
            force, factor = 1e-3 * of_run["gear_mesh_force"], of_run["planet_load_factor"]
            rows.append([label.ljust(width), f"{force:28.4g}", f"{factor:19.4g}"])
        return rows


def compare(**runs: xr.Dataset) -> Comparison:
    """Transients, or equilibria, side by side: ``compare(flexible=run, rigid=other).plot()``."""
    if len(runs) < 2:
        raise InputError(
            "flexgear.compare()", "runs", "are fewer than two", "give two results or more by name"
        )
    return Comparison(runs)
