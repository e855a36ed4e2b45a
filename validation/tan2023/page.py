"""One page with every published statement, what is computed for it, tolerance, verdict and why."""

from __future__ import annotations

from html import escape
from pathlib import Path

from flexgear.files.atomic import atomic_file
from tan2023.pictures import PICTURES
from tan2023.statements import STATEMENTS, Finding, Findings, Statement
from tan2023.tables import Table, tables

STYLE = (Path(__file__).parents[1] / "page.css").read_text("utf-8")
WRAPPING = "td:first-child, td:nth-child(5) { white-space: nowrap; }"


def verdict(one: Statement, found: Finding) -> str:
    """met; not met (a demanded statement); disagrees (nothing demanded); reported."""
    if found.holds is None:
        return "reported"
    if found.holds:
        return "met"
    return "not met" if one.demanded else "disagrees"


def sorted_statements() -> list[Statement]:
    """By figure."""
    return sorted(STATEMENTS, key=lambda s: s.figures)


def html_table(table: Table) -> str:
    """Heading and table."""
    head = "".join(f"<th>{escape(h)}</th>" for h in table.head)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(c)}</td>" for c in row) + "</tr>" for row in table.rows
    )
    return (
        f"<h3>{escape(table.title)}</h3><table><thead><tr>{head}</tr></thead>"
        f"<tbody>{rows}</tbody></table>"
    )


def write_page(folder: Path, findings: Findings) -> Path:
    """Table of all statements, then all pictures; returns index.html."""
    rows = []
    for one in sorted_statements():
        found = findings.of(one)
        said = verdict(one, found)
        cells = [
            ", ".join(str(f) for f in one.figures),
            one.published,
            found.computed,
            one.tolerance,
            f'<span class="{said.replace(" ", "-")}">{said}</span>',
            found.why,
        ]
        html = [c if k == 4 else escape(c) for k, c in enumerate(cells)]
        rows.append("<tr>" + "".join(f"<td>{c}</td>" for c in html) + "</tr>")
    runs = findings.runs
    case, whole = runs.case, runs.case.case
    drive, output = (whole.port_inertia(port.member) for port in whole.ports)
    reduction = "; ".join(
        f"{b.name}: {b.report['fe_dofs']} FE dofs, static error "
        f"{100 * (b.report['static_error'] or 0):.2f} %, frequency error "
        f"{100 * b.report['frequency_error']:.2f} % to {b.report['frequency_limit_hz']:.0f} Hz"
        for b in runs.bodies.values()
    )
    head = (
        f"<p>Case {escape(whole.name)} with the changes of case.toml, fidelity {runs.fidelity}, "
        f"contact {case.gear_mesh.contact_law}, tie {case.ring.tie} ({case.ring.tie_kind}), pair "
        f"stiffness {case.gear_mesh.pair_stiffness}. Inertia: drive {drive:.3g}, output "
        f"{output:.3g} kg m²; brake torque ~ speed<sup>{whole.output.brake_exponent:g}</sup>. "
        f"Content hash {whole.content_hash()[:16]}. {escape(reduction)}. Tan et al. 2023, "
        "DOI 10.16385/j.cnki.issn.1004-4523.2023.05.002; what it leaves open, misprints and "
        "sign conventions: source.md. Published statements are in our words.</p>"
    )
    pictures = "".join(
        f'<figure id="figure-{p.number}"><img src="{p.file}" alt="Figure {p.number}: '
        f'{escape(p.title)}"></figure>'
        for p in PICTURES
    )
    studies = "".join(html_table(t) for t in tables(runs))
    text = (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>Tan et al. 2023'
        f"</title><style>{STYLE}{WRAPPING}</style></head><body>"
        f"<h1>Tan et al. 2023, Figures 7–25</h1>{head}"
        "<table><thead><tr><th>Figure</th><th>Published</th><th>Computed</th><th>Tolerance</th>"
        f"<th>Verdict</th><th>Why</th></tr></thead><tbody>{''.join(rows)}</tbody></table>"
        f"<h2>Studies</h2>{studies}<h2>Pictures</h2>{pictures}</body></html>"
    )
    target = folder / "index.html"
    with atomic_file(target) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return target
