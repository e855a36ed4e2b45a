"""The HTML page: one file, nothing from outside, right figures, two runs side by side."""

import base64
import json
import re
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

from flexgear.model.errors import FlexgearError
from flexgear.results.report.parts import Row, Table, Verdict
from flexgear.results.report.study_tables import spelled
from flexgear.views import report
from flexgear.views.interactive import panels_of
from flexgear.views.report import (
    MAX_PLOTS,
    Picture,
    Side,
    deflated,
    plotly_script,
    side_by_side,
    typeset,
    within,
    write_report,
)
from flexgear.views.style import panels, save_figure
from flexgear.views.traces import envelope, listed, plain_math

PLOTS = re.compile(r'id="plots">([^<]*)<')
needs_plotly = pytest.mark.skipif(plotly_script() is None, reason="plotly is not installed")


def chart(tmp_path: Path) -> Picture:
    """A picture with a line, a mark and a title."""
    figure, axes = panels(1, 1, height_mm=40)
    axes[0, 0].plot([0.0, 1.0, 2.0], [5.0, np.nan, 7.0], label="planet <1>")
    axes[0, 0].axvline(1.5)
    axes[0, 0].set_xlabel("carrier angle $θ_c$ (rad)")
    axes[0, 0].set_title("force")
    file = save_figure(figure, tmp_path / "a.png", dpi=40)
    return Picture("a", "gear_meshes", "A caption", "What it shows.", file, panels_of(figure))


def side(tmp_path: Path, force: float = 788e3, name: str = "wind <5> MW") -> Side:
    """What a page says of a run."""
    return Side(
        name=name,
        lead="Stage: 5 planets.",
        verdicts=[Verdict("good", "Load sharing", "K = 1.023", "Within 1.35.")],
        tables=[Table("gear_meshes", "forces", [Row("ring", force, "N"), Row("sun", None, "N")])],
        pictures=[chart(tmp_path)],
        version="1.2.3",
        content_hash="abc123",
        notes=["Ring tie: root & averaging."],
    )


def page(tmp_path: Path, *sides: Side, **options) -> str:
    """Text of the page of these sides."""
    path = write_report(tmp_path / "r.html", "wind <5> MW", "wind", sides, **options)
    assert path.stat().st_size < 10e6
    return path.read_text("utf-8")


def visible(text: str) -> str:
    """What a reader sees of a page."""
    text = re.sub(r"<(script|style)\b.*?</\1>", "", text, flags=re.S)
    return re.sub(r"<[^>]*>", " ", text)


def test_the_page_is_one_file_with_escaped_names(tmp_path: Path):
    text = page(tmp_path, side(tmp_path))
    assert "wind &lt;5&gt; MW" in text
    assert "<5>" not in text
    for words in ("788\u00a0kN", "K = 1.023", "A caption", "1.2.3", "abc123", "root &amp; aver"):
        assert words in text
    assert not re.search(r'(src|href)\s*=\s*"(?!data:|#)', text)
    assert not re.search(r"@import|url\(|fetch\(|XMLHttpRequest", text)
    assert "data:image/webp;base64," in text
    assert not re.search(r"\b(nan|None|NaN)\b", visible(text))


@needs_plotly
def test_plots_stand_in_the_page_once_and_without_them_it_is_static(tmp_path: Path):
    text = page(tmp_path, side(tmp_path))
    assert text.count('id="plotly"') == 1
    plots = json.loads(zlib.decompress(base64.b64decode(PLOTS.search(text)[1])))
    line = plots["plot0"]["data"][0]
    assert (line["x"], line["y"]) == ([0.0, 1.0, 2.0], [5.0, None, 7.0])
    assert line["name"] == "planet &lt;1&gt;"
    assert plots["plot0"]["layout"]["xaxis"]["title"]["text"] == "carrier angle θ<sub>c</sub> (rad)"
    assert plots["plot0"]["layout"]["shapes"][0]["x0"] == 1.5
    static = page(tmp_path, side(tmp_path), interactive=False)
    assert "<script" not in static
    assert "data-plot=" not in static
    assert len(static) < 1e5


def test_tables_of_different_windows_stand_side_by_side():
    sides = [
        Side(
            n,
            "",
            (),
            [Table("sharing", "K, in time", [Row("ring", k)], window=f"from {w} s")],
            (),
            "",
            "",
        )
        for n, w, k in (("A", "1 to 2", 1.2), ("B", "3 to 4", 1.5))
    ]
    (table,) = side_by_side(sides, "sharing")
    assert table["title"] == "K, in time, from 1 to 2 s (A), from 3 to 4 s (B)"
    assert table["rows"] == [("ring", ["1.2", "1.5"], "+25.00 %")]
    (alone,) = side_by_side(sides[:1], "sharing")
    assert alone["title"] == "K, in time, from 1 to 2 s"


def test_windows_of_runs_that_settled_and_that_did_not_stand_side_by_side():
    windows = ("from 1 to 2 s, settled", "over all 3 s, not settled")
    sides = [
        Side(n, "", (), [Table("sharing", "K", [Row("ring", 1.2)], window=w)], (), "", "")
        for n, w in zip("AB", windows, strict=True)
    ]
    (table,) = side_by_side(sides, "sharing")
    assert table["title"] == f"K, {windows[0]} (A), {windows[1]} (B)"


def test_compared_factors_have_no_unit_and_words_that_differ_a_mark():
    rows = (
        [Row("K", 1.0, "factor"), Row("play", "70 µm"), Row("speed", 100.0, "Hz")],
        [Row("K", 1.0228, "factor"), Row("play", "55 µm"), Row("speed", 100.0 + 1e-9, "Hz")],
    )
    sides = [
        Side(n, "", (), [Table("accuracy", "of", r)], (), "", "")
        for n, r in zip("AB", rows, strict=True)
    ]
    (table,) = side_by_side(sides, "accuracy")
    assert table["rows"] == [
        ("K", ["1.0000", "1.023"], "+2.28 %"),
        ("play", ["70 µm", "55 µm"], "≠"),
        ("speed", ["100 Hz", "100 Hz"], "="),
    ]


def test_rounding_beside_rounding_is_no_difference():
    sides = [
        Side(n, "", (), [Table("accuracy", "of", [Row("misfit", x, "pitches")])], (), "", "")
        for n, x in (("a", 3e-16), ("b", 1e-16))
    ]
    (table,) = side_by_side(sides, "accuracy")
    assert table["rows"] == [("misfit", ["0 pitches", "0 pitches"], "=")]


def test_long_values_of_two_runs_wrap_on_screens(tmp_path: Path):
    """A value in one line made the page twice as wide as a screen."""
    text = page(tmp_path, side(tmp_path), side(tmp_path), interactive=False)
    on_screen = text.partition("@media print")[0]
    assert "td.value" in on_screen
    assert not re.search(r"td\.value[^{]*{[^}]*nowrap", on_screen)


def test_long_values_wrap_in_print(tmp_path: Path):
    """A sentence in one line covered the next table, and the page was printed smaller for it."""
    order = "69.87 Hz, +1.9 % from 71.21 Hz, tilting, of the modes 3 and 4, force 0.1 %"
    rows = [Row("ring", 788e3, "N"), Row("order 4", order, "")]
    one = replace(side(tmp_path), tables=[Table("gear_meshes", "forces", rows)])
    text = page(tmp_path, one, interactive=False)
    cells = re.findall(r'<td class="(value.*?)">(.*?)</td>', text)
    assert cells == [("value short", "788\u00a0kN"), ("value", typeset(order))]
    assert re.findall(r"td\.(\w+) { white-space: nowrap", text) == ["short"]


def test_two_runs_stand_side_by_side_with_their_difference(tmp_path: Path):
    text = page(tmp_path, side(tmp_path), side(tmp_path, 394e3, "other"), interactive=False)
    row = re.search(r'<tr><th scope="row">ring</th>.*?</tr>', text)[0]
    cells = re.findall(r">([^<>]+)</t[hd]>", row)
    assert cells == ["ring", "788\u00a0kN", "394\u00a0kN", "−50.00\u00a0%"]
    assert text.count("data:image/webp") == 2
    assert "B: other" in text


def test_long_lines_keep_their_envelope():
    x = np.linspace(0, 1, 100_000)
    y = np.sin(200 * x)
    y[54_321] = 3.0
    few_x, few_y = envelope(x, y, 1000)
    assert few_x.size <= 1000
    assert few_y.max() == 3.0
    assert few_y.min() == y.min()
    assert np.all(np.diff(few_x) > 0)


def test_short_lines_keep_the_gaps_between_them():
    """A thousand pieces of a saw tooth with a gap after each: no line leads from its top to the
    next start, neither as drawn nor with half of the points."""
    y = np.tile([*range(99), np.nan], 1000)
    _, drawn = envelope(np.arange(y.size) + 0.0, y, 8000)
    plot = {"a": {"data": [{"type": "scatter", "x": listed(drawn), "y": listed(drawn)}]}}
    text, _, thinned = within(plot, len(deflated(json.dumps(plot))) - 1)
    halved = json.loads(zlib.decompress(base64.b64decode(text)))["a"]["data"][0]["y"]
    assert thinned and len(halved) < drawn.size < y.size
    for line in (drawn, np.array(halved, float)):
        assert np.isnan(line).sum() == 1000 and np.nanmin(np.diff(line)) >= 0


def test_plots_are_thinned_until_they_fit():
    rng = np.random.default_rng(1)
    line = {"type": "scatter", "x": rng.random(4000).tolist(), "y": rng.random(4000).tolist()}
    text, left_out, thinned = within({"a": {"data": [line]}}, 30_000)
    assert thinned
    assert len(text) <= 30_000 and not left_out
    thin = json.loads(zlib.decompress(base64.b64decode(text)))["a"]["data"][0]
    assert len(thin["x"]) == len(thin["y"])
    assert thin["x"][1] in line["x"]


@needs_plotly
def test_a_page_says_what_it_shows_more_coarsely(tmp_path, monkeypatch):
    """Only where it does: a line of noise that loses points, a picture that shrinks."""
    rng, content = np.random.default_rng(3), side(tmp_path)
    line = {"type": "scatter", "x": rng.random(4000).tolist(), "y": rng.random(4000).tolist()}
    Image.fromarray(rng.integers(0, 255, (300, 300, 3), np.uint8)).save(tmp_path / "noise.png")
    noise = Picture(
        "n", "gear_meshes", "Noise", "", tmp_path / "noise.png", [{"data": [line], "layout": {}}]
    )
    content = replace(content, pictures=[noise])
    whole = page(tmp_path, content)
    assert report.THINNED not in whole and report.SMALLER not in whole
    monkeypatch.setattr(report, "MAX_PLOTS", 30_000)
    monkeypatch.setattr(report, "MAX_PICTURES", 60_000)
    coarse = visible(page(tmp_path, content)).replace("&#39;", "'")
    assert report.THINNED in coarse and report.SMALLER in coarse


@needs_plotly
def test_a_page_of_too_much_leaves_out_the_largest_and_says_so(tmp_path, monkeypatch):
    """Noise neither deflates nor thins: plots and pictures of three times what a page holds."""
    monkeypatch.setattr(report, "MAX_PLOTS", MAX_PLOTS // 100)
    monkeypatch.setattr(report, "MAX_PICTURES", report.MAX_PICTURES // 100)
    rng, pictures = np.random.default_rng(2), []
    for k in range(6):
        file = tmp_path / f"{k}.gif"
        file.write_bytes(b"GIF89a" + rng.bytes(15_000 + k))
        noise = {"type": "heatmap", "z": rng.random((35, 35 + k)).tolist()}
        plot = {"data": [noise], "layout": {}}
        pictures.append(Picture(f"p{k}", "gear_meshes", f"Picture {k}", "Noise.", file, [plot]))
    text = page(tmp_path, replace(side(tmp_path), pictures=pictures))
    assert text.count("would make this page too large") >= 4
    plots = json.loads(zlib.decompress(base64.b64decode(PLOTS.search(text)[1])))
    assert set(re.findall(r'data-plot="(\w+)"', text)) == set(plots) != set()


def test_mathtext_becomes_markup():
    assert plain_math("$K_γ$ (–) & <b>") == "K<sub>γ</sub> (–) &amp; &lt;b&gt;"
    assert plain_math("$K_{Hβ}$, $r^2$") == "K<sub>Hβ</sub>, r<sup>2</sup>"


def test_traces_of_one_name_have_one_entry_in_the_legend():
    figure = Figure()
    axes = figure.subplots()
    for height in (1, 2, 3):
        axes.plot([0, 1], [height, height], label="limits" if height < 3 else "mean")
    figure.legend()
    figure.canvas.draw()
    (panel,) = panels_of(figure)
    assert [t["showlegend"] for t in panel["data"]] == [True, False, True]
    assert panel["data"][0]["legendgroup"] == panel["data"][1]["legendgroup"] == "limits"


def test_a_legend_of_the_figure_tells_a_panel_of_its_own_lines():
    """But for marks of no panel, which stand for something else than a line and are in all."""
    figure = Figure()
    left, right = figure.subplots(1, 2)
    red = left.plot([0, 1], color="red", label="red")
    right.plot([0, 1], color="red", label="red")
    blue = right.plot([1, 0], color="blue", label="blue")
    proxy = Line2D([], [], color="green", ls=":")
    dots = [Line2D([], [], color="black", ls="", marker="o", mfc=c) for c in ("black", "white")]
    figure.legend([*red, *blue, proxy], ["red", "blue", "dotted: rigid"])
    right.legend(dots, ["full", "hollow"])
    figure.canvas.draw()
    drawn = panels_of(figure)
    for trace, colour in zip(drawn[1]["data"][2:4], ("#000000", "#ffffff"), strict=True):
        assert trace["mode"] == "markers" and trace["marker"]["color"] == colour
        assert trace["marker"]["line"]["color"] == "#000000"
        drawn[1]["data"].remove(trace)
    named = [[t["name"] for t in p["data"] if t.get("showlegend")] for p in drawn]
    assert [sorted(names) for names in named] == [
        ["dotted: rigid", "red"],
        ["blue", "dotted: rigid", "red"],
    ]


def test_the_title_of_a_figure_stands_below_its_plots(tmp_path: Path):
    """Plots have those of axes alone: they stated no exaggeration."""
    figure = Figure()
    figure.subplots().plot([0, 1], [0, 1])
    figure.suptitle("displacement × 100\nof the ring")
    picture = report.saved_picture(figure, tmp_path, "star", "deflections", "Ring", "A sentence.")
    assert picture.sentence == "A sentence. Displacement × 100; of the ring."


def test_maps_of_one_scale_share_a_colour_bar_and_texts_stand_where_they_are_drawn():
    figure = Figure()
    axes = figure.subplots()
    for left in (0.0, 2.0):
        shown = axes.pcolormesh([left, left + 1], [0, 1], [[left]], vmin=0.0, vmax=5.0)
        axes.text(left, 1.0, "tooth", va="bottom")
    figure.colorbar(shown, ax=axes, label="line load (N/mm)")
    figure.canvas.draw()
    (panel,) = panels_of(figure)
    assert [t["showscale"] for t in panel["data"]] == [True, False]
    assert panel["data"][0]["colorbar"]["title"]["text"] == "line load (N/mm)"
    assert {(t["xanchor"], t["yanchor"]) for t in panel["layout"]["annotations"]} == {
        ("left", "bottom")
    }


def test_numbers_of_bars_stand_beyond_their_ends():
    axes = Figure().subplots()
    axes.bar_label(axes.barh([0, 1], [2.0, -1.0]), ["2", "-1"], padding=3)
    axes.annotate("12-13", (0, 1), textcoords="offset points", xytext=(2, 1))  # not on the axis
    (panel,) = panels_of(axes.figure)
    labels = {t["text"]: (t["xanchor"], t["xshift"]) for t in panel["layout"]["annotations"]}
    assert labels == {"2": ("left", 3), "-1": ("right", -3), "12-13": ("left", 2)}


def test_lines_cover_each_other_as_in_the_picture():
    axes = Figure().subplots()
    axes.plot([0, 1], [0, 1], color="red", zorder=3)
    axes.plot([0, 1], [1, 0], color="blue", zorder=2.9)
    (panel,) = panels_of(axes.figure)
    assert [t["line"]["color"] for t in panel["data"]] == ["#0000ff", "#ff0000"]


def test_load_factors_have_subscripts_and_numbers_stay_with_their_units():
    assert typeset("a <b>, K_Hβ and K_γ of my_K_case") == (
        "a &lt;b&gt;, K<sub>Hβ</sub> and K<sub>γ</sub> of my_K_case"
    )
    assert typeset("σ_0.2 = 1.6 σ_F. 2 h_Fe/m_n, key k_v, k_h_beta, stage.sun.z_mm") == (
        "σ<sub>0.2</sub> = 1.6 σ<sub>F</sub>. 2\u00a0h<sub>Fe</sub>/m<sub>n</sub>, "
        "key k_v, k_h_beta, stage.sun.z_mm"
    )
    assert spelled("h_Fe/m_n in wind_4, key k_v") == "h_Fe/m_n in wind 4, key k_v"
    assert typeset("S_H 1.2, a_ISO, stage_1") == ("S<sub>H</sub> 1.2, a<sub>ISO</sub>, stage_1")
    assert typeset("from 900 kN m to 2 MN m, 5 N me") == (
        "from 900\u00a0kN\u00a0m to 2\u00a0MN\u00a0m, 5\u00a0N me"
    )
    assert typeset("12.5 µm of 1.8 mm in modes 6 and 7") == (
        "12.5\u00a0µm of 1.8\u00a0mm in modes 6\u00a0and 7"
    )


def test_a_missing_picture_is_one_clear_line(tmp_path: Path):
    lost = Picture("a", "gear_meshes", "", "", tmp_path / "gone.png")
    broken = Side("t", "", [], [], [lost], "1", "h")
    with pytest.raises(FlexgearError, match=r"cannot read picture .*gone\.png"):
        write_report(tmp_path / "r.html", "t", "t", [broken])
    assert not (tmp_path / "r.html").exists()


def test_points_under_the_pointer_have_names_and_units():
    """Not "(3.2467, 296.93) trace 3"."""
    figure = Figure()
    lines, bars = figure.subplots(1, 2)
    lines.plot([0.0, 1.0], [2.0, 3.0], color="red", label="planet 1")
    lines.plot([0.0, 1.0], [4.0, 5.0], color="red", label="planet 1")  # the same planet again
    lines.set(xlabel="time (s)", ylabel="force (kN)")
    lines.legend()
    bars.bar([0, 1], [1.0, 2.0])
    bars.set_xticks([0, 1], ["ring", "sun"])  # as all pictures with words have them
    bars.set_ylabel("load (N)")
    bars.axvline(0.5)
    figure.canvas.draw()
    first, second = panels_of(figure)
    assert [shape["layer"] for shape in second["layout"]["shapes"]] == ["above"]  # not behind bars
    assert [trace["showlegend"] for trace in first["data"]] == [True, False]
    for trace in first["data"]:
        template = trace["hovertemplate"]
        assert (
            template.startswith("<b>planet 1</b><br>time (s): %{x")
            and "force (kN): %{y" in template
        )
    (trace,) = second["data"]
    assert trace["customdata"] == [["ring"], ["sun"]]
    assert trace["hovertemplate"].startswith("%{customdata[0]}<br>load (N): %{y")


def test_every_table_and_picture_has_words_for_readers(tmp_path):
    text = page(tmp_path, side(tmp_path), interactive=False)
    assert text.count("<table>") == text.count('<th scope="col">Figure</th>') > 0
    assert 'alt="A caption. What it shows."' in text


def test_sections_close_and_the_case_is_closed_at_first(tmp_path):
    """By the keyboard, too; what is closed is not printed; the first link skips the verdicts."""
    one = side(tmp_path)
    case = [replace(table, section="case") for table in one.tables]
    text = page(tmp_path, replace(one, tables=[*one.tables, *case]), interactive=False)
    chapters = re.findall(r'<section id="(\w+)">\s*<details class="chapter"( open)?>', text)
    assert [(key, bool(is_open)) for key, is_open in chapters] == [
        ("gear_meshes", True),
        ("case", False),
    ]
    assert text.count("<summary><h2>") == 2
    assert 'class="skip" href="#gear_meshes"' in text
    assert "section:has(> .chapter:not([open]))" in text
