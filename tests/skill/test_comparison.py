"""The games of `skill-eval`, and what its tables make of them."""

import itertools
from contextlib import closing
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from iowbc.errors import Interrupted, StageFailed
from iowbc.learning.networks import TeacherNetwork
from iowbc.recipe.skill.skill import SkillEvaluation
from iowbc.results.table import markdown
from iowbc.skill.episodes import Plan
from iowbc.skill.evaluation.games import Competitor, planned_games, play_batches
from iowbc.skill.evaluation.tables import COLUMNS, estimate, figure, headline, improvement, tables, worst_partner
from iowbc.skill.game import TransportGame
from iowbc.skill.lower_layer import Student
from iowbc.task.specification import Specification


def games(forces: dict[str, dict[str, float]], trainings: int = 2, episodes: int = 6) -> pd.DataFrame:
    """Made-up episodes; `forces`: partner force by label and partner, to which the episode's number is added."""
    rows = []
    for label, partners in forces.items():
        for (partner, force), known, training, episode in itertools.product(
            partners.items(), (True, False), range(trainings), range(episodes)
        ):
            told = {"label": label, "training": str(training), "task": "lift_straight", "mass": 4.0}
            told |= {"known": known, "partner": partner, "episode": episode, "fallen": False, "dropped": False}
            told |= dict.fromkeys(COLUMNS, 1.0) | {"success": episode > 0, "partner_force_p90": force + episode}
            rows.append(told)
    return pd.DataFrame(rows)


FORCES = {"MAPPO": {"path": 10.0, "tugging": 20.0}, "follower": {"path": 20.0, "tugging": 50.0}}


def test_the_interquartile_mean_leaves_out_the_extremes() -> None:
    own = games({"MAPPO": {"path": 0.0}}, trainings=1, episodes=8).query("known")
    own["partner_force_p90"] = [1e6, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, -1e6]
    value, low, high = estimate(own, "partner_force_p90")
    assert value == pytest.approx(3.5)
    assert low <= value <= high


def test_the_worst_partner_is_the_one_with_most_force() -> None:
    assert worst_partner(games({"MAPPO": FORCES["MAPPO"]}).query("known"))[0] == pytest.approx(22.5)


def test_who_has_the_smaller_force_in_every_episode_improves_with_certainty() -> None:
    made = games(FORCES).query("known and partner == 'tugging'")
    first, other = (made[made["label"] == label] for label in FORCES)
    assert improvement(first, other) == (1.0, 1.0, 1.0)
    assert improvement(first, first)[0] == pytest.approx(0.5)


def test_an_improvement_is_as_uncertain_as_the_trainings_of_either_side() -> None:
    made = games({"MAPPO": {"path": 0.0}}, trainings=3, episodes=20).query("known")
    first = made.assign(partner_force_p90=made["training"].map({"0": 0.1, "1": -0.1, "2": 0.6}))
    _, low, high = improvement(first, first.assign(partner_force_p90=0.0))
    assert (low, high) == (0.0, 1.0), "all three may be one of them"
    _, low, high = improvement(first, first)
    assert high - low > 0.6


def test_tables_tell_held_out_partners_and_unknown_goals_apart() -> None:
    found = {table.name: table for table in tables(games(FORCES), ("tugging",))}
    assert list(found) == ["skill", "skill_partners", "skill_tasks"]
    groups = dict.fromkeys(found["skill"].numbers["group"])
    assert list(groups) == [
        "both know the goal, partners of training",
        "only the human knows, partners of training",
        "both know the goal, held-out partners",
        "only the human knows, held-out partners",
    ]
    assert "| MAPPO | 2 | 12 | 12.5 (" in markdown(found["skill"])
    assert headline(games(FORCES))["follower/human_only/worst_partner"] == pytest.approx(52.5)
    assert len(figure(games(FORCES)).axes) == 4


def test_tables_by_mass_keep_partners_apart_and_compare_the_same_mass() -> None:
    light, heavy = games(FORCES), games(FORCES).assign(mass=8.0)
    heavy.loc[heavy["label"] == "MAPPO", "partner_force_p90"] += 100.0
    found = {table.name: table.numbers for table in tables(pd.concat([light, heavy]), ("tugging",))}
    loads = found["skill_loads"].set_index(["group", "label"])
    assert loads.loc[("lift_straight 4 kg", "follower"), "P"] == 1.0
    assert loads.loc[("lift_straight 8 kg", "follower"), "P"] == 0.0
    cells = found["skill_cells"].set_index(["group", "label"])
    force = cells.loc[("lift_straight 8 kg, tugging, only the human knows", "MAPPO"), "partner_force_p90"]
    assert force == pytest.approx(122.5)
    assert len(cells) == 2 * 2 * 2 * 2


def test_every_combination_is_planned_once_and_nobody_follows_a_follower(make) -> None:  # type: ignore[no-untyped-def]
    skill = make().setup.skill
    planned = planned_games(skill, learnt_human=True)
    kinds = (*skill.partners.training, *skill.partners.held_out, "agent")
    assert len(planned) == len(skill.tasks.names) * (2 * len(kinds) - 1) * skill.eval.episodes
    assert not [case for case in planned if case.partner == "follower" and not case.known]
    assert {case.mass for case in planned if case.task == "lift_straight"} == {15.5}
    named = planned_games(make(changes={"skill.eval.masses": {"lift": (0.5, 20.0)}}).setup.skill, learnt_human=False)
    masses = {task: {case.mass for case in named if case.task == task} for task in skill.tasks.names}
    assert masses["lift_slalom"] == {0.5, 20.0}
    assert masses["push_straight"] == {65.0}


def test_no_episode_is_planned_twice(make) -> None:  # type: ignore[no-untyped-def]
    """A task of one mass, with two loads; and a learnt human among the partners of training."""
    changes = {"skill.eval.loads": (0.0, 1.0), "skill.partners.training": ("path", "agent")}
    planned = planned_games(make(changes=changes).setup.skill, learnt_human=True)
    assert len({case.mass for case in planned if case.task == "tyre_straight"}) == 1
    assert len(planned) == len({(case.task, case.partner, case.known, case.mass, case.seed) for case in planned})


def test_all_competitors_play_the_same_episodes_and_finished_batches_are_kept(
    world: Specification, student: Student, tmp_path: Path
) -> None:
    settings = SkillEvaluation(games=1, seed=3)
    planned = [Plan("lift_straight", kind, False, mass=12.0, seed=3 + n) for n, kind in enumerate(("path", "agent"))]
    stop = False

    def played_by(competitor: Competitor) -> pd.DataFrame:
        asked = (settings, competitor, None, planned, (world, student))
        return pd.concat(play_batches(*asked, 0, tmp_path, lambda: stop))

    torch.manual_seed(0)
    with closing(TransportGame(world, student, n=1)) as game:
        size = game.observation_sizes["robot"]
    robot = TeacherNetwork(size, 11, [8], "elu", 5.0)
    own, rival = Competitor("MAPPO", "own", None, robot), Competitor("follower", "", "follow", None)
    played = {one.label: played_by(one) for one in (own, rival)}
    for rows in played.values():
        assert rows["partner"].tolist() == ["path", "agent"]
        assert rows["episode"].tolist() == [0, 1]
        np.testing.assert_allclose(rows["mass"], 12.0)
    assert not np.allclose(played["MAPPO"]["partner_force_p90"], played["follower"]["partner_force_p90"])
    stop = True
    pd.testing.assert_frame_equal(played_by(own), played["MAPPO"])
    with pytest.raises(Interrupted):
        played_by(Competitor("other", "", "lead", None))
    stop = False
    damaged = next(tmp_path.glob("MAPPO*.batch"))
    damaged.write_bytes(damaged.read_bytes()[:-1])
    pd.testing.assert_frame_equal(played_by(own), played["MAPPO"])
    assert damaged.with_name(f"{damaged.name}.damaged").is_file()
    with pytest.raises(StageFailed, match=f"observes 3 numbers, this game shows {size}"):
        played_by(Competitor("x", "", None, TeacherNetwork(3, 11, [8], "elu", 5.0)))
