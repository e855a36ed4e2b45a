"""Tables of the load along the face: largest of the planets, units, and runs that hold less."""

from flexgear.results.report.tables import face_tables

OLD = {
    "k_h_beta": 1.5,
    "largest_line_load_n_per_mm": 1700.0,
    "largest_contact_pressure_mpa": 800.0,
    "misalignment_um": -90.0,
    "transmission_error_peak_to_peak_um": 4.0,
}
NEW = {
    **OLD,
    "tip_contact_positions": 0.25,
    "misalignment_by_cause_um": {"ring": 17.0, "carrier": -107.0},
    "gear_mesh_stiffness_n_per_um": {"min": 1e4, "mean": 1.1e4, "max": 1.2e4},
    "transmission_error_orders_um": [1.6, 0.6, 0.2, 0.1],
}


def rows(one):
    less = {**one, "misalignment_um": 20.0, "k_h_beta": 1.1}
    flanks = {"stage ring 1 drive": less, "stage ring 2 drive": one}
    summary = {"face_load": {"flexible": flanks}}
    return {row.label: row for table in face_tables(summary) for row in table.rows}


def test_figures_come_in_si_units_or_as_they_are_said():
    found = rows(NEW)
    for label, value, unit in (
        ("ring, face load factor K_Hβ (ISO 6336-1)", 1.5, ""),
        ("ring, misalignment over the face", -90e-6, "m"),
        ("ring, largest Hertz pressure", 8e8, "Pa"),
        ("ring, edge contact of tips, of the positions", 0.25, "share"),
        ("ring, carrier", -107e-6, "m"),
        ("ring, stiffness of the gear mesh, mean", 1.1e10, "N/m"),
        ("ring, transmission error, order 3", 0.2e-6, "m"),
    ):
        assert abs(found[label].value / value - 1) < 1e-12
        assert found[label].unit == unit
    assert "ring, transmission error, order 4" not in found


def test_runs_of_earlier_versions_show_what_they_hold():
    found = rows(OLD)
    assert len(found) == len(OLD)
    assert set(found) < set(rows(NEW))
