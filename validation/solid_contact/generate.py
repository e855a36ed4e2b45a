"""Make reference.json again: `cd validation && python -m solid_contact.generate [RUN…]`.

Takes a quarter of an hour on a free core; needs CalculiX (Debian: apt-get install calculix-ccx).
Each run is written when it is done; names of runs make only these again.
"""

import fcntl
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict
from datetime import date
from pathlib import Path
from typing import Any

from plane_contact.cases import material, pair, stage
from plane_contact.generate import rounded, text_of
from plane_contact.rolling import Pair

from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from solid_contact.cases import RUNS, Run
from solid_contact.deck import both_bodies, reaction, run, slice_forces, write_deck
from solid_contact.stored import FILE

UNITS = {
    "approach": "m, of the planet's body along the line of action at mid-face",
    "tilt": "rad, of the same over z",
    "forces": "N, on equal slices of the face from -z to +z",
    "reaction": "N, of the planet's body along the line of action",
    "penalty": "pressure per overlap over Young's modulus, 1/m",
}


def of_run(one: Run, solve: Callable[[Run, Pair, FeMesh], str]) -> dict[str, Any]:
    """Everything of one run; solve: what CalculiX prints."""
    gears = pair("ring")
    fe_mesh = both_bodies(gears, stage().stage.normal_module, one.solid)
    printed = solve(one, gears, fe_mesh)
    return {
        "solid": asdict(one.solid),
        "nodes": len(fe_mesh.points),
        "approach": one.motion.approach,
        "tilt": one.motion.tilt,
        "forces": rounded(slice_forces(printed, fe_mesh, one.solid)),
        "reaction": rounded(reaction(printed, gears)),
    }


def by_calculix(one: Run, gears: Pair, fe_mesh: FeMesh) -> str:
    """One run of the program."""
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "pair.inp"
        write_deck(deck, fe_mesh, gears, one.solid, material(), one.motion)
        return run(program(), deck)


def program() -> str:
    """Path of ccx; SystemExit where it is not installed."""
    path = shutil.which("ccx")
    if path is None:
        raise SystemExit("ccx is not installed (Debian: apt-get install calculix-ccx)")
    return path


def header() -> dict[str, Any]:
    """What stands above the runs."""
    version = subprocess.run([program(), "-v"], capture_output=True, text=True, check=False).stdout
    return {
        "what": "a spur planet's tooth pressed on a ring's in three dimensions, both segments held",
        "made_by": "validation/solid_contact/generate.py",
        "program": f"CalculiX, {version.strip().removeprefix('This is ')}",
        "units": UNITS,
        "material": asdict(material()),
    }


def main(names: Sequence[str]) -> None:
    """Make these runs, all without names, and write each into the file."""
    for name in names or list(RUNS):
        result = of_run(RUNS[name], by_calculix) | {"date": date.today().isoformat()}
        with FILE.open("r+", encoding="utf-8") as file:
            fcntl.flock(file, fcntl.LOCK_EX)  # another process may make other runs
            runs = json.loads(file.read())["runs"] | {name: result}
            text = text_of(header() | {"runs": {n: runs[n] for n in RUNS if n in runs}})
            file.seek(0)
            file.write(text)
            file.truncate()
        print(f"{name}: made", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
