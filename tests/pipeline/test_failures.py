"""A failing stage says why and what to do, and takes nothing else with it."""

import pytest
from workplace import Workplace


@pytest.mark.parametrize("how", ["fail", "lose"])
def test_a_missed_gate_and_a_lost_worker_are_told_without_a_traceback(workplace: Workplace, how: str) -> None:
    command = workplace.command("run", "small.yaml", behaviour={"teacher": {how: "height error 0.2 m, limit 0.1 m"}})
    assert command.code == 1
    assert "teacher failed: height error 0.2 m, limit 0.1 m" in command.errors
    assert command.errors.strip().splitlines()[-1] == "iowbc run small.yaml"
    assert "Traceback" not in command.output + command.errors
    assert not workplace.plan()["teacher"].cached
    assert workplace.plan()["rg-fit"].cached


def test_an_exception_is_kept_with_its_traceback(workplace: Workplace) -> None:
    command = workplace.command("run", "small.yaml", behaviour={"teacher": {"raise": "out of luck"}})
    assert command.code == 1
    assert "teacher failed: RuntimeError: out of luck" in command.errors
    (kept,) = workplace.store.runs.work.glob("*/error.txt")
    assert "out of luck" in kept.read_text()
    assert str(kept.relative_to(workplace.folder)) in command.errors


def test_a_failed_stage_goes_on_from_its_checkpoint(workplace: Workplace) -> None:
    workplace.command("run", "small.yaml", behaviour={"teacher": {"raise": "out of luck"}})
    command = workplace.command("run", "small.yaml")
    assert command.code == 0
    assert "teacher: runs - goes on from attempt 1, 100 %" in command.output
    assert list(workplace.store.runs.work.iterdir()) == []


def test_the_end_of_a_run_shows_metrics_tables_and_files(workplace: Workplace) -> None:
    command = workplace.command("run", "small.yaml")
    assert command.code == 0
    lines = [line.rstrip() for line in command.output.splitlines()]
    assert "eval        count 3" in lines
    assert "more tables  runs/small/eval/tables: counts.md" in lines
    assert "figures  runs/small/eval/figures (1)" in lines
    assert lines[lines.index("next:") + 1 :][0] == "  iowbc play small"


def test_progress_is_told_in_plain_lines_where_there_is_no_terminal(workplace: Workplace) -> None:
    command = workplace.command("run", "small.yaml", behaviour={"teacher": {"steps": 20, "pause": 0.05}})
    lines = [line for line in command.output.splitlines() if line.startswith("teacher: ")]
    assert lines[0] == "teacher: runs - nothing stored yet"
    assert any("%" in line and "/s" in line and "left" in line and "count" in line for line in lines[1:-2])
    assert "\x1b" not in command.output
