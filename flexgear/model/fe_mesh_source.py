"""Where the FE mesh of a body comes from: generated, or a file and how it is put in place."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, model_validator

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Angle, Length


def _about_z(value: Any) -> Any:
    """One number is along or about the axis of rotation."""
    return (0.0, 0.0, value) if isinstance(value, (int, float)) else value


class FeMeshSource(Section):
    """A body's FE mesh. A file's vertices X are placed at x = R X + fe_mesh_shift, in the frame of
    docs/conventions.md; R turns by fe_mesh_turn about the fixed x, then y, then z axis. Of both,
    one number stands for (0, 0, number)."""

    fe_mesh: Literal["generate", "file"] = "generate"
    fe_mesh_file: str | None = None
    fe_mesh_unit: Literal["m", "mm"] = "mm"
    fe_mesh_shift: Annotated[tuple[Length, ...], BeforeValidator(_about_z)] = (0.0, 0.0, 0.0)
    fe_mesh_turn: Annotated[tuple[Angle, ...], BeforeValidator(_about_z)] = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _complete(self) -> FeMeshSource:
        if self.fe_mesh == "file" and not self.fe_mesh_file:
            raise Missing(
                "fe_mesh_file", "is missing", "name the mesh file, or fe_mesh = 'generate'"
            )
        for key in ("fe_mesh_shift", "fe_mesh_turn"):
            given = len(getattr(self, key))
            if given != 3:
                raise Refusal(
                    key, f"has {given} numbers", "give three, for x, y and z, or one, for z"
                )
        return self
