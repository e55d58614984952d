"""A sweep is every combination of its values, each an ordinary recipe with a name of its own."""

import math
from pathlib import Path

import pytest

from iowbc.errors import RecipeError
from iowbc.recipe import sweep as reading
from iowbc.recipe.sweep import Sweep, load_sweep


@pytest.fixture
def recipe(tmp_path: Path) -> str:
    path = tmp_path / "small.yaml"
    path.write_text("seed: 3\nteacher:\n  steps: 4096\n")
    return str(path)


def described(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "wide.yaml"
    path.write_text(text)
    return path


def settings(sweep: Sweep) -> list[dict[str, object]]:
    return [dict(point.settings) for point in sweep.points]


def test_a_grid_is_every_combination_and_a_single_value_holds_for_all(recipe: str) -> None:
    sets = ["seed=0..2", "task.references.use_rg=true,false", "eval.trials=2"]
    sweep = load_sweep(recipe, sets)
    assert sweep.axes == ("seed", "task.references.use_rg")
    assert len(settings(sweep)) == 6
    assert settings(sweep)[1] == {"seed": 0, "task.references.use_rg": False}
    assert {point.loaded.recipe.eval.trials for point in sweep.points} == {2}
    assert [point.loaded.recipe.seed for point in sweep.points] == [0, 0, 1, 1, 2, 2]
    assert len({point.name for point in sweep.points}) == 6


def test_commas_within_brackets_separate_nothing(recipe: str) -> None:
    sweep = load_sweep(recipe, ["teacher.hidden=[64, 32],[128, 64]"])
    assert [point.loaded.recipe.teacher.hidden for point in sweep.points] == [(64, 32), (128, 64)]


def test_a_point_has_the_same_name_in_every_sweep_and_its_settings_can_be_typed(recipe: str) -> None:
    first = load_sweep(recipe, ["seed=0,1"]).points
    assert [point.name for point in first] == ["small-seed-0", "small-seed-1"]
    assert first[1].loaded.overrides == ("seed=1", "name=small-seed-1")
    wide = load_sweep(recipe, ["teacher.steps=100000,200000", "seed=0,1"]).points[0]
    again = load_sweep(recipe, ["teacher.steps=50000,100000", "seed=0,7"]).points[2]
    assert wide.name == again.name
    assert wide.name.startswith("small-steps-100000-seed-0-")


def test_settings_of_all_points_belong_to_the_names(recipe: str) -> None:
    sweeps = [load_sweep(recipe, ["seed=0,1", *more]) for more in ([], ["eval.trials=2"], ["eval.trials=3"])]
    assert len({sweep.name for sweep in sweeps} | {point.name for one in sweeps for point in one.points}) == 9
    silent = load_sweep(recipe, ["seed=0,1", "execution.track=false"])
    assert (silent.name, silent.points[0].name) == ("small-seed", "small-seed-0")


def test_two_paths_that_end_alike_give_different_names(recipe: str) -> None:
    one = load_sweep(recipe, ["teacher.learning_rate=0.001,0.002"]).points[0]
    other = load_sweep(recipe, ["distill.learning_rate=0.001,0.002"]).points[0]
    assert one.name != other.name


def test_draws_are_spread_over_orders_of_magnitude_and_more_of_them_keep_the_first(recipe: str, tmp_path: Path) -> None:
    text = "grid: {seed: [0..1]}\ndraws:\n  count: COUNT\n  seed: 4\n  values:\n"
    rate = "    teacher.learning_rate: {low: 1.0e-5, high: 1.0e-1, scale: log}\n"
    units = "    teacher.epochs: {low: 1, high: 9, whole: true}\n"
    few = load_sweep(recipe, [], described(tmp_path, text.replace("COUNT", "3") + rate))
    many = load_sweep(recipe, [], described(tmp_path, text.replace("COUNT", "40") + rate + units))
    assert few.name == "wide"
    assert len(few.points) == 6
    rates = [found["teacher.learning_rate"] for found in settings(many)]
    assert rates[:6] == [found["teacher.learning_rate"] for found in settings(few)]
    below = sum(math.log10(float(str(rate))) < -3 for rate in rates) / len(rates)
    assert 0.3 < below < 0.7, "half of a log-uniform draw lies below the middle in logarithms"
    assert all(isinstance(found["teacher.epochs"], int) for found in settings(many))


def test_equal_draws_are_one_point(recipe: str, tmp_path: Path) -> None:
    text = "draws: {count: 6, values: {teacher.epochs: {low: 1, high: 3, whole: true}}}\n"
    found = settings(load_sweep(recipe, [], described(tmp_path, text)))
    assert sorted(int(str(one["teacher.epochs"])) for one in found) == [1, 2, 3]


@pytest.mark.parametrize("values", ["3..3", "3,3"])
def test_values_that_are_one_hold_for_all_points(recipe: str, values: str) -> None:
    sweep = load_sweep(recipe, [f"seed={values}", "eval.trials=1,2"])
    assert sweep.axes == ("eval.trials",)
    assert {point.loaded.recipe.seed for point in sweep.points} == {3}


def test_integers_have_both_ends_and_the_command_line_goes_before_the_file(recipe: str, tmp_path: Path) -> None:
    file = described(tmp_path, "grid:\n  teacher.clip: [0.1, 0.2, 0.3]\n  seed: [5, 6]\n")
    sweep = load_sweep(recipe, ["seed=0..2"], file)
    assert [found["teacher.clip"] for found in settings(sweep)][::3] == [0.1, 0.2, 0.3]
    assert [found["seed"] for found in settings(sweep)][:3] == [0, 1, 2]
    fixed = load_sweep(recipe, ["seed=7"], file)
    assert fixed.axes == ("teacher.clip",)
    assert {point.loaded.recipe.seed for point in fixed.points} == {7}


def test_the_variants_of_a_recipe_of_recipes_are_an_axis(recipe: str, tmp_path: Path) -> None:
    (tmp_path / "other.yaml").write_text("extends: small.yaml\nteacher: {steps: 8192}\n")
    (tmp_path / "both.yaml").write_text("variants: [small, other]\n")
    sweep = load_sweep(str(tmp_path / "both.yaml"), ["seed=0,1"])
    assert sweep.axes == ("recipe", "seed")
    assert [point.name for point in sweep.points] == ["small-seed-0", "other-seed-0", "small-seed-1", "other-seed-1"]
    alone = load_sweep(str(tmp_path / "both.yaml"), [])
    assert [(point.name, point.loaded.overrides) for point in alone.points] == [("small", ()), ("other", ())]


@pytest.mark.parametrize(
    ("sets", "told"),
    [
        (["eval.trials=2"], "a sweep varies something"),
        (["seed=4..0"], "should read SMALLER..LARGER"),
        (["seed=0..99999999"], "integers at most"),
        (["name=a,b"], "decides no result"),
        (["execution.workers=1,2"], "decides no result"),
        (["seed=0..200", "eval.trials=1..200"], "40,200 points"),
        (["seed=0,x"], "key 'seed' = 'x'"),
        (["teacher={clip: 0.3},{clip: 0.4}", "teacher.clip=0.1,0.2"], "teacher.clip: is a part of teacher"),
        (["sede=0,1"], "did you mean 'seed'"),
    ],
)
def test_what_is_wrong_is_told_before_anything_runs(recipe: str, sets: list[str], told: str) -> None:
    with pytest.raises(RecipeError, match=r"(?s).*") as caught:
        load_sweep(recipe, sets)
    assert told in str(caught.value)


def test_points_are_counted_before_any_is_read_and_more_are_allowed_by_an_option(
    recipe: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    monkeypatch.setattr(reading, "_points", lambda word, fixed, settings: told.append("read") or [])
    with pytest.raises(RecipeError, match=r"10,000 points, more than 1,000; .* `iowbc sweep --points 10000`"):
        load_sweep(recipe, ["seed=0..9999"])
    assert told == []
    load_sweep(recipe, ["seed=0..1999"], most=2000)
    assert told == ["read"] * 2000


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("grids: {seed: [0, 1]}", "wide.yaml:1:1: key 'grids'"),
        ("grid: {seed: 3}", "key 'grid.seed' = 3: should be a valid list"),
        ("grid: {seed: []}", "key 'grid.seed' = []: List should have at least 1 item"),
        ("draws: {values: {seed: {low: 0, high: 5}}}", "lacks 'count'"),
        ("draws: {count: 2, values: {seed: {low: 0, high: 5, scale: log}}}", "a logarithmic scale begins above 0"),
        ("grid: {seed: !!python/object:os.system x}", "is not allowed"),
        ("[1, 2]", "a sweep is a mapping"),
        ("draws: {count: 2, values: {seed: {low: -1.0e+308, high: 1.0e+308}}}", "is too wide to draw from"),
        ("grid: {robot: [g1, /etc]}", "a sweep names a folder under robots/"),
    ],
)
def test_a_wrong_file_is_told_with_its_line(recipe: str, tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(RecipeError) as caught:
        load_sweep(recipe, [], described(tmp_path, text))
    assert told in str(caught.value)


def test_a_missing_file_of_a_sweep_is_not_taken_for_a_recipe(recipe: str, tmp_path: Path) -> None:
    with pytest.raises(RecipeError) as caught:
        load_sweep(recipe, [], tmp_path / "full")
    assert str(caught.value) == f"--from {tmp_path}/full: no such file"
