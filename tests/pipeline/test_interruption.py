"""Signals leave a checkpoint and the command that resumes; a killed run loses nothing finished; two runs share."""

import json
import re
import shlex
import signal

import pytest
from fake_stages import STARTED
from workplace import SLOW, Workplace, until


def started_at(workplace: Workplace, stage: str) -> int:
    """How far the checkpoint was from which the finished stage went on."""
    (artifact,) = workplace.store.artifacts(stage)
    return int(json.loads((artifact.folder / STARTED).read_text()))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_leaves_a_checkpoint_and_the_command_that_resumes(
    workplace: Workplace, number: signal.Signals
) -> None:
    command = workplace.start("run", "small.yaml", "--set", "eval.trials=7", "--workers", "1", behaviour=SLOW)
    until(lambda: workplace.checkpoint("teacher") > 2)
    command.signal(number)
    assert command.finish() == 130
    assert "checkpoint written" in command.errors
    last = shlex.split(command.errors.strip().splitlines()[-1])
    assert last == ["iowbc", "run", "small.yaml", "--set", "eval.trials=7", "--workers", "1"]
    reached = workplace.checkpoint("teacher")

    again = workplace.command(*last[1:])
    assert again.code == 0, again.errors
    assert "rg-fit: cached" in again.output
    assert "teacher: runs - goes on from attempt 1" in again.output
    assert started_at(workplace, "teacher") == reached
    assert workplace.store.artifacts("teacher")[0].manifest.attempts == 2


def test_a_resumed_run_shows_the_curve_from_its_first_step_on(workplace: Workplace) -> None:
    command = workplace.start("run", "small.yaml", behaviour=SLOW)
    until(lambda: workplace.checkpoint("teacher") > 2)
    command.signal(signal.SIGINT)
    assert command.finish() == 130
    reached = workplace.checkpoint("teacher")

    often = ("--set", "execution.line_interval=0.001")
    again = workplace.start("run", "small.yaml", *often, behaviour=SLOW)
    until(lambda: workplace.checkpoint("teacher") > reached + 2)
    again.signal(signal.SIGINT)
    assert again.finish() == 130
    steps = [step for step, _ in workplace.progress("teacher")["curve"]]  # type: ignore[index]
    assert steps[0] < reached < steps[-1]
    told = [int(share) for share in re.findall(r"^teacher: (\d+) %", again.output + again.errors, re.MULTILINE)]
    assert told
    assert min(told) > 0


def test_a_second_signal_aborts_at_once(workplace: Workplace) -> None:
    command = workplace.start("run", "small.yaml", behaviour={"teacher": {"steps": 3, "pause": 60}})
    until(lambda: workplace.progress("teacher"))
    command.signal(signal.SIGINT)
    until(lambda: "stopping at the next checkpoint" in command.errors)
    command.signal(signal.SIGINT)
    command.finish()
    assert command.code == 130
    assert command.errors.strip().splitlines()[-1] == "iowbc run small.yaml"


def test_a_killed_run_loses_nothing_finished_and_resumes(workplace: Workplace) -> None:
    command = workplace.start("run", "small.yaml", behaviour=SLOW)
    until(lambda: workplace.checkpoint("teacher") > 2)
    command.signal(signal.SIGKILL)
    assert command.finish() == -signal.SIGKILL
    reached = workplace.checkpoint("teacher")

    again = workplace.command("run", "small.yaml")
    assert again.code == 0, again.errors
    assert "rg-dataset: cached" in again.output
    assert started_at(workplace, "teacher") == reached


def test_status_tells_a_running_stage_from_a_stopped_one(workplace: Workplace) -> None:
    command = workplace.start("run", "small.yaml", behaviour=SLOW)
    until(lambda: workplace.checkpoint("teacher") > 2)
    assert f"runs, process {command.process.pid}" in workplace.command("status").output
    (told,) = json.loads(workplace.command("status", "--json").output)["unfinished"]
    assert (told["stage"], told["holder"]["pid"]) == ("teacher", command.process.pid)
    command.signal(signal.SIGKILL)
    command.finish()
    (told,) = json.loads(workplace.command("status", "--json").output)["unfinished"]
    assert told["holder"] is None
    status = workplace.command("status").output
    assert "stopped" in status
    assert "teacher" in status


def test_a_second_run_waits_for_the_first_and_uses_what_it_makes(workplace: Workplace) -> None:
    first = workplace.start("run", "small.yaml", behaviour=SLOW)
    until(lambda: workplace.checkpoint("teacher") > 2)
    second = workplace.start("run", "small.yaml", behaviour=SLOW)
    assert first.finish() == 0
    assert second.finish() == 0
    assert f"teacher: busy, held by process {first.process.pid}" in second.output
    assert "teacher: cached" in second.output
    assert "teacher: runs -" not in second.output
    assert len(workplace.store.artifacts("teacher")) == 1


def test_a_run_that_waits_can_be_interrupted(workplace: Workplace) -> None:
    first = workplace.start("run", "small.yaml", behaviour=SLOW)
    until(lambda: workplace.checkpoint("teacher") > 2)
    second = workplace.start("run", "small.yaml", behaviour=SLOW)
    until(lambda: "busy" in second.output)
    second.signal(signal.SIGTERM)
    assert second.finish() == 130
    assert first.finish() == 0


def test_a_lock_is_free_once_its_holder_is_killed(workplace: Workplace) -> None:
    first = workplace.start("run", "small.yaml", behaviour=SLOW)
    until(lambda: workplace.checkpoint("teacher") > 2)
    second = workplace.start("run", "small.yaml", behaviour=SLOW)
    until(lambda: "busy" in second.output)
    first.signal(signal.SIGKILL)
    first.finish()
    assert second.finish() == 0
    assert started_at(workplace, "teacher") > 2


def test_what_is_forced_stays_forced_until_it_is_finished(workplace: Workplace) -> None:
    workplace.run()
    command = workplace.start("run", "small.yaml", "--force", "rg-fit", "--force", "teacher", behaviour=SLOW)
    until(lambda: workplace.checkpoint("teacher") > 2)
    command.signal(signal.SIGTERM)
    assert command.finish() == 130
    assert command.errors.strip().splitlines()[-1] == "iowbc run small.yaml --force teacher"
    reached = workplace.checkpoint("teacher")
    assert workplace.command("run", "small.yaml", "--force", "teacher").code == 0
    assert started_at(workplace, "teacher") == reached


def test_a_death_between_storing_and_clearing_up_leaves_nothing_unfinished(workplace: Workplace) -> None:
    made = workplace.run()["teacher"].manifest
    work = workplace.store.runs.work / made.key
    (work / "scratch").mkdir(parents=True)
    (work / "progress.json").write_text(json.dumps({"stage": "teacher", "updated": 1.0, "attempts": 1}))
    assert "stopped" not in workplace.command("status").output
    assert workplace.command("run", "small.yaml").code == 0
    assert not work.exists()
