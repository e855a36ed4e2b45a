"""Building a Document with what every reader must check: ids that are whole, once, and there."""

from __future__ import annotations

from collections import Counter
from typing import Any

from flexgear.files.rexs.document import Attribute, Component, Document, LoadCase, Relation
from flexgear.model.errors import InputError, echo


class Checked:
    """Components, relations and load cases as they are read. ``other``: what is only listed."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.other: list[str] = []
        self._components: dict[int, Component] = {}
        self._relations: list[Relation] = []
        self._load_cases: list[LoadCase] = []

    def whole(self, value: Any, key: str) -> int:
        """An id. InputError for what is no whole number."""
        try:
            return int(value if isinstance(value, str) else str(value))
        except ValueError:
            raise InputError(
                self.where, key, f"{echo(value)} is not a whole number", "is the file whole?"
            ) from None

    def component(self, component: Component) -> None:
        """Take a component; its id must be new."""
        if component.id in self._components:
            raise InputError(
                self.where, "component id", f"{component.id} is there twice",
                f"give {component.label} an id of its own",
            )  # fmt: skip
        self._components[component.id] = component

    def relation(self, relation: Relation) -> None:
        """Take a relation."""
        self._relations.append(relation)

    def load_case(self, load_case: LoadCase) -> None:
        """Take a load case."""
        self._load_cases.append(load_case)

    def accumulation(self, accumulation: list[tuple[int, Attribute]]) -> None:
        """List results that are summed over load cases."""
        for number, count in Counter(number for number, _ in accumulation).items():
            names = ", ".join(sorted(a.id for k, a in accumulation if k == number))
            self.other.append(f"accumulation of component {number}: {count} attributes ({names})")

    def document(self, version: str, application: str) -> Document:
        """What was taken. InputError where nothing is, or a reference leads nowhere."""
        if not self._components:
            raise InputError(self.where, "components", "there are none", "is the file whole?")
        for relation in self._relations:
            lost = [number for _, number in relation.refs if number not in self._components]
            if lost:
                self.other.append(
                    f"{relation.kind} relation {relation.id}: refers to component {lost[0]}, which"
                    " is not in the file"
                )
        for case in self._load_cases:
            attributes = [(k, a) for k, a in case.attributes if k in self._components]
            if len(attributes) < len(case.attributes):
                self.other.append(f"load case {case.id}: attributes of components not in the file")
            case.attributes = attributes
        relations = [r for r in self._relations if all(k in self._components for _, k in r.refs)]
        return Document(
            version, application, self._components, relations, self._load_cases, self.other
        )
