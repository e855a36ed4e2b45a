"""Line load along the face by CalculiX and by flexgear."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure
from rows import Drawn, Picture

from solid_contact import stored
from solid_contact.statements import NAMES, RUNS, compared

STYLES = {"fe": "o", "width": "x"}


def drawn(fidelity: str) -> Iterator[Drawn]:
    """All runs in one picture."""
    figure = Figure(figsize=(7, 4.2), layout="constrained")
    axes = figure.subplots()
    shown = ("width",) if fidelity == "quick" else ("fe", "width")
    for k, run in enumerate(RUNS):
        by_ccx = stored.run(run)
        z, per_mm = 1e3 * _middles(by_ccx), 1e-6 * len(by_ccx.forces) / by_ccx.face_width
        axes.plot(z, per_mm * by_ccx.forces, f"C{k}-", label=f"CalculiX, {run}")
        for compliance in shown:
            forces = per_mm * compared(run, compliance).forces
            label = f"flexgear, {NAMES[compliance]}" if k == 0 else None
            axes.plot(z, forces, f"C{k}{STYLES[compliance]}", label=label)
    axes.set(xlabel="z along the face (mm)", ylabel="line load (kN/mm)", ylim=(0, None))
    axes.legend(fontsize=8)
    note = "planet and ring of wind-5mw with straight teeth, one pair, same force and tilt"
    yield figure, Picture("line_load.png", "Line load along the face", note)


def _middles(by_ccx: stored.Stored) -> stored.Array:
    count = len(by_ccx.forces)
    return (np.arange(count) + 0.5) / count * by_ccx.face_width - by_ccx.face_width / 2
