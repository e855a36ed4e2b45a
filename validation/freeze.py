"""Figures of all bundled cases, recorded before a change that moves none and compared after it.

    python validation/freeze.py record FOLDER [CASE ...]
    python validation/freeze.py compare FOLDER [CASE ...]

``record`` writes, for every bundled case at quick fidelity, what ``flexgear check`` prints,
equilibria over one turn, natural modes, the first 50 ms of a transient and the statistics of a
longer one as netCDF, and the processor time of each step: about a minute for all, more where bodies
are not yet in the cache. FOLDER is outside of the repository: recorded figures are no reference,
they show that a change moved nothing, and not that anything is right.

``compare`` computes the same again and prints the largest difference of each kind, over the largest
size of its variable, and all that is above its limit; it exits with 1 where something is. Modes of
equal frequency may turn into each other, so their frequencies are compared one by one, and their
shapes and energies as sums over all of one frequency, which turning does not change. Compiled loops
sum in no fixed order: samples of transients have wider limits than equilibria, statistics the
widest.
``RENAMED`` lists variables that a change has renamed.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import flexgear as fg
from flexgear.cli.case_commands import derived
from flexgear.model.load import bundled_cases
from flexgear.solve.model import assemble
from flexgear.solve.modes import modes
from flexgear.solve.static import static
from flexgear.solve.transient import simulate

POSITIONS = 12  # of the input, over one turn
SECONDS, LONGER = 0.05, 0.3  # durations of the two transients, s
SAME_FREQUENCY = 1e-6  # relative distance of neighbours in a group of modes
LIMITS = {"check": 1e-12, "static": 1e-8, "modes": 1e-8, "start": 1e-6, "statistics": 1e-4}
RENAMED: dict[str, str] = {}  # recorded name -> name of today


def datasets(name: str, lap: Callable[[str], None]) -> Iterator[tuple[str, xr.Dataset]]:
    """Every recorded dataset of a bundled case with its kind; ``lap(step)`` ends each step."""
    case = fg.load_case(name, {"solver.fidelity": "quick"})
    yield "check", scalars(derived(case))
    model = assemble(case)
    lap("assemble")
    if case.output is not None:
        yield "static", static(model, np.linspace(0.0, 2 * np.pi, POSITIONS, endpoint=False))
        lap("static")
    yield "modes", grouped_modes(modes(model))
    lap("modes")
    if case.output is not None and any(model.system.input_speeds):
        yield "start", simulate(model, duration=SECONDS).data
        lap("start")
        yield "statistics", statistics(simulate(model, duration=LONGER).data)
        lap("statistics")


def scalars(sections: Mapping[str, Any], prefix: str = "") -> xr.Dataset:
    """Numbers of nested tables as variables, "sun teeth"; lists of numbers have a dimension."""
    out = xr.Dataset()
    for key, value in sections.items():
        name = f"{prefix} {key}".strip().replace("/", " per ")
        if isinstance(value, Mapping):
            out = out.merge(scalars(value, name))
        elif np.asarray(value).dtype.kind in "bif":
            values = np.asarray(value, dtype=float)
            out[name] = ([f"{name} {axis}" for axis in range(values.ndim)], values)
    return out


def grouped_modes(modes: xr.Dataset) -> xr.Dataset:
    """Frequencies, and sums over modes of equal frequency: φφᵀ (dofs of bodies), energies."""
    frequencies = modes["frequency"].to_numpy()
    starts = np.flatnonzero(np.diff(frequencies, prepend=-1.0) > SAME_FREQUENCY * frequencies)
    shapes = modes["mode_shape"].to_numpy().reshape(len(frequencies), -1)
    products = np.einsum("mi,mj->mij", shapes, shapes)
    sums: dict[str, NDArray[np.float64]] = {
        name: modes[name].to_numpy()
        for name in ("kinetic_energy", "motion_energy", "strain_energy")
    }
    sums["shape_products"] = products.reshape(len(frequencies), -1)
    return xr.Dataset(
        {"frequency": ("mode", frequencies)}
        | {
            name: (("group", f"of {name}"), np.add.reduceat(values, starts, axis=0))
            for name, values in sums.items()
        }
    )


def statistics(data: xr.Dataset) -> xr.Dataset:
    """Smallest, mean, largest value and standard deviation over the second half of the samples."""
    half = data.isel(time=slice(data.sizes["time"] // 2, None))
    numbers = [n for n, v in half.data_vars.items() if "time" in v.dims and v.dtype.kind in "if"]
    parts = {
        kind: getattr(half[numbers], kind)("time").rename({n: f"{n}_{kind}" for n in numbers})
        for kind in ("min", "mean", "max", "std")
    }
    return xr.merge(parts.values(), combine_attrs="drop")


def record(folder: Path, names: list[str]) -> int:
    """Writes the datasets and processor times of the cases; 0."""
    for name in names:
        seconds: dict[str, float] = {}
        (folder / name).mkdir(parents=True, exist_ok=True)
        for kind, data in datasets(name, stopwatch(seconds)):
            data.drop_attrs().to_netcdf(folder / name / f"{kind}.nc", engine="h5netcdf")
        (folder / name / "seconds.json").write_text(json.dumps(seconds, indent=1))
        print(name, {step: round(s, 2) for step, s in seconds.items()}, flush=True)
    return 0


def compare(folder: Path, names: list[str]) -> int:
    """Prints differences; 1 where one is above its limit or a recorded variable is missing."""
    status = 0
    for name in names:
        seconds: dict[str, float] = {}
        for kind, data in datasets(name, stopwatch(seconds)):
            stored = xr.load_dataset(folder / name / f"{kind}.nc", engine="h5netcdf")
            of_each = {str(n): RENAMED.get(str(n), str(n)) for n in stored.data_vars}
            missing = [n for n in of_each.values() if n not in data]
            away = {
                n: difference(
                    stored[n].to_numpy(),
                    data[today].to_numpy(),
                    each=n == "frequency",
                    least=level_of(stored, n),
                )
                for n, today in of_each.items()
                if today in data
            }
            largest = max(away, key=lambda n: away[n])
            print(f"{name:18} {kind:11} {len(away):3} variables,", end=" ")
            print(f"largest difference {away[largest]:.1e} ({largest})", flush=True)
            above = sorted((n for n in away if not away[n] <= LIMITS[kind]), key=lambda n: -away[n])
            for n in above:
                print(f"    above {LIMITS[kind]:.0e}: {n} {away[n]:.3e}")
            if missing:
                print(f"    missing: {', '.join(missing)}")
            status |= bool(above or missing)
        before = json.loads((folder / name / "seconds.json").read_text())
        pace = ", ".join(f"{k} {before.get(k, 0):.2f} -> {s:.2f}" for k, s in seconds.items())
        print(f"{name:18} seconds     {pace}", flush=True)
    return status


def level_of(stored: xr.Dataset, name: str) -> float:
    """What a figure is small against: a standard deviation, the largest mean of its variable; an
    inertia torque, which constant speed leaves to rounding, the largest torque at the ports."""
    against = name.replace("inertia_torque", "port_torque")
    if against.endswith("_std"):
        against = f"{against.removesuffix('_std')}_mean"
    if against == name or against not in stored:
        return 0.0
    return float(np.nan_to_num(np.abs(stored[against].to_numpy())).max(initial=0.0))


def difference(
    stored: NDArray[Any], computed: NDArray[Any], *, each: bool = False, least: float = 0.0
) -> float:
    """Largest |a - b| over the largest |a|, or over its own |a| if ``each``; over ``least`` where
    that is more. Infinite where shapes, texts or missing values differ."""
    if stored.shape != computed.shape:
        return np.inf
    if stored.dtype.kind not in "bif":
        return 0.0 if (stored.astype(str) == computed.astype(str)).all() else np.inf
    a, b = stored.astype(float), computed.astype(float)
    if (np.isnan(a) != np.isnan(b)).any():
        return np.inf
    distance, size = np.nan_to_num(np.abs(a - b)), np.nan_to_num(np.abs(a))
    if not each:
        size = np.broadcast_to(size.max(initial=0.0), size.shape)
    size = np.maximum(size, least)
    return float((distance / np.where(size > 0, size, 1.0)).max(initial=0.0))


def stopwatch(seconds: dict[str, float]) -> Callable[[str], None]:
    """A function that enters the processor time since its last call under the name it is given."""
    last = time.process_time()

    def lap(step: str) -> None:
        nonlocal last
        now = time.process_time()
        seconds[step], last = now - last, now

    return lap


def main() -> int:
    """Records or compares; see the module."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("task", choices=["record", "compare"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("cases", nargs="*", metavar="CASE")
    chosen = parser.parse_args()
    task = record if chosen.task == "record" else compare
    return task(chosen.folder, chosen.cases or sorted(bundled_cases()))


if __name__ == "__main__":
    sys.exit(main())
