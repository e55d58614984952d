"""The doctor computes a contact, draws a picture, and fails where something essential does."""

import re
import shutil
from pathlib import Path

import pytest
import typer

from iowbc.commands import doctor
from iowbc.pipeline.store.runs import Runs
from iowbc.robot.description import robot_folder


def test_this_machine_is_fit(tmp_path: Path) -> None:
    found = {finding.name: finding for finding in doctor.findings(Runs(tmp_path / "runs"))}
    assert found["crocoddyl and pin"].verdict == "good", found["crocoddyl and pin"].text
    assert [finding.name for finding in found.values() if finding.verdict == "bad"] == []


def test_a_picture_that_takes_too_long_does_not_make_a_machine_unfit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "PATIENCE", 0.01)
    assert doctor._process("pictures", "import time; time.sleep(9)", "", "doubtful", "").verdict == "doubtful"


@pytest.mark.parametrize("script", ["import os; os.kill(os.getpid(), 11)", "raise ValueError('no')"])
def test_a_crash_of_the_contact_model_is_essential(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], script: str
) -> None:
    monkeypatch.setattr(doctor, "CONTACT_MODEL", script)
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(typer.Exit) as ended:
        doctor.doctor(tmp_path / "runs")
    assert ended.value.exit_code == 1
    assert "pip install crocoddyl==3.2.1 pin==4.0.0" in capsys.readouterr().out


def test_every_robot_is_looked_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "robots" / "r2d2").mkdir(parents=True)
    (tmp_path / "robots" / "r2d2" / "robot.yaml").write_text("name: r2d2\n")
    bent = shutil.copytree(robot_folder("g1"), tmp_path / "robots" / "bent")
    text = re.sub('diaginertia="[^"]*"', 'diaginertia="1 0.001 0.001"', (bent / "g1.xml").read_text(), count=1)
    (bent / "g1.xml").write_text(text)
    monkeypatch.chdir(tmp_path)
    found = {finding.name: finding for finding in doctor._robots()}
    assert found["robot g1"].verdict == "good"
    assert found["robot r2d2"].verdict == "bad"
    assert "missing mjcf" in found["robot r2d2"].text
    assert "inertia must satisfy" in found["robot bent"].text
