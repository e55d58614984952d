from pathlib import Path

import numpy as np
import pytest
import torch

from iowbc.errors import StageFailed
from iowbc.learning.acting import StudentPolicy, load_policy
from iowbc.learning.networks import StudentNetwork
from iowbc.learning.storage import load_network, save_network

ARCHITECTURE = {
    "observation": 3,
    "history": 4,
    "actions": 2,
    "frame_features": 5,
    "latent": 6,
    "hidden": [7],
    "activation": "elu",
    "clip": 10.0,
}


def test_a_network_is_read_back_with_its_normalisation(tmp_path: Path) -> None:
    network = StudentNetwork(**ARCHITECTURE)  # type: ignore[arg-type]
    network.normalizer.mean.uniform_()
    save_network(network, ARCHITECTURE, tmp_path, "student", {})
    again, _ = load_network(tmp_path)
    x = torch.randn(5, 4, 3)
    torch.testing.assert_close(again(x), network(x), rtol=0, atol=0)


def test_a_missing_network_names_the_path_and_what_is_there(tmp_path: Path) -> None:
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(FileNotFoundError, match=r"student\.json.*other\.json"):
        load_policy(tmp_path)


def parts(**sizes: int) -> list[dict[str, object]]:
    return [{"name": name, "size": size} for name, size in sizes.items()]


def test_a_student_is_refused_where_it_would_observe_something_else(tmp_path: Path) -> None:
    about = {"layout": {"observation": parts(tilt=1, joints=2), "privileged": []}}
    save_network(StudentNetwork(**ARCHITECTURE), ARCHITECTURE, tmp_path, "student", about)  # type: ignore[arg-type]
    load_policy(tmp_path, {"observation": parts(tilt=1, joints=2, box=4), "privileged": parts(mass=1)})
    with pytest.raises(StageFailed, match=r"what differs: joints \(2\), torque \(2\)"):
        load_policy(tmp_path, {"observation": parts(tilt=1, torque=2, joints=2), "privileged": []})
    with pytest.raises(StageFailed, match="their order"):
        load_policy(tmp_path, {"observation": parts(joints=2, tilt=1), "privileged": []})


def test_after_a_reset_the_student_forgets_what_it_saw(tmp_path: Path) -> None:
    save_network(StudentNetwork(**ARCHITECTURE), ARCHITECTURE, tmp_path, "student", {})  # type: ignore[arg-type]
    policy = load_policy(tmp_path)
    assert isinstance(policy, StudentPolicy)
    nothing = np.zeros((2, 0), np.float32)
    x = np.ones((2, 3), np.float32)
    fresh = policy.act(x, nothing)
    policy.act(5 * x, nothing)
    policy.reset(np.array([True, False]))
    later = policy.act(x, nothing)
    np.testing.assert_array_equal(later[0], fresh[0])
    assert not np.allclose(later[1], fresh[1])
