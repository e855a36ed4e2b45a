"""Load along the face of the bundled cases: K_Hβ flexible and rigid, and what ground flanks gain.

No printed figures: both cases with `stage.gear_mesh.model = "face_load"`, side by side.
"""
