"""What stands in a REXS file: components with attributes, relations between them, load cases.

Every attribute remembers whether something of the case came from it, so that the rest can be
listed: nothing of a file is dropped unseen.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from operator import itemgetter
from typing import TypeVar

from flexgear.files.rexs.tables import SCHEMA_UNITS, factor
from flexgear.model.errors import InputError, echo

SAME = 1e-9  # relative difference of two numbers that say the same
_SHOWN = 40  # characters of a component's name in comments


@dataclass(eq=False)
class Attribute:
    """One attribute as text (scalar), texts (array), or None where it is a matrix or the like.

    where: of which load case it is, "" for one of the model itself. used: whether the case has it.
    """

    id: str
    unit: str
    value: str | tuple[str, ...] | None
    where: str = ""
    used: bool = False


@dataclass(eq=False)
class Component:
    """A component: type, number and name of the file, attributes by id.

    role: what it became in the case, "" for one that stands for nothing there. overridden:
    attributes in whose place those of the chosen load case stand.
    """

    id: int
    kind: str
    name: str
    attributes: dict[str, Attribute] = field(default_factory=dict)
    role: str = ""
    overridden: list[Attribute] = field(default_factory=list)

    @property
    def label(self) -> str:
        """Type, id and name, printable."""
        name = " ".join("".join(c if c.isprintable() else " " for c in self.name).split())
        name = name if len(name) <= _SHOWN else f"{name[: _SHOWN - 1]}…"
        return f"{self.kind} {self.id}" + (f' "{name}"' if name else "")


@dataclass(eq=False)
class Relation:
    """A relation: type, (role, component's id) of each reference."""

    id: int
    kind: str
    refs: tuple[tuple[str, int], ...]
    used: bool = False

    def of(self, role: str) -> int | None:
        """Id of the component in that role, None if there is none."""
        for name, number in self.refs:
            if name == role:
                return number
        return None


Numbered = TypeVar("Numbered", Component, Relation)


@dataclass
class LoadCase:
    """Attributes of components in one load case, (component's id, attribute)."""

    spectrum: int
    id: int
    attributes: list[tuple[int, Attribute]]


@dataclass
class Document:
    """A REXS model. ``other``: what stands in it besides, in words, to be listed.

    Components and relations are looked up by kind and by what they belong to; there may be hundreds
    of thousands.
    """

    version: str
    application: str
    components: dict[int, Component]
    relations: list[Relation]
    load_cases: list[LoadCase] = field(default_factory=list)
    other: list[str] = field(default_factory=list)

    def kind(self, *kinds: str) -> list[Component]:
        """Components of these types, in the order of the file."""
        return _in_order(self._components_by_kind, kinds)

    def related(self, *kinds: str) -> list[Relation]:
        """Relations of these types, in the order of the file."""
        return _in_order(self._relations_by_kind, kinds)

    def at(self, relation: Relation, role: str) -> Component | None:
        """The component in a role of a relation."""
        number = relation.of(role)
        return None if number is None else self.components.get(number)

    def parts(self, whole: Component, *kinds: str) -> list[Component]:
        """Sub-components of these types (all, if none is named) of a component."""
        components = []
        for relation, part in self._parts.get(whole.id, ()):
            if not kinds or part.kind in kinds:
                relation.used = True
                components.append(part)
        return components

    def wholes(self, part: Component) -> list[Component]:
        """Components that a component is assembled to."""
        return [whole for _, whole in self._wholes.get(part.id, ())]

    def references(self, origin: Component, *kinds: str) -> list[Component]:
        """Components of these types that ``origin`` refers to."""
        components = []
        for relation, target in self._targets.get(origin.id, ()):
            if target.kind in kinds:
                relation.used = True
                components.append(target)
        return components

    def linked(self, origin: Component, role: str, target: str, *kinds: str) -> list[Component]:
        """Components in the role ``target`` of relations of these types in which ``origin`` has the
        role ``role``."""
        components = []
        for relation in self.related(*kinds):
            component = self.at(relation, target) if relation.of(role) == origin.id else None
            if component is not None:
                relation.used = True
                components.append(component)
        return components

    def joints(
        self, *kinds: str
    ) -> Iterator[tuple[Relation, Component, tuple[Component, Component]]]:
        """Bearings and couplings of these types, each with its relation, inner and outer part."""
        for relation in self.related("side"):
            joint = self.at(relation, "assembly")
            inner, outer = self.at(relation, "inner_part"), self.at(relation, "outer_part")
            if joint is None or inner is None or outer is None or joint.kind not in kinds:
                continue
            yield relation, joint, (inner, outer)

    @cached_property
    def _components_by_kind(self) -> dict[str, list[tuple[int, Component]]]:
        return _by_kind(self.components.values())

    @cached_property
    def _relations_by_kind(self) -> dict[str, list[tuple[int, Relation]]]:
        return _by_kind(self.relations)

    @cached_property
    def _parts(self) -> dict[int, list[tuple[Relation, Component]]]:
        return self._from("assembly", "part", ("assembly", "ordered_assembly"))

    @cached_property
    def _wholes(self) -> dict[int, list[tuple[Relation, Component]]]:
        return self._from("part", "assembly", ("assembly",))

    @cached_property
    def _targets(self) -> dict[int, list[tuple[Relation, Component]]]:
        return self._from("origin", "referenced", ("reference", "ordered_reference"))

    def _from(
        self, one: str, other: str, kinds: tuple[str, ...]
    ) -> dict[int, list[tuple[Relation, Component]]]:
        """Relations of these types and the component in the role ``other``, by the id in that of
        ``one``."""
        relations: dict[int, list[tuple[Relation, Component]]] = {}
        for relation in self.related(*kinds):
            roles = dict(reversed(relation.refs))  # the first of a role counts
            if one in roles and roles.get(other) in self.components:
                relations.setdefault(roles[one], []).append(
                    (relation, self.components[roles[other]])
                )
        return relations

    def take_load_case(self, chosen: LoadCase) -> None:
        """Put the attributes of a load case in the place of the model's own."""
        for number, attribute in chosen.attributes:
            component = self.components[number]
            before = component.attributes.get(attribute.id)
            if before is not None:
                component.overridden.append(before)
            component.attributes[attribute.id] = attribute

    @contextmanager
    def values_of(self, load_case: LoadCase) -> Iterator[None]:
        """Let components have the attributes of another load case inside the block."""
        before = {c.id: c.attributes for c in self.components.values()}
        for component in self.components.values():
            model = {k: a for k, a in component.attributes.items() if not a.where}
            component.attributes = model | {a.id: a for a in component.overridden}
        for number, attribute in load_case.attributes:
            self.components[number].attributes[attribute.id] = attribute
        try:
            yield
        finally:
            for number, attributes in before.items():
                self.components[number].attributes = attributes


def _by_kind(every: Iterable[Numbered]) -> dict[str, list[tuple[int, Numbered]]]:
    groups: dict[str, list[tuple[int, Numbered]]] = {}
    for place, item in enumerate(every):
        groups.setdefault(item.kind, []).append((place, item))
    return groups


def _in_order(
    by_kind: Mapping[str, list[tuple[int, Numbered]]], kinds: Sequence[str]
) -> list[Numbered]:
    """All of these types, by their places in the file."""
    of_kinds = (pair for kind in dict.fromkeys(kinds) for pair in by_kind.get(kind, ()))
    return [item for _, item in sorted(of_kinds, key=itemgetter(0))]


@dataclass(frozen=True)
class Datum:
    """A number of the file and the place it comes from, as a comment says it."""

    value: float
    source: str


def number(components: Sequence[Component], ids: str | Iterable[str], unit: str) -> Datum | None:
    """The first of the attributes ``ids`` that any of the components states, in ``unit``; or None.

    The components stand for one part (both flanks, all planets): the first that states the
    attribute decides, and equal statements of the others are marked as used, too. Statements in a
    unit that cannot be converted stay unused.
    """
    for name in (ids,) if isinstance(ids, str) else ids:
        for k, component in enumerate(components):
            value = _converted(component, name, unit)
            if value is None:
                continue
            attribute = component.attributes[name]
            attribute.used = True
            for twin in components[k + 1 :]:
                other = _converted(twin, name, unit)
                if other is not None and math.isclose(other, value, rel_tol=SAME, abs_tol=SAME):
                    twin.attributes[name].used = True
            source = ", ".join(filter(None, (component.label, name, attribute.where)))
            return Datum(value, source)
    return None


def text(components: Sequence[Component], name: str) -> str | None:
    """A word (enumeration, boolean, name) of the first component that has it."""
    for component in components:
        attribute = component.attributes.get(name)
        if attribute is None or not isinstance(attribute.value, str):
            continue
        attribute.used = True
        for twin in components:
            same = twin.attributes.get(name)
            if same is not None and same.value == attribute.value:
                same.used = True
        return attribute.value.strip()
    return None


def flag(components: Sequence[Component], name: str) -> bool | None:
    """A boolean, None where it is not given."""
    answer = text(components, name)
    return None if answer is None else answer.lower() in ("true", "1", "1.0")


def vector(component: Component, name: str) -> tuple[float, float, float] | None:
    """Three lengths in mm, None where they are missing."""
    attribute = component.attributes.get(name)
    if attribute is None or not isinstance(attribute.value, tuple) or len(attribute.value) != 3:
        return None
    scale = factor(attribute.unit or SCHEMA_UNITS.get(name, ""), "mm")
    try:
        x, y, z = (float(v) * (1.0 if scale is None else scale) for v in attribute.value)
    except ValueError:
        return None
    if not all(map(math.isfinite, (x, y, z))):
        raise InputError(
            component.label, name, f"{echo(' '.join(attribute.value))} is no place or direction",
            "export the model again",
        )  # fmt: skip
    attribute.used = True
    return x, y, z


def _converted(component: Component, name: str, unit: str) -> float | None:
    attribute = component.attributes.get(name)
    if attribute is None or not isinstance(attribute.value, str):
        return None
    unit_text = attribute.unit.strip()
    if unit_text in ("", "none"):
        unit_text = SCHEMA_UNITS.get(name, unit_text)
    scale = factor(unit_text, unit)
    try:
        value = float(attribute.value)
    except ValueError:
        return None
    return value * scale if scale is not None and math.isfinite(value) else None
