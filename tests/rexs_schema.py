"""What the public REXS schema 2.0 (rexs.info, FVA) says of the components that are exported.

Attributes of each component with their units, and the values that they may have: bounds, or words;
components in the roles of relations.
"""

import operator
import os
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path

import pytest

BOUNDS = {">": operator.gt, ">=": operator.ge, "<": operator.lt, "<=": operator.le}
XSD = os.environ.get("REXS_FILE_XSD")


def table(name):
    """Rows of a table of the schema."""
    path = Path(__file__).parent / "files" / "rexs" / f"schema_2_0_{name}.tsv"
    return [line.split("\t") for line in path.read_text("utf-8").splitlines()[1:]]


ATTRIBUTES = {(kind, name, unit): values for kind, name, unit, values in table("attributes")}
RELATIONS = {tuple(row) for row in table("relations")}


def require_valid(path):
    """Order of elements, ids, references, attributes of each component, their units and values,
    relations; and the format's XSD, if the environment has one."""
    root = ET.parse(path).getroot()
    assert root.tag == "model" and root.get("version") == "2.0"
    assert {"applicationId", "applicationVersion", "date"} <= set(root.keys())
    assert [e.tag for e in root][:2] == ["relations", "components"]
    kinds = {c.get("id"): c.get("type") for c in root.find("components")}
    assert len(kinds) == len(root.find("components"))
    assert max(Counter(r.get("id") for r in root.find("relations")).values()) == 1
    for component in root.iter("component"):
        kind = kinds[component.get("id")]
        assert kind in {name for name, *_ in ATTRIBUTES}
        for attribute in component:
            key = (kind, attribute.get("id"), attribute.get("unit"))
            assert key in ATTRIBUTES
            require_value(attribute, ATTRIBUTES[key].split())
        assert max(Counter(a.get("id") for a in component).values(), default=1) == 1
    for relation in root.find("relations"):
        roles = {f"{ref.get('role')} {kinds[ref.get('id')]}" for ref in relation}
        assert (relation.get("type"), ", ".join(sorted(roles))) in RELATIONS
        assert (relation.get("type") == "manufacturing_step") == (relation.get("order") is not None)
    if XSD:
        pytest.importorskip("xmlschema").XMLSchema(XSD).validate(str(path))


def require_value(attribute, values):
    """A number within bounds, or one of the words."""
    text = attribute.text
    if values and values[0] not in BOUNDS:
        assert text in values, attribute.get("id")
    elif values:
        for sign, bound in zip(values[::2], values[1::2], strict=True):
            assert BOUNDS[sign](float(text), float(bound)), (attribute.get("id"), text)
