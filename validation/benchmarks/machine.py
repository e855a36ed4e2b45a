"""Where a run took place: processor, cores, memory, versions, load; no names of hosts or paths."""

import datetime
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from flexgear.structures.linalg.dense import THREADS

PACKAGES = ("numpy", "scipy", "scikit-fem", "numba", "gmsh", "cvxopt", "exudyn")


def machine() -> dict[str, str]:
    """Named facts for the page."""
    facts = {
        "date": datetime.date.today().isoformat(),
        "processor": f"{_processor()}, {THREADS} cores",
        "memory": f"{_memory_gib():.0f} GiB",
        "load before the run": f"{os.getloadavg()[0]:.1f} processes (mean of a minute)",
        "system": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
    }
    for name in PACKAGES:
        try:
            facts[name] = version(name)
        except PackageNotFoundError:
            facts[name] = "not installed"
    return facts


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    pairs = [line.partition(":") for line in lines if ":" in line]
    facts = {name.strip(): value.strip() for name, _, value in pairs}
    name = facts.get("model name", platform.machine())
    return f"{name} (family {facts.get('cpu family')}, model {facts.get('model')})"


def _memory_gib() -> float:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    except (ValueError, OSError):
        return float("nan")
