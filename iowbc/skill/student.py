"""The frozen controller below the skill: a distilled student in NumPy."""

from dataclasses import dataclass
from pathlib import Path

from iowbc.errors import StageFailed
from iowbc.rollouts.policies import HistoryPolicy


@dataclass(frozen=True)
class Student:
    """A student and the length of its history."""

    policy: HistoryPolicy
    history: int
    """Observations in H_t."""
    observation: int
    """Size of the part of s_t that it sees."""


def load_student(folder: Path) -> Student:
    """The student in the artifact of `distill`. Raises StageFailed for a policy that is none."""
    from iowbc.learning.as_numpy import student_policy
    from iowbc.learning.networks import StudentNetwork
    from iowbc.learning.storage import load_network

    network, about = load_network(folder)
    if not isinstance(network, StudentNetwork):
        raise StageFailed(f"{folder} holds no student; name an artifact of the stage `distill`")
    return Student(student_policy(network), int(about["architecture"]["history"]), network.observation)
