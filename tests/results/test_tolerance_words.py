"""The first screen of a tolerance study."""

from flexgear.results.report.study_tables import tolerance_verdicts


def group(share: float, high: float) -> dict:
    return {
        "iec_61400_4": 1.44,
        "share_above_iec_61400_4": {"value": share, "low": 0.0, "high": high},
    }


def test_groups_with_the_same_interval_are_one_verdict_with_its_confidence():
    alike = {f"stage {gear} {side}": group(0.0, 0.0881)
             for side in ("left", "right") for gear in ("ring", "sun")}  # fmt: skip
    study = {"samples": 40, "failed": 0, "load_sharing": alike | {"b ring": group(0.01, 0.03)}}
    few, many = tolerance_verdicts(study)
    assert few.subject == "load sharing, ring left, sun left, ring right, sun right"
    assert (few.level, few.figure) == ("watch", "0 % of sets")
    assert "may be up to 8.81 %" in few.sentence and "draw more" in few.sentence
    assert (many.level, many.subject) == ("good", "load sharing, b ring")
    assert "draw more" not in many.sentence
    (bad,) = tolerance_verdicts({**study, "load_sharing": {"stage ring": group(0.5, 0.6)}})
    assert bad.level == "watch" and "draw more" not in bad.sentence
