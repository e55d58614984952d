from pathlib import Path

import pandas as pd
import pytest
from matplotlib.figure import Figure

from iowbc.learning.curves import TABLE, Curves, title_of
from iowbc.stages import distill, teacher


def test_rows_after_the_checkpoint_and_a_torn_last_line_are_dropped(tmp_path: Path) -> None:
    path = tmp_path / "curves.jsonl"
    curves = Curves(path, 0)
    for step in (10, 20, 30):
        curves.append(step, {"reward": step / 10})
    with path.open("a") as file:
        file.write('{"step": 40, "rew')
    again = Curves(path, 20)
    assert [row["step"] for row in again.rows] == [10, 20]
    again.append(30, {"reward": 9.0})
    assert [row["reward"] for row in Curves(path, 99).rows] == [1.0, 2.0, 9.0]


def test_a_damaged_line_costs_no_other(tmp_path: Path) -> None:
    path = tmp_path / "curves.jsonl"
    damaged = [
        "[]",
        "3",
        "null",
        '{"reward": 1}',
        '{"step": "1"}',
        '{"step": 1, "reward": []}',
        "{",
        "\udcff",
        "[" * 10**5,
    ]
    lines = ['{"step": 10, "reward": 1.0}', *damaged, '{"step": 20, "reward": 2.0}']
    path.write_bytes("\n".join(lines).encode("utf-8", "surrogateescape"))
    assert [row["step"] for row in Curves(path, 99).rows] == [10, 20]


def test_curves_go_on_from_the_table_that_they_left(tmp_path: Path) -> None:
    curves = Curves(tmp_path / "curves.jsonl", 0)
    curves.append(10, {"reward": 0.123456789})
    curves.append(20, {"reward": 2.0, "late": 1e-12})
    curves.write_table(tmp_path / "curves.parquet")
    Curves.restore(tmp_path / "curves.parquet", tmp_path / "again.jsonl")
    again = Curves(tmp_path / "again.jsonl", 20)
    assert again.rows == curves.rows == [{"step": 10, "reward": 0.123457}, {"step": 20, "reward": 2.0, "late": 1e-12}]
    again.write_table(tmp_path / "again.parquet")
    assert (tmp_path / "again.parquet").read_bytes() == (tmp_path / "curves.parquet").read_bytes()


def test_panels_say_what_they_show_and_in_what_unit() -> None:
    for panel in (*teacher.PANELS, *distill.PANELS):
        assert title_of(panel) != panel
    assert title_of("reward/sync.height") == "reward of sync.height [1/s]"
    assert title_of("unlisted") == "unlisted"


def test_the_figure_leaves_out_what_was_never_recorded(tmp_path: Path) -> None:
    curves = Curves(tmp_path / "curves.jsonl", 0)
    curves.append(10, {"reward": 1.0})
    curves.append(20, {"reward": 2.0, "late": 1.0})
    curves.write_figure(tmp_path / "figure.png", "curves", ["reward", "absent"])
    curves.write_table(tmp_path / "curves.parquet")
    assert (tmp_path / "figure.png").stat().st_size > 2000
    table = pd.read_parquet(tmp_path / "curves.parquet")
    assert table.to_csv(index=False).split() == ["step,reward,late", "10,1.0,", "20,2.0,1.0"]


def test_every_figure_that_a_published_training_recorded_has_a_title() -> None:
    for table in (Path(__file__).parents[2] / "runs" / "published").glob(f"*/*/{TABLE}"):
        names = pd.read_parquet(table).columns[1:]
        assert [name for name in names if title_of(name) == name] == []


@pytest.mark.parametrize(("outlier", "told"), [(1.0, []), (1e6, ["cut: outliers lie beyond"])])
def test_a_panel_says_where_an_outlier_cut_its_axis(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, outlier: float, told: list[str]
) -> None:
    shown: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *given, **more: shown.append(figure))
    curves = Curves(tmp_path / "curves.jsonl", 0)
    for step in range(200):
        curves.append(step, {"reward": 1.0 + 0.01 * step if step != 150 else outlier})
    curves.write_figure(tmp_path / "curves.png", "title", ["reward"])
    assert [text.get_text() for text in shown[0].axes[0].texts] == told
