"""The feasible map: built from decisions, kept on disk, and used to clamp commands."""

from pathlib import Path

import numpy as np
import pytest

from iowbc.control.feasible_map import FeasibleMap, build_map

PITCHES = np.array([0.0, 0.5, 1.0, 1.5])
HEIGHTS = np.array([0.5, 0.6, 0.7, 0.8])
NOMINAL = (0.7, 0.5)
FEASIBLE = np.array([[0, 1, 1, 1], [1, 1, 1, 0], [1, 0, 1, 1], [0, 0, 0, 0]], dtype=bool)


@pytest.fixture
def region() -> FeasibleMap:
    return build_map(PITCHES, HEIGHTS, FEASIBLE, slope=10.0, nominal=NOMINAL)


def test_the_run_around_the_nominal_height_counts(region: FeasibleMap) -> None:
    np.testing.assert_array_equal(region.pitch, [0.0, 0.5, 1.0])
    np.testing.assert_allclose(region.low, [0.6, 0.5, 0.7])
    np.testing.assert_allclose(region.high, [0.8, 0.7, 0.8])


def test_commands_are_clamped_pitch_first(region: FeasibleMap) -> None:
    height, pitch = region.clamp(np.array([0.55, 0.9, 0.65, 0.62]), np.array([0.0, 0.5, 2.0, 0.25]))
    np.testing.assert_allclose(height, [0.6, 0.7, 0.7, 0.62])
    np.testing.assert_allclose(pitch, [0.0, 0.5, 1.0, 0.25])


def test_clamping_is_idempotent_and_keeps_what_is_inside(region: FeasibleMap) -> None:
    random = np.random.default_rng(0)
    once = region.clamp(random.uniform(0.3, 1.0, 200), random.uniform(-1.0, 2.0, 200))
    np.testing.assert_array_equal(region.clamp(*once), once)
    assert region.contains(*once).all()
    assert not region.contains(np.array([0.55]), np.array([0.0]))[0]


def test_a_map_ends_at_the_largest_pitch_that_is_asked_for(region: FeasibleMap) -> None:
    shorter = region.up_to(0.75)
    np.testing.assert_allclose(shorter.pitch, [0.0, 0.5, 0.75])
    np.testing.assert_allclose([shorter.low[-1], shorter.high[-1]], [0.6, 0.75])
    height, pitch = shorter.clamp(np.array([0.9]), np.array([1.0]))
    np.testing.assert_allclose([height[0], pitch[0]], [0.75, 0.75])
    assert region.up_to(None) is region
    assert region.up_to(2.0) is region


def test_a_longer_run_elsewhere_does_not_draw_the_map_from_the_nominal_command() -> None:
    """An island of refused heights splits one pitch; the part with the nominal height goes on, however short."""
    heights = np.linspace(0.5, 0.8, 7)
    rows = np.ones((4, 7), dtype=bool)
    rows[0, 4] = False
    region = build_map(PITCHES, heights, rows, slope=10.0, nominal=(0.78, 0.5))
    np.testing.assert_allclose(region.low, [0.75, 0.5, 0.5, 0.5])
    np.testing.assert_allclose(region.high, 0.8)


def test_bounds_change_no_faster_than_allowed() -> None:
    heights = np.linspace(0.5, 0.8, 7)
    rows = np.ones((4, 7), dtype=bool)
    rows[2, 4:] = False
    region = build_map(PITCHES, heights, rows, slope=0.2, nominal=NOMINAL)
    assert (np.abs(np.diff(region.high)) <= 0.2 * np.diff(region.pitch) + 1e-12).all()
    assert region.high[2] == pytest.approx(0.65)
    assert (region.high <= 0.8).all()


def test_an_empty_feasible_set_is_an_error() -> None:
    with pytest.raises(
        ValueError, match=r"the feasible set is empty: none of 16 commands with heights 0\.50 to 0\.80 m"
    ):
        build_map(PITCHES, HEIGHTS, np.zeros((4, 4), dtype=bool), slope=1.0, nominal=NOMINAL)


def test_the_map_comes_back_from_disk(region: FeasibleMap, tmp_path: Path) -> None:
    region.save(tmp_path / "feasible.npz")
    again = FeasibleMap.load(tmp_path / "feasible.npz")
    for name in ("pitch", "low", "high"):
        np.testing.assert_array_equal(getattr(again, name), getattr(region, name))


def test_a_missing_or_damaged_map_is_named(region: FeasibleMap, tmp_path: Path) -> None:
    path = tmp_path / "feasible.npz"
    with pytest.raises(FileNotFoundError, match=r"feasible\.npz: no feasible map; run `iowbc run"):
        FeasibleMap.load(path)
    region.save(path)
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(ValueError, match=r"feasible\.npz: not a feasible map"):
        FeasibleMap.load(path)
    FeasibleMap(region.pitch, region.high, region.low).save(path)
    with pytest.raises(ValueError, match="low not pass high"):
        FeasibleMap.load(path)
    FeasibleMap(region.pitch, region.low * np.nan, region.high).save(path)
    with pytest.raises(ValueError, match="not a feasible map"):
        FeasibleMap.load(path)
