"""Which gear mesh of a stage, on which of its flanks."""

from __future__ import annotations

from enum import StrEnum


class GearMeshKind(StrEnum):
    """Gear mesh of planets with the ring or the sun, on their drive or coast flanks.

    A parallel stage has those of the sun, its pinion, only.
    """

    RING = "ring"
    SUN = "sun"
    RING_COAST = "ring_coast"
    SUN_COAST = "sun_coast"

    @classmethod
    def both(cls, gear: str) -> tuple[GearMeshKind, GearMeshKind]:
        """On drive and on coast flanks of "ring" or "sun"."""
        drive, coast = (kind for kind in cls if kind.gear == gear)
        return drive, coast

    @property
    def internal(self) -> bool:
        """Whether the planets run inside the gear."""
        return self in (GearMeshKind.RING, GearMeshKind.RING_COAST)

    @property
    def gear(self) -> str:
        """Name of the gear: "ring" or "sun"."""
        return "ring" if self.internal else "sun"

    @property
    def coast(self) -> bool:
        """Whether it is on the coast flanks."""
        return self in (GearMeshKind.RING_COAST, GearMeshKind.SUN_COAST)
