"""Makes the small FE meshes of this folder: python meshes/make.py"""

from math import radians
from pathlib import Path

from flexgear.structures.fe_mesh.carrier import CarrierFeMeshParameters
from flexgear.structures.fe_mesh.carrier_mesh import carrier_fe_mesh
from flexgear.structures.fe_mesh.files import write_fe_mesh
from flexgear.structures.fe_mesh.gears import RingFeMeshParameters, ring_fe_mesh

HERE = Path(__file__).parent

RING_36 = RingFeMeshParameters(
    teeth=36,
    normal_module=0.01,
    pressure_angle=radians(20.0),
    helix_angle=radians(8.0),
    face_width=0.1,
    rim_thickness=0.06,
    bolts=5,
    bolt_circle_diameter=0.45,
    bolt_diameter=0.012,
    fits=((-0.05, -0.03), (0.03, 0.05)),
    fidelity="quick",
)
CARRIER_5 = CarrierFeMeshParameters(
    planets=5,
    center_distance=0.54466,
    planet_tip_radius=0.318,
    gear_face_width=0.43,
    plate_diameter=1.6,
    plate_thickness_drive=0.16,
    plate_thickness_far=0.14,
    plate_gap=0.48,
    web_width=0.4,
    web_clearance=0.01,
    pin_diameter=0.32,
    hub_outer_diameter=0.9,
    hub_bore=0.4,
    hub_length=0.25,
    seat_drive_diameter=1.0,
    seat_drive_width=0.12,
    seat_far_diameter=0.7,
    seat_far_width=0.1,
    fidelity="quick",
)

if __name__ == "__main__":
    write_fe_mesh(ring_fe_mesh(RING_36), HERE / "ring36_quick.vtu")
    write_fe_mesh(carrier_fe_mesh(CARRIER_5), HERE / "carrier5_quick.vtu")
