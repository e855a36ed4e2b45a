"""Every statement of the paper as a row, and the studies behind them as reported ones."""

from rows import Row

from tan2023 import drive_statements, load_statements, motion_statements, ring_statements
from tan2023.drive_statements import drop_spread, steady_sharing
from tan2023.findings import STATEMENTS, Statement
from tan2023.load_statements import compliance_study
from tan2023.motion_statements import sensitivity
from tan2023.runs import Runs, shared_runs

TOPICS = (ring_statements, load_statements, motion_statements, drive_statements)  # enter theirs


def rows(fidelity: str) -> list[Row]:
    """Statements by figure; one that the paper makes and nothing demands is reported. Then
    studies, and what was computed with."""
    runs = shared_runs(fidelity)
    statements = sorted(STATEMENTS, key=lambda s: s.figures)
    return [*(_row(one, runs) for one in statements), *_studies(runs), _setup(runs)]


def _row(one: Statement, runs: Runs) -> Row:
    finding = one.measure(runs)
    disagrees = "" if one.demanded or finding.holds is not False else "Disagrees with the paper."
    return Row(
        paper="tan2023",
        where="Figure " + ", ".join(str(f) for f in one.figures),
        quantity=one.name.replace("_", " "),
        published=one.published,
        computed=finding.computed,
        tolerance=one.tolerance,
        holds=finding.holds if one.demanded else None,
        why=" ".join(t for t in (disagrees, finding.why) if t),
    )


def _reported(where: str, quantity: str, computed: str) -> Row:
    return Row("tan2023", where, quantity, "", computed, "reported", None, against="")


def _studies(runs: Runs) -> list[Row]:
    """Which compliance causes how much; load sharing of eight variants; rim and bolts."""
    passages, steady = compliance_study(runs), steady_sharing(runs)
    texts = {
        (
            "Figures 17, 18",
            f"tooth load of planet 1 against the stiffness split, {name}",
        ): "; ".join(
            f"{gear}: peak {100 * (p.ratio - 1):+.1f} %, before (+) by {100 * p.lead:+.1f} % of the"
            " contact"
            for gear, p in passage.items()
        )
        for name, passage in passages.items()
    }
    for bends, spread in drop_spread(runs).items():
        sharing = "; ".join(
            f"K, {name}: mean {k[bends][0]:.4f}, largest {k[bends][1]:.4f}"
            for name, k in steady.items()
        )
        quantity = f"load sharing, flexible: {bends if bends != 'rigid' else 'none'}"
        texts["Figures 19, 25", quantity] = f"{sharing}; spread in a drop to 4e5 N m {spread:.4f}"
    for change, (x, y, z) in sensitivity(runs).items():
        quantity = f"peaks of tooth node 1, {change}"
        texts["Figure 16", quantity] = (
            f"x {x:.1f}, y {y:.1f}, z {z:.1f} µm (statics, quick FE mesh)"
        )
    return [_reported(*key, computed) for key, computed in texts.items()]


def _setup(runs: Runs) -> Row:
    case, whole = runs.case, runs.case.case
    drive, output = (whole.port_inertia(port.member) for port in whole.ports)
    reduction = "; ".join(
        f"{b.name}: {b.report['fe_dofs']} FE dofs, static error "
        f"{100 * (b.report['static_error'] or 0):.2f} %, frequency error "
        f"{100 * b.report['frequency_error']:.2f} % to {b.report['frequency_limit_hz']:.0f} Hz"
        for b in runs.bodies.values()
    )
    text = (
        f"case {whole.name}, fidelity {runs.fidelity}, contact {case.gear_mesh.contact_law}, tie "
        f"{case.ring.tie} ({case.ring.tie_kind}), pair stiffness {case.gear_mesh.pair_stiffness}; "
        f"inertia: drive {drive:.3g}, output {output:.3g} kg m²; brake torque ~ speed^"
        f"{whole.output.brake_exponent:g}; content hash {whole.content_hash()[:16]}; {reduction}"
    )
    return _reported("case.toml", "what was computed with", text)
