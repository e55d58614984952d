"""The face of PettingZoo."""

import pytest

from iowbc.skill.lower_layer import Student
from iowbc.task.specification import Specification

pettingzoo = pytest.importorskip("pettingzoo", reason="the extra `games` is not installed")


@pytest.mark.filterwarnings("ignore")
def test_the_game_passes_pettingzoos_own_tests(world: Specification, student: Student) -> None:
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    from iowbc.skill.parallel_env import TransportEnv

    environment = TransportEnv(world, student)
    parallel_api_test(environment, num_cycles=30)
    parallel_seed_test(lambda: TransportEnv(world, student), num_cycles=5)
