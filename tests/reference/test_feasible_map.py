"""The feasible map: what it clamps, how it is measured, and how it is kept."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iowbc.reference.dataset import Dataset
from iowbc.reference.feasibility import FeasibleMap, build_map
from iowbc.stages.contract import Job

PITCHES, HEIGHTS = np.linspace(-0.2, 0.4, 7), np.linspace(0.5, 0.8, 7)
STEEP = 100.0


def grid(*runs: tuple[int, int] | None) -> Any:
    """Decisions (pitches, heights) with one run of heights, first and last place, at each pitch."""
    feasible = np.zeros((len(PITCHES), len(HEIGHTS)), dtype=bool)
    for row, run in enumerate(runs):
        if run is not None:
            feasible[row, run[0] : run[1] + 1] = True
    return feasible


def test_a_command_inside_is_left_alone_and_one_outside_goes_to_the_nearest_height() -> None:
    region = build_map(PITCHES, HEIGHTS, grid(*[(1, 4)] * 7), STEEP)
    height, pitch = region.clamp(np.array([0.6, 0.9, 0.1]), np.array([0.0, 0.1, 0.2]))
    np.testing.assert_allclose(height, [0.6, 0.7, 0.55])
    np.testing.assert_allclose(pitch, [0.0, 0.1, 0.2])
    assert region.contains(np.array([0.6, 0.9]), np.array([0.0, 0.1])).tolist() == [True, False]


def test_pitches_beyond_the_map_are_clamped_before_the_height() -> None:
    region = build_map(PITCHES, HEIGHTS, grid((0, 6), (0, 6), (0, 6), (0, 6), (2, 4), None, None), STEEP)
    height, pitch = region.clamp(np.array([0.8]), np.array([1.0]))
    np.testing.assert_allclose([height[0], pitch[0]], [HEIGHTS[4], PITCHES[4]])


def test_clamping_twice_changes_nothing_and_ends_inside() -> None:
    region = build_map(PITCHES, HEIGHTS, grid((3, 6), (2, 6), (1, 5), (0, 5), (0, 4), (1, 3), None), 0.5)
    random = np.random.default_rng(0)
    once = region.clamp(random.uniform(0.3, 1.0, 500), random.uniform(-1.0, 1.0, 500))
    np.testing.assert_array_equal(region.clamp(*once), once)
    assert region.contains(*once).all()


def test_a_gap_in_the_heights_leaves_the_longer_part() -> None:
    feasible = grid(*[(0, 1)] * 7) | grid(*[(3, 6)] * 7)
    region = build_map(PITCHES, HEIGHTS, feasible, STEEP)
    assert region.low[0] == HEIGHTS[3]
    assert region.high[0] == HEIGHTS[6]


def test_the_bounds_change_no_faster_with_pitch_than_asked() -> None:
    region = build_map(PITCHES, HEIGHTS, grid((0, 6), (0, 6), (0, 6), (3, 5), (0, 6), (0, 6), (0, 6)), 0.5)
    for bound in (region.low, region.high):
        assert np.abs(np.diff(bound) / np.diff(region.pitch)).max() <= 0.5 + 1e-9
    assert (region.low >= HEIGHTS[0]).all()
    assert (region.high <= HEIGHTS[6]).all()


def test_an_empty_set_is_an_error_that_says_what_to_widen() -> None:
    with pytest.raises(ValueError, match=r"feasible set is empty.*widen rg\.sampling"):
        build_map(PITCHES, HEIGHTS, grid(*[None] * 7), STEEP)


def test_a_map_survives_the_disk(tmp_path: Path) -> None:
    region = build_map(PITCHES, HEIGHTS, grid(*[(1, 4)] * 7), STEEP)
    region.save(tmp_path / "feasible.npz")
    again = FeasibleMap.load(tmp_path / "feasible.npz")
    np.testing.assert_array_equal([again.pitch, again.low, again.high], [region.pitch, region.low, region.high])


def test_a_damaged_or_missing_map_is_an_error_with_the_command_that_remakes_it(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="--until rg-fit"):
        FeasibleMap.load(tmp_path / "feasible.npz")
    (tmp_path / "feasible.npz").write_bytes(b"PK\x03\x04 not really")
    with pytest.raises(ValueError, match="--force rg-dataset"):
        FeasibleMap.load(tmp_path / "feasible.npz")
    FeasibleMap(PITCHES, np.full(7, 0.7), np.full(7, 0.6)).save(tmp_path / "feasible.npz")
    with pytest.raises(ValueError, match="low not pass high"):
        FeasibleMap.load(tmp_path / "feasible.npz")


def test_commands_in_the_measured_map_have_labels_around_them(dataset_job: Job) -> None:
    dataset = Dataset.load(dataset_job.out / "dataset.npz")
    region = FeasibleMap.load(dataset_job.out / "feasible.npz")
    told = dataset.rejected_reason != "arms collide"
    rejected = region.contains(dataset.rejected_command[told, 0], dataset.rejected_command[told, 1]).sum()
    kept = region.contains(dataset.command[:, 0], dataset.command[:, 1]).sum()
    assert kept > 100
    assert rejected < 0.25 * kept
