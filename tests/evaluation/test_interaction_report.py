"""Tables and figures of compliance, impedance and the map of pushes, from made-up trials."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_up_trials import trials_of

from iowbc.evaluation.report.aggregate import aggregate
from iowbc.evaluation.report.interaction import (
    compliance_figure,
    compliance_table,
    impedance_table,
    map_figure,
    map_table,
)
from iowbc.evaluation.report.report import write_report

FREQUENCIES = (0.2, 0.5, 1.0, 2.0)
STIFFNESS, DAMPING, MASS = 400.0, 60.0, 12.0


@pytest.fixture
def partners() -> pd.DataFrame:
    """A follower that exerts nothing, a leader that is fought, a crate that is blocked."""
    follower = trials_of("IO-WBC", "compliance", {4.0: 5}, "follower").assign(
        handle_force_mean=1.0, handle_force_p95=2.0, handle_force_peak=3.0, partner_work=-0.25, E_v_partner=0.05
    )
    leader = trials_of("IO-WBC", "compliance", {4.0: 0}, "leader")
    blocked = trials_of("IO-WBC", "compliance", {65.0: 5}, "blocked crate").assign(
        hand_force_mean=60.0, hand_force_p95=99.0, hand_force_peak=150.4
    )
    nothing = ["handle_force_mean", "handle_force_p95", "handle_force_peak", "partner_work", "E_v_partner"]
    return pd.concat([follower, leader, blocked.assign(**dict.fromkeys(nothing, np.nan))])


@pytest.fixture
def pulls() -> pd.DataFrame:
    """A mass on spring and damper, pulled forward and to the left."""
    parts = []
    for direction in ("forward", "left"):
        for frequency in FREQUENCIES:
            angular = 2 * np.pi * frequency
            parts.append(
                trials_of("IO-WBC", "impedance", {4.0: 5}, f"{direction} {frequency:g} Hz").assign(
                    pull_direction=direction,
                    pull_frequency=frequency,
                    impedance_real=DAMPING,
                    impedance_imag=MASS * angular - STIFFNESS / angular,
                )
            )
    return pd.concat(parts)


@pytest.fixture
def grid() -> pd.DataFrame:
    """Crates that are the harder to push the heavier they are and the more they resist."""
    return pd.concat(
        [
            trials_of("IO-WBC", "map", {10.0: 5, 60.0: count}, f"μ {friction:g}").assign(
                rolling_resistance=friction, push_force=1000.0 * friction
            )
            for friction, count in ((0.02, 5), (0.15, 0))
        ]
    )


def test_partners_are_told_apart_by_force_work_and_who_follows_whom(partners: pd.DataFrame) -> None:
    rows = {(row[0], row[1]): row[2:] for row in compliance_table(aggregate(partners)).rows}
    follower = rows["follower (4 kg)", "IO-WBC"]
    assert follower[:2] == ("5/5", "5/5")
    assert (follower[2], follower[4], follower[7]) == ("1 / 2 / 3", "-0.2", "0.050")
    assert rows["leader (4 kg)", "IO-WBC"] == ("0/5", "0/5", "1 / 1 / 1", "1 / 1 / 1", "+1.0", *["Fails"] * 3), (
        "it fell"
    )
    blocked = rows["blocked crate (65 kg)", "IO-WBC"]
    assert blocked[2:5] == ("–", "60 / 99 / 150", "–")
    assert rows["follower (4 kg)", "stands still"][1] == "none"


def test_a_blocked_crate_is_held_against_the_controllers_before(partners: pd.DataFrame) -> None:
    assert "IO-WBC 113 to 231 N, w/o Distill. 73 to 109 N" in compliance_table(aggregate(partners)).caption


def test_impedance_is_told_by_frequency_and_as_spring_damper_and_mass(pulls: pd.DataFrame) -> None:
    table = impedance_table(aggregate(pulls))
    assert [row[0] for row in table.rows[:5]] == [*(f"forward, {one:g} Hz" for one in FREQUENCIES), "forward, all"]
    slow = DAMPING + 1j * (MASS * 0.4 * np.pi - STIFFNESS / (0.4 * np.pi))
    assert table.rows[0][3:5] == (f"{abs(slow):.0f}", f"{np.degrees(np.angle(slow)):+.0f}")
    assert table.rows[4][5:] == ("400", "60", "12.0")
    assert table.numbers[["stiffness", "damping", "mass_apparent"]].iloc[0].tolist() == pytest.approx(
        [STIFFNESS, DAMPING, MASS]
    )


def test_pulls_that_nobody_survived_fail_and_fit_nothing(pulls: pd.DataFrame) -> None:
    table = impedance_table(aggregate(pulls.assign(survived=False)))
    assert {row[3] for row in table.rows} == {"Fails"}
    assert not any(row[0].endswith("all") for row in table.rows)


def test_the_map_has_a_row_for_each_friction_and_a_column_for_each_mass(grid: pd.DataFrame) -> None:
    table = map_table(aggregate(grid))
    assert table.head[2:] == ("10 kg", "60 kg")
    assert [row[0] for row in table.rows] == ["μ 0.02", "μ 0.15"]
    assert table.rows[0][2] == "5/5, 0.300 / 1.000, 20"
    assert table.rows[1][3] == "0/5, Fails"


def test_heat_maps_have_the_numbers_of_their_cells(grid: pd.DataFrame) -> None:
    both = pd.concat([grid, grid.assign(variant="WBC")])
    figure = map_figure(aggregate(both))
    assert [axes.get_title() for axes in figure.axes[:2]] == ["(a) IO-WBC: success", "(b) IO-WBC: E_v [m/s]"]
    success, error, force = figure.axes[:3]
    assert [text.get_text() for text in success.texts] == ["1.00", "1.00", "1.00", "0.00"]
    assert [text.get_text() for text in error.texts] == ["0.30", "0.30", "0.30"], "nothing where none survived"
    assert [text.get_text() for text in force.texts] == ["20", "20", "150"]


def test_the_figure_of_compliance_marks_whom_nobody_survived(partners: pd.DataFrame, pulls: pd.DataFrame) -> None:
    figure = compliance_figure(aggregate(pd.concat([partners, pulls])))
    handle, hands, followed, impedance = figure.axes
    assert [label.get_text().split("\n")[0] for label in handle.get_xticklabels()] == ["follower", "leader"]
    assert [text.get_text() for text in handle.texts] == ["", ""]
    assert [text.get_text() for text in followed.texts] == ["", "×"]
    assert len(hands.get_xticklabels()) == 3
    assert [len(line.get_xdata()) for line in impedance.lines] == [4, 4]


def test_the_report_has_them_all(
    partners: pd.DataFrame, pulls: pd.DataFrame, grid: pd.DataFrame, tmp_path: Path
) -> None:
    write_report(pd.concat([partners, pulls, grid]), tmp_path, 0.8)
    names = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.*")}
    wanted = {f"tables/{name}.md" for name in ("compliance", "impedance", "push_map", "contact")}
    assert wanted | {"figures/compliance.png", "figures/push_map.png"} <= names
