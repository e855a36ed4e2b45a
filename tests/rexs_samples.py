"""Small gearboxes in REXS, written here by hand after the public schemas, for import tests.

A model is plain data, so that a test changes a value, a unit or a type and writes it as XML, JSON
or zip: {"version", "components": {id: (type, name, {attribute: (value, unit)})},
"relations": [(type, {role: id})], "load_cases": {id: {component: {attribute: (value, unit)}}}}.
"""

import copy
import io
import json
import math
import zipfile
from xml.sax.saxutils import quoteattr

from flexgear.files.rexs.from_case import model_of_case
from flexgear.files.rexs.reading import read_rexs
from flexgear.files.rexs.to_case import case_of_document
from flexgear.model.load import load_case

MM, DEG, RPM, NM = "mm", "deg", "1 / min", "N m"
ARM = 90.0  # mm, of the planetary stage: (20 + 25) teeth of module 4
HELIX = 10.0


class Model:
    """A model that is built up and written. Ids are given in the order of ``add``."""

    def __init__(self, version="2.0"):
        self.version, self.components, self.relations, self.load_cases = version, {}, [], {}

    def add(self, kind, name="", **attributes):
        number = len(self.components) + 1
        self.components[number] = (kind, name, attributes)
        return number

    def relate(self, kind, **roles):
        self.relations.append((kind, roles))

    def part(self, whole, kind, name="", **attributes):
        number = self.add(kind, name, **attributes)
        self.relate("assembly", assembly=whole, part=number)
        return number

    def side(self, kind, inner, outer, name="", **attributes):
        number = self.add(kind, name, **attributes)
        self.relate("side", assembly=number, inner_part=inner, outer_part=outer)
        return number

    def set(self, number, **attributes):
        """The same component with other attributes; None takes one out."""
        kind, name, old = self.components[number]
        new = {k: v for k, v in {**old, **attributes}.items() if v is not None}
        self.components[number] = (kind, name, new)
        return self

    def of(self, kind):
        return [
            number for number, (type_name, _, _) in self.components.items() if type_name == kind
        ]

    def flanks(self, gear):
        """Ids of the flanks of a gear."""
        (roles,) = (r for kind, r in self.relations if kind == "flank" and r["gear"] == gear)
        return roles["left"], roles["right"]

    def shift(self, gear, coefficient):
        """Another profile shift; None takes it out."""
        more = None if coefficient is None else (coefficient, "none")
        for flank in self.flanks(gear):
            self.set(flank, addendum_modification_coefficient=more)

    def copy(self):
        return copy.deepcopy(self)

    def xml(self):
        rows = ['<?xml version="1.0" encoding="UTF-8"?>']
        rows.append(
            f'<model version="{self.version}" applicationId="by hand" applicationVersion="1"'
            ' date="2026-01-01T00:00:00+00:00">'
        )
        rows.append("<relations>")
        for k, (kind, roles) in enumerate(self.relations, 1):
            refs = "".join(f'<ref role="{r}" id="{n}"/>' for r, n in roles.items())
            rows.append(f'<relation id="{k}" type="{kind}">{refs}</relation>')
        rows.append("</relations><components>")
        for number, (kind, name, attributes) in self.components.items():
            head = f'<component id="{number}" type="{kind}" name={quoteattr(name)}>'
            rows.append(head + _xml(attributes) + "</component>")
        rows.append("</components>")
        if self.load_cases:
            rows.append('<load_spectrum id="1">')
            for key, changes in self.load_cases.items():
                inside = "".join(
                    f'<component id="{n}" type="{self.components[n][0]}">{_xml(a)}</component>'
                    for n, a in changes.items()
                )
                rows.append(f'<load_case id="{key}">{inside}</load_case>')
            rows.append("</load_spectrum>")
        return "\n".join([*rows, "</model>"]).encode()

    def json(self):
        model = {
            "version": self.version, "applicationId": "by hand", "applicationVersion": "1",
            "date": "2026-01-01T00:00:00+00:00",
            "relations": [
                {"id": k, "type": kind, "refs": [{"id": n, "role": r} for r, n in roles.items()]}
                for k, (kind, roles) in enumerate(self.relations, 1)
            ],
            "components": [
                {"id": n, "type": kind, "name": name, "attributes": _json(attributes)}
                for n, (kind, name, attributes) in self.components.items()
            ],
        }  # fmt: skip
        if self.load_cases:
            model["load_spectrum"] = {
                "id": 1,
                "load_cases": [
                    {
                        "id": key,
                        "components": [
                            {"id": n, "attributes": _json(a)} for n, a in changes.items()
                        ],
                    }
                    for key, changes in self.load_cases.items()
                ],
            }
        return json.dumps({"model": model}).encode()

    def zip(self):
        data = io.BytesIO()
        with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("model.rexs", self.xml())
        return data.getvalue()

    def write(self, path):
        form = {".rexs": self.xml, ".rexsj": self.json, ".rexsz": self.zip}[path.suffix]
        path.write_bytes(form())
        return path

    def case(self, folder):
        """The case of its file, as ``case_of_file``."""
        return case_of_file(self.write(folder / "model.rexs"))


def _xml(attributes):
    rows = ""
    for key, (value, unit) in attributes.items():
        text = str(value).lower() if isinstance(value, bool) else value
        if isinstance(value, tuple):
            text = "<array>" + "".join(f"<c>{v!r}</c>" for v in value) + "</array>"
        rows += f'<attribute id="{key}" unit="{unit}">{text}</attribute>'
    return rows


def _json(attributes):
    kinds = {bool: "boolean", int: "integer", float: "floating_point", str: "string"}
    rows = []
    for key, (value, unit) in attributes.items():
        if isinstance(value, tuple):
            rows.append({"id": key, "unit": unit, "floating_point_array": list(value)})
        else:
            rows.append({"id": key, "unit": unit, kinds[type(value)]: value})
    return rows


def at(u, v=0.0, w=0.0):
    """Place of a component with its axis along +u."""
    return {
        "support_vector": ((float(u), float(v), float(w)), MM),
        "u_axis_vector": ((1.0, 0.0, 0.0), MM),
    }


def gear(model, shaft, kind, teeth, helix, shift, **more):
    """A gear in the middle of its shaft with equal flanks; returns its id."""
    number = model.part(
        shaft, kind, more.pop("name", kind), number_of_teeth=(teeth, "none"),
        normal_module=(4.0, MM), face_width=(60.0, MM),
        helix_angle_reference_diameter=(helix, DEG), u_coordinate_on_shaft=(50.0, MM), **more,
    )  # fmt: skip
    old = model.version < "1.2"
    flanks = [
        model.add(
            "flank_geometry" if old else "cylindrical_gear_flank",
            normal_pressure_angle=(20.0, "°" if old else DEG),
            addendum_modification_coefficient=(shift, "none"),
        )
        for _ in range(2)
    ]
    model.relate("flank", gear=number, left=flanks[0], right=flanks[1])
    return number


def bearing(radial, axial, u, v=0.0, w=0.0):
    return {
        "radial_stiffness": (radial, "N / m"), "axial_stiffness": (axial, "N / m"),
        "bending_stiffness": (0.0, "N mm / rad"), **at(u, v, w),
    }  # fmt: skip


def planetary(version="2.0"):
    """Ring 70 held, carrier drives, sun 20 out; three planets of 25 teeth; helical."""
    m = Model(version)
    m.unit = m.add("gear_unit", "low_speed")
    m.casing = m.part(m.unit, "gear_casing", "casing")
    m.stage = m.part(m.unit, "planetary_stage", "low")
    m.carrier = m.part(m.stage, "planet_carrier", "frame")
    m.sun_shaft = m.part(m.unit, "shaft", "sun shaft", **at(0))
    m.ring_shaft = m.part(m.unit, "shaft", "ring shaft", **at(0))
    m.drive = m.part(m.carrier, "shaft", "drive", **at(-200), defines_speed=(True, "none"),
                     rotational_speed=(12.0, RPM))  # fmt: skip
    m.relate("planet_carrier_shaft", planetary_stage=m.stage, shaft=m.drive)
    helix = HELIX / math.cos(0)
    m.sun = gear(m, m.sun_shaft, "cylindrical_gear", 20, -helix, 0.0, name="sun", **at(50))
    m.ring = gear(m, m.ring_shaft, "ring_gear", 70, helix, 0.0, name="ring", **at(50))
    arm = ARM / math.cos(math.radians(HELIX))
    m.planets, m.planet_bearings = [], []
    for k in range(3):
        v, w = (arm * f(2 * math.pi * k / 3 + 0.3) for f in (math.cos, math.sin))
        shaft = m.part(m.unit, "shaft", f"planet shaft {k}", **at(0, v, w))
        pin = m.part(m.carrier, "shaft", f"pin {k}", **at(0, v, w))
        m.relate("planet_shaft", planetary_stage=m.stage, shaft=shaft)
        m.relate("planet_pin", planetary_stage=m.stage, shaft=pin)
        planet = gear(m, shaft, "cylindrical_gear", 25, helix, 0.0, name="planet", **at(50, v, w))
        for u in (30.0, 70.0):
            m.planet_bearings.append(
                m.side("concept_bearing", pin, shaft, **bearing(1e9, 2e8, u, v, w))
            )
        for mate, name in ((m.sun, "sun mesh"), (m.ring, "ring mesh")):
            pair = m.part(m.stage, "cylindrical_stage", name, center_distance=(arm, MM))
            m.relate("stage", stage=pair, gear_1=mate, gear_2=planet)
        m.planets.append(planet)
    m.relate("central_shaft", planetary_stage=m.stage, shaft=m.sun_shaft)
    m.main = [
        m.side("concept_bearing", m.drive, m.casing, **bearing(2e9, 4e8, -150.0)),
        m.side("concept_bearing", m.drive, m.casing, **bearing(3e9, 0.0, -50.0)),
    ]
    m.fixed = m.side(
        "coupling", m.ring_shaft, m.casing, radial_stiffness=(4e9, "N / m"),
        axial_stiffness=(4e9, "N / m"), rotational_stiffness=(5e11, "N mm / rad"), **at(50),
    )  # fmt: skip
    m.load = m.part(m.drive, "external_load", "rotor", transmits_torque=(True, "none"),
                    defines_torque=(True, "none"), torque_around_u_axis=(3000.0, NM))  # fmt: skip
    m.brake = m.part(m.sun_shaft, "external_load", "brake", transmits_torque=(True, "none"))
    m.steel = m.add("material", "steel", elastic_modulus=(206000.0, "N / mm^2"),
                    poisson_ratio=(0.29, "none"), density=(7.8, "kg / dm^3"))  # fmt: skip
    m.relate("reference", origin=m.sun, referenced=m.steel)
    return m


def three_stages(version="2.0"):
    """The planetary stage and two parallel ones; the sun's shaft carries the first wheel."""
    m = planetary(version)
    m.components[m.brake] = ("external_load", "none", {})
    m.relations = [r for r in m.relations if m.brake not in r[1].values()]
    shafts, z = [m.sun_shaft], 0.0
    for k, distance in ((1, 220.0), (2, 180.0)):
        z += distance
        shafts.append(m.part(m.unit, "shaft", f"shaft {k}", **at(0, 0.0, z)))
    m.wheels = []
    for k, teeth in ((0, (78, 30)), (1, (62, 26))):
        module = (2 * (220.0, 180.0)[k] / sum(teeth)) * math.cos(math.radians(8))
        pair = m.part(m.unit, "cylindrical_stage", f"pair {k}",
                      center_distance=((220.0, 180.0)[k], MM))  # fmt: skip
        ends = []
        for n in (0, 1):
            sign = 1 if (n + k) % 2 else -1
            number = gear(m, shafts[k + n], "cylindrical_gear", teeth[n], 8.0 * sign, 0.0,
                          name=f"wheel {k}{n}", **at(300.0 + 100 * k))  # fmt: skip
            m.set(number, normal_module=(module, MM), u_coordinate_on_shaft=(300.0 + 100 * k, MM))
            ends.append(number)
            m.side("concept_bearing", shafts[k + n], m.casing, **bearing(1e9, 1e8, 280 + 100 * k))
        m.relate("stage", stage=pair, gear_1=ends[0], gear_2=ends[1])
        m.wheels.append(ends)
    m.out = m.part(shafts[2], "external_load", "generator", transmits_torque=(True, "none"))
    m.section = m.part(m.sun_shaft, "shaft_section", u_coordinate_on_shaft=(0.0, MM),
                       length=(500.0, MM), outer_diameter_begin=(80.0, MM),
                       outer_diameter_end=(80.0, MM), inner_diameter_begin=(20.0, MM),
                       inner_diameter_end=(20.0, MM))  # fmt: skip
    m.relate("reference", origin=m.sun_shaft, referenced=m.steel)
    return m


def case_of_file(path, load_case_id=None):
    """The case of a REXS file, and what was made of it: text, what was assumed and left out."""
    conversion = case_of_document(read_rexs(path), str(path), load_case_id)
    target = path.with_suffix(".toml")
    target.write_text(conversion.text, encoding="utf-8")
    return load_case(target), conversion


def exported(case, path):
    path.write_bytes(model_of_case(case).xml("0"))
    return path


def again(case, folder):
    """The case written and read."""
    return case_of_file(exported(case, folder / "out.rexs"))
