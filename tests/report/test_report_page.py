"""A report is one file that opens offline in a browser and holds the curves of all runs."""

import base64
import html
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from iowbc.commands.results import split_tables
from iowbc.learning.curves import TABLE
from iowbc.pipeline.store.artifact import Manifest, write_manifest
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.loading import load_recipe
from iowbc.report.curves import MOST_POINTS, evaluation_panels, learning_figure, learning_panels
from iowbc.report.page import write_page
from iowbc.report.runs import Run, grouped, metrics_table
from iowbc.results.table import Table, heads

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
STEPS = 1000
MANIFEST = Manifest(
    stage="teacher",
    version=1,
    key="key",
    digest="content",
    files={},
    results=(),
    beside={},
    recipe="first",
    made=0.0,
    seconds=60.0,
    attempts=1,
    workers=2,
    host="here",
    code={"task": "c" * 64},
    versions={"python": "3.11"},
)


def make_run(root: Path, name: str, seed: int, gamma: float, score: float) -> Run:
    """A run with a teacher and an evaluation, as their stages leave them."""
    store = Store(Runs(root / "runs"))
    artifacts = {}
    for stage in ("teacher", "eval"):
        key = f"{name}-{stage}"
        folder = store.folder(stage, key)
        (folder / "tables").mkdir(parents=True)
        (folder / "figures").mkdir()
        (folder / "figures" / "comparison.png").write_bytes(b"\x89PNG")
        (folder / "summary.json").write_text(json.dumps({"metrics": {"score": score, "same": 1.0}}))
        (folder / "recipe.yaml").write_text(f"name: {name} </script><b>\n")
        write_manifest(folder, MANIFEST.model_copy(update={"stage": stage, "key": key, "recipe": name}))
        found = store.find(stage, key)
        assert found is not None
        artifacts[stage] = found
    steps = np.arange(1, STEPS + 1)
    curves = {"step": steps, "reward": score * steps, "check/score": np.where(steps % 2, np.nan, 0.5)}
    pd.DataFrame(curves).to_parquet(artifacts["teacher"].folder / TABLE)
    (artifacts["eval"].folder / "tables" / "summary.csv").write_text(
        "suite,case,mass,rate,rate_low,rate_high,E_v,E_v_half\n"
        f"lifting,lifting,0,1,0.6,1,{score},0.01\nlifting,lifting,4,0.8,0.4,1,,\n"
    )
    return Run(name, artifacts, {"name": name, "seed": seed, "teacher": {"gamma": gamma}})


@pytest.fixture
def runs(tmp_path: Path) -> list[Run]:
    """Two seeds of one recipe, and another recipe."""
    return [
        make_run(tmp_path, "first", 0, 0.99, 1.0),
        make_run(tmp_path, "again", 1, 0.99, 3.0),
        make_run(tmp_path, "other", 0, 0.9, 5.0),
    ]


def test_seeds_belong_together_and_rows_that_are_alike_are_left_out(runs: list[Run]) -> None:
    groups = grouped(runs)
    assert [(group.label, len(group.runs)) for group in groups] == [("first (2 seeds)", 2), ("other", 1)]
    rows = {(stage, metric): [str(cell) for cell in cells] for stage, metric, *cells in metrics_table(groups).rows}
    assert rows["teacher", "score"] == ["2 ± 1", "5", "+3"]
    assert ("teacher", "same") not in rows


def test_metrics_of_a_stage_stand_together_also_those_that_only_a_later_run_has(runs: list[Run]) -> None:
    more = runs[2].artifacts["teacher"].folder / "summary.json"
    more.write_text(json.dumps({"metrics": {"score": 5.0, "same": 1.0, "late": 2.0}}))
    assert [row[:2] for row in metrics_table(grouped(runs)).rows] == [
        ("teacher", "score"),
        ("teacher", "late"),
        ("eval", "score"),
    ]
    alone = [row[:2] for row in metrics_table(grouped(runs[:1])).rows]
    assert alone == [("teacher", "score"), ("teacher", "same"), ("eval", "score"), ("eval", "same")]


def test_learning_curves_of_seeds_are_a_band_and_of_few_points(runs: list[Run]) -> None:
    main, others = learning_panels(grouped(runs), "teacher")
    assert [panel.title for panel in main] == ["reward [1/s]", "score of the check"]
    assert others == []
    low, high, mean, other = main[0].figure["data"]
    assert (low["line"]["width"], high["fill"], mean["name"], other["name"]) == (
        0,
        "tonexty",
        "first (2 seeds)",
        "other",
    )
    assert len(mean["x"]) == MOST_POINTS
    np.testing.assert_allclose(mean["y"], 2.0 * 1e6 * np.array(mean["x"]), rtol=1e-4)
    np.testing.assert_allclose(high["y"], 3.0 * 1e6 * np.array(mean["x"]), rtol=1e-4)


def test_the_picture_of_learning_curves_has_a_line_for_each_recipe_and_a_band_of_its_seeds(runs: list[Run]) -> None:
    figure = learning_figure(learning_panels(grouped(runs), "teacher")[0], "teacher")
    reward = figure.axes[0]
    (mean, other), (band,) = reward.get_lines(), reward.collections
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["first (2 seeds)", "other"]
    assert mean.get_ydata()[-1] == pytest.approx(2.0 * 1e6 * mean.get_xdata()[-1], rel=1e-4)
    assert other.get_ydata()[-1] == pytest.approx(5.0 * 1e6 * other.get_xdata()[-1], rel=1e-4)
    last = band.get_paths()[0].vertices
    ends = last[last[:, 0] == last[:, 0].max(), 1]
    np.testing.assert_allclose([ends.min(), ends.max()], 1e6 * last[:, 0].max() * np.array([1, 3]), rtol=1e-4)


def test_every_curve_of_a_training_has_a_title_with_its_unit(runs: list[Run]) -> None:
    names = ("step", "reward", "error/lift/walking/velocity", "seconds/learning", "own")
    pd.DataFrame({name: [1.0] for name in names}).to_parquet(runs[0].artifacts["teacher"].folder / TABLE)
    _, others = learning_panels(grouped(runs[:1]), "teacher")
    assert [panel.title for panel in others] == [
        "error of velocity, lift, walking [m/s]",
        "time of an update, learning [s]",
        "own",
    ]


def test_errors_over_the_mass_have_their_intervals_and_gaps_where_nobody_survived(runs: list[Run]) -> None:
    panels = {panel.title: panel for panel in evaluation_panels(grouped(runs[:1]))}
    low, _, mean = panels["lifting: E_v [m/s]"].figure["data"]
    assert (mean["x"], mean["y"]) == ([0.0, 4.0], [1.0, None])
    assert (low["x"], low["y"]) == ([0.0], [0.99])
    assert panels["lifting: success rate"].figure["data"][2]["y"] == [1.0, 0.8]
    assert {panel.figure["layout"]["yaxis"]["rangemode"] for panel in panels.values()} == {"tozero"}


def test_a_mean_over_one_trial_has_no_band_and_no_interval_of_an_error_is_below_zero(runs: list[Run]) -> None:
    rows = [(0, 0.1, 0.2), (1, 0.1, 0.05), (2, 0.3, ""), (3, 0.2, 0.1)]
    (runs[0].artifacts["eval"].folder / "tables" / "summary.csv").write_text(
        "suite,case,mass,E_v,E_v_half\n" + "".join(f"push,push,{mass},{mean},{half}\n" for mass, mean, half in rows)
    )
    panels = {panel.title: panel for panel in evaluation_panels(grouped(runs[:1]))}
    *bands, mean_line = panels["push: E_v [m/s]"].figure["data"]
    assert mean_line["y"] == [0.1, 0.1, 0.3, 0.2]
    assert [(edge["x"], edge["y"]) for edge in bands] == [
        ([0.0, 1.0], [0.0, 0.05]),
        ([0.0, 1.0], [0.3, 0.15]),
        ([3.0], [0.1]),
        ([3.0], [0.3]),
    ]


def test_a_page_asks_no_network_and_no_content_ends_its_scripts(runs: list[Run], tmp_path: Path) -> None:
    text = written(runs, tmp_path).read_text()
    own = re.sub(r'<script nonce="[^"]*">.*?</script>', "", text, flags=re.DOTALL)
    assert not re.findall(r"""(?:src|href)=["'](?!data:|#)""", own)
    assert "</script><b>" not in own
    assert html.escape("first </script><b>") in own
    figures = [json.loads(html.unescape(figure)) for figure in re.findall(r"data-figure='([^']*)'", text)]
    assert figures[0]["layout"]["title"]["text"] == "lifting: success rate"


HOSTILE = (
    "x<img src=q onerror=\"document.documentElement.dataset.owned='yes'\">"
    "</title></script><script>document.documentElement.dataset.owned='yes'</script>@FIGURES@{{ 7 * 7 }}|safe&amp;"
)


@pytest.fixture
def hostile(tmp_path: Path) -> list[Run]:
    """Runs with markup in every text, and tables with text in the place of numbers."""
    name = HOSTILE.replace("/", "|")  # of files, too
    found = []
    for seed in (0, 1):
        run = make_run(tmp_path, f"{name}{seed}", seed, 0.99, 1.0)
        texts = {"recipe": HOSTILE, "host": HOSTILE, "code": {HOSTILE: HOSTILE}, "versions": {HOSTILE: HOSTILE}}
        artifacts = {
            stage: replace(artifact, manifest=artifact.manifest.model_copy(update=texts))
            for stage, artifact in run.artifacts.items()
        }
        for artifact in artifacts.values():
            (artifact.folder / "summary.json").write_text(json.dumps({"metrics": {HOSTILE: seed}}))
            (artifact.folder / "recipe.yaml").write_bytes(HOSTILE.encode() + b"\xff")
            (artifact.folder / "key.json").write_text(json.dumps({HOSTILE: HOSTILE}))
            (artifact.folder / "figures" / f"{name}.png").write_bytes(b"picture")
        cell = HOSTILE.replace('"', '""')
        error = f"error/a/b/{HOSTILE.replace('/', '|')}"
        curves = {"step": [1, 2], HOSTILE: [2, 3], error: ["3", HOSTILE], "reward": [4, 5]}
        pd.DataFrame(curves).to_parquet(run.artifacts["teacher"].folder / TABLE)
        (run.artifacts["eval"].folder / "tables" / "summary.csv").write_text(
            "suite,case,mass,rate,E_v\n"
            + "".join(f'"{cell}","{cell}",{mass},"{cell}",0.1\n' for mass in (0, 1, f'"{cell}"'))
        )
        recipe = {"description": HOSTILE, "robot": HOSTILE, "seed": HOSTILE, "teacher": {"gamma": seed}}
        found.append(Run(run.label, artifacts, recipe))
    return found


def hostile_page(runs: list[Run], folder: Path) -> Path:
    path = folder / "page.html"
    table = Table("t", HOSTILE, heads(HOSTILE, "b"), [(HOSTILE, "2")])
    media = {f"{HOSTILE}.png": b"picture", f"{HOSTILE}.mp4": b"film"}
    write_page(path, runs, [table], [table], [HOSTILE], media)
    return path


def test_markup_in_any_text_stays_text(hostile: list[Run], tmp_path: Path) -> None:
    text = hostile_page(hostile, tmp_path).read_text()
    own = re.sub(r'<script nonce="[^"]*">.*?</script>', "", text, flags=re.DOTALL)
    assert "<img src=q" not in own
    assert "owned='yes'</script>" not in own
    assert "@FIGURES@{{ 7 * 7 }}" in own
    assert len(own) < 300_000
    curves = re.findall(r"data-figure='([^']*)'", own)
    assert curves
    assert "<" not in "".join(curves)


@pytest.mark.skipif(BROWSER is None, reason="chromium is not installed")
@pytest.mark.parametrize("injected", [False, True], ids=["in every text", "past the template"])
def test_a_browser_runs_no_script_that_an_artifact_brings(hostile: list[Run], tmp_path: Path, injected: bool) -> None:
    page = hostile_page(hostile, tmp_path)
    if injected:
        page.write_text(page.read_text().replace("<main>", f"<main>{HOSTILE}"))
    root, drawn = opened(page, tmp_path / "profile")
    assert "data-owned" not in root
    assert "data-error" not in root
    assert 'data-drawn="yes"' in drawn


def test_the_main_tables_are_shown_at_once_and_the_others_folded(runs: list[Run], tmp_path: Path) -> None:
    text = written(runs, tmp_path).read_text()
    shown, _, folded = text.partition("<summary>1 more table</summary>")
    assert "<td>main</td>" in shown
    assert '<p class="caption">A caption.</p><div class="wide"><table><tr>' in shown
    assert "<td>folded</td>" in folded.partition("</details>")[0]
    tables = [Table(name, "", (), []) for name in ("joints", "heavy", "lifting", "pushes")]
    main, others = split_tables(tables)
    assert ([one.name for one in main], [one.name for one in others]) == (["lifting", "heavy"], ["joints", "pushes"])


def test_the_picture_of_curves_that_the_page_draws_is_left_out(runs: list[Run], tmp_path: Path) -> None:
    pictures = runs[0].artifacts["teacher"].folder / "figures"
    pictures.mkdir(exist_ok=True)
    for name in ("learning_curves.png", "other.png"):
        (pictures / name).write_bytes(b"picture")
    text = written(runs, tmp_path).read_text()
    assert "first, teacher: other.png</figcaption>" in text
    assert "learning_curves.png</figcaption>" not in text


def test_what_shows_all_runs_comes_first(runs: list[Run], tmp_path: Path) -> None:
    media = {"comparison.png": b"picture", "side_by_side.mp4": b"film"}
    write_page(tmp_path / "page.html", runs, [], [], [], media)
    text = (tmp_path / "page.html").read_text()
    for name, content in media.items():
        assert f"all runs: {name}</figcaption>" in text
        assert base64.b64encode(content).decode() in text
    first = text.index('id="films"')
    assert re.findall(r"<figcaption>(.*?)</figcaption>", text[first:])[0] == "all runs: side_by_side.mp4"


@pytest.mark.parametrize("count", [1, 2])
def test_a_wide_table_scrolls_by_itself_and_does_not_widen_the_page(
    runs: list[Run], tmp_path: Path, count: int
) -> None:
    *before, _ = written(runs[:count], tmp_path).read_text().split("<table")
    assert len(before) > count + 2
    assert all(text.rstrip().endswith('<div class="wide">') for text in before)


def written(runs: list[Run], folder: Path) -> Path:
    path = folder / "page.html"
    table, other = (Table(cell, "A caption.", heads("a", "b"), [(cell, "<2>")]) for cell in ("main", "folded"))
    write_page(path, runs, [table], [other], ["teacher.gamma: 0.99 -> 0.9"], {})
    return path


def test_postures_come_first_and_every_artifact_says_where_it_comes_from(runs: list[Run], tmp_path: Path) -> None:
    pictures = runs[0].artifacts["eval"].folder / "figures"
    (pictures / "postures.png").write_bytes(b"picture")
    (pictures / "a.png").write_bytes(b"picture")
    text = written(runs, tmp_path).read_text()
    shown = [caption for caption in re.findall(r"<figcaption>(.*?)</figcaption>", text) if caption.startswith("first")]
    places = [shown.index(f"first, eval: {name}.png") for name in ("postures", "a")]
    assert places == sorted(places)
    provenance = text[text.index('id="provenance"') :]
    for run in runs:
        for stage, artifact in run.artifacts.items():
            assert f"{run.label}/{stage}" in provenance
            assert artifact.manifest.key in provenance
    assert MANIFEST.code["task"][:12] in provenance
    assert MANIFEST.versions["python"] in provenance


def opened(page: Path, profile: Path, *more: str) -> tuple[str, str]:
    """A page in a browser without a network: the tag of its root, and all of it once it is drawn."""
    assert BROWSER is not None
    words = ["--headless", "--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP * ~NOTFOUND"]
    words += ["--window-size=390,6000", "--virtual-time-budget=8000", f"--user-data-dir={profile}", *more]
    command = [BROWSER, *words, "--dump-dom", page.as_uri()]
    drawn = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    return drawn.partition("<html")[2].partition(">")[0], drawn


@pytest.mark.skipif(BROWSER is None, reason="chromium is not installed")
@pytest.mark.parametrize("theme", ["dark", "light"])
def test_a_phone_without_a_network_draws_every_curve(runs: list[Run], tmp_path: Path, theme: str) -> None:
    words = ["--force-dark-mode"] * (theme == "dark")
    root, drawn = opened(written(runs, tmp_path), tmp_path / "profile", *words)
    assert f'data-theme="{theme}"' in root
    assert "data-error" not in root
    places = re.findall(r'class="curve[^"]*"[^>]*', drawn)
    assert len(places) == 2 + 5
    assert all('data-drawn="yes"' in place for place in places)
    assert drawn.count('class="main-svg"') >= len(places)


def test_a_run_alone_has_the_seed_of_its_training() -> None:
    recipe = {"seed": 0, "skill": {"learning": {"seed": None}}, "teacher": {"seed": 1}}
    assert grouped([Run("second", {}, recipe)])[0].seeds == ("1",)


def test_a_second_training_with_fewer_trials_is_of_the_same_variant() -> None:
    folder = Path(__file__).parents[2] / "recipes"
    recipes = [load_recipe(folder / f"{name}.yaml").recipe for name in ("full", "full_seed_1", "blind")]
    groups = grouped([Run(one.name, {}, one.model_dump(mode="json")) for one in recipes])
    assert [group.seeds for group in groups] == [("0", "1"), ("0",)]


def test_trainings_of_the_skill_that_differ_in_their_seed_are_one_variant() -> None:
    runs = [Run(f"{seed}", {}, {"seed": 0, "skill": {"learning": {"seed": seed, "games": 8}}}) for seed in (1, 2)]
    (group,) = grouped(runs)
    assert group.seeds == ("1", "2")
    several = [Run(f"{seed}", {}, {"seed": 0, "skill": {"learning": {"seed": seed, "games": seed}}}) for seed in (1, 2)]
    assert len(grouped(several)) == 2
