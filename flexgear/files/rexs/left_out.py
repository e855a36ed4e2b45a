"""What of a file its case does not hold, one line for each component or kind of relation."""

from __future__ import annotations

from collections import Counter, defaultdict

from flexgear.files.rexs.document import Document

_PLACING = ("reference_component_for_position", "support_vector", "u_axis_vector")
_MOST_IDS = 8  # of components in a line; the rest is counted


def left_out(document: Document) -> list[str]:
    """Lines about components that became nothing, attributes that were not used, relations."""
    _mark_axes(document)
    groups: dict[tuple[str, str, bool], list[str]] = defaultdict(list)
    for component in document.components.values():
        unused = [a.id for a in component.attributes.values() if not a.used]
        unused += [f"{a.id} (of the model, the load case's counts)" for a in component.overridden]
        whole = not component.role and not any(a.used for a in component.attributes.values())
        if unused or not component.role:
            names = ", ".join(sorted(unused)) or "no attributes"
            groups[component.kind, names, whole].append(str(component.id))
    lines = []
    for (kind, names, whole), ids in groups.items():
        shown = ", ".join(ids[:_MOST_IDS]) + (
            f" and {len(ids) - _MOST_IDS} more" * (len(ids) > _MOST_IDS)
        )
        lines.append(f"{kind} {shown}: {'not carried over; ' if whole else ''}{names}")
    relations = Counter(r.kind for r in document.relations if not r.used)
    lines += [f"{count} relations of type {kind}" for kind, count in relations.items()]
    return lines + list(document.other)


def _mark_axes(document: Document) -> None:
    """Places and axes of components that became something are used: they make its frame.

    The w axis of a gear says more, where its teeth stand, and that a case finds by itself.
    """
    for component in document.components.values():
        placing = _PLACING if "gear" in component.kind else (*_PLACING, "w_axis_vector")
        for name in placing if component.role else ():
            if name in component.attributes:
                component.attributes[name].used = True
