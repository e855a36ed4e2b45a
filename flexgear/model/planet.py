"""Planet as a body: a rim with its teeth, carried at its bore, and how its teeth are tied."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from flexgear.model.fe_mesh_source import FeMeshSource


class Planet(FeMeshSource):
    """Planets as bodies: one is meshed and reduced, and all of them are like it.

    flexible: false makes them rigid with the same mass. tie: whether tooth nodes act on the root or
    the flank of their teeth. tie_kind: averaging (RBE3) or rigid (RBE2) tie of a node to its
    surface. fixed_interface_modes: number kept in the reduction.
    """

    flexible: bool = True
    tie: Literal["root", "flank"] = "root"
    tie_kind: Literal["averaging", "rigid"] = "averaging"
    fixed_interface_modes: int = Field(default=20, ge=0, le=2000)
