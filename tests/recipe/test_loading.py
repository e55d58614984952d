"""Recipes inherit, are overridden, and say what is wrong with them and where."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml
from function_calls import function_calls

from iowbc.errors import RecipeError
from iowbc.pipeline.store.runs import read_yaml
from iowbc.recipe.reading.document import as_yaml
from iowbc.recipe.reading.loading import LoadedRecipe, load_recipe
from iowbc.recipe.reading.study import load_study
from iowbc.recipe.simulation.simulation import SimulationSettings

RECIPES = Path(__file__).parents[2] / "recipes"


def write(folder: Path, text: str, name: str = "mine.yaml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def problems(folder: Path, text: str, *overrides: str) -> list[str]:
    with pytest.raises(RecipeError) as caught:
        load_recipe(write(folder, text), overrides)
    return [str(problem).removeprefix(f"{folder}/") for problem in caught.value.problems]


def loaded(folder: Path, text: str, *overrides: str) -> LoadedRecipe:
    return load_recipe(write(folder, text), overrides)


@pytest.mark.parametrize("path", sorted(RECIPES.glob("*.yaml")), ids=lambda path: path.stem)
def test_a_shipped_recipe_is_valid(path: Path) -> None:
    assert load_study(path) or load_recipe(path).recipe.name


def test_an_empty_recipe_is_refused(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "# nothing yet\n")
    assert text.startswith("mine.yaml:1:1: is empty")


def test_thousands_of_problems_are_counted(tmp_path: Path) -> None:
    before = time.process_time()
    for line in ("key_{}: 1\n", "seed: {}\n"):
        with pytest.raises(RecipeError, match=r"and 19,9[45][0-9] more problems") as caught:
            load_recipe(write(tmp_path, "".join(map(line.format, range(20_000)))))
        assert len(str(caught.value).splitlines()) == 51
    assert time.process_time() - before < 20.0


def test_what_is_no_file_of_a_recipes_size_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    with pytest.raises(RecipeError, match="is no regular file"):
        load_recipe(tmp_path / "pipe.yaml")
    (text,) = problems(tmp_path, "#" * 1_000_001)
    assert "has 1,000,001 bytes" in text


@pytest.mark.parametrize(
    "line",
    [
        "teacher: {environments: 1000000000}",
        "teacher: {steps: 1e300}",
        "teacher: {environments: 100000, rollout: 10000}",
        "teacher: {hidden: [1000000000]}",
        "teacher: {clip: 1e13}",
        "distill: {buffer: 1000000000000}",
        "rg: {fit: {hidden: [64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64]}}",
        "rg: {feasible: {heights: 1000000}}",
        "execution: {workers: 1000000}",
        "seed: " + "9" * 5000,
        "export: {golden_steps: 1}",
        "seed: 0x" + "f" * 5000,
    ],
)
def test_absurd_sizes_are_refused_before_anything_runs(tmp_path: Path, line: str) -> None:
    (text,) = problems(tmp_path, f"description: too large\n{line}\n")
    assert text.startswith("mine.yaml:2:")
    assert len(text) < 300


def test_a_tab_is_named(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "teacher:\n\tsteps: 3\n")
    assert text == "mine.yaml:2:1: not valid YAML: a tab; indent with spaces"


def test_a_batch_that_the_buffer_never_holds_is_refused(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "distill: {batch: 64, buffer: 32}\n")
    assert "batch (64) is larger than buffer (32)" in text


def test_a_recipe_with_one_line_is_all_defaults_under_its_files_name(tmp_path: Path) -> None:
    recipe = loaded(tmp_path, "description: none\n").recipe
    assert recipe.name == "mine"
    assert recipe.stages[0] == "rg-dataset"


@pytest.mark.parametrize("name", ["1e3", "12", "0o17", "0x1f", "1_000", "null", "true", "on", "2026-01-01"])
def test_a_name_that_reads_as_something_else_is_text_wherever_it_is_read_again(tmp_path: Path, name: str) -> None:
    recipe = load_recipe(write(tmp_path, "seed: 1\n", f"{name}.yaml")).recipe
    kept = write(tmp_path, as_yaml(recipe))
    assert read_yaml(kept)["name"] == name
    assert yaml.safe_load(kept.read_text())["name"] == name
    assert load_recipe(kept).recipe == recipe


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("teacher: {start: full}", "should be a recipe file, as in full.yaml, or the first characters (8 or more)"),
        ("eval: {lifting: {masses: [-4]}}", "'eval.lifting.masses.0' = -4: should be greater than or equal to 0"),
        ("extends: ''", "key 'extends': should be the name of one recipe file"),
        ("teacher: {hidden: []}", "'teacher.hidden' = []: Tuple should have at least 1 item"),
    ],
)
def test_a_wrong_value_is_told_once_with_what_is_valid(tmp_path: Path, line: str, expected: str) -> None:
    (text,) = problems(tmp_path, f"{line}\n")
    assert expected in text


def test_feedback_on_the_feet_of_a_gait_prior_that_is_off_is_refused(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "task: {references: {gait: {enabled: false, placement: {}}}}\n")
    assert "placement: moves the feet of the gait prior, which is off" in text
    (text,) = problems(tmp_path, "task: {references: {gait: {enabled: false}, height: {}}}\n")
    assert "height: stretches the legs of the gait prior, which is off" in text


def test_a_controller_that_follows_the_pelvis_is_commanded_no_centre_of_mass(tmp_path: Path) -> None:
    (found,) = problems(tmp_path, "rg: {height: com}\neval: {policy: model}\n")
    assert "'rg.height' = 'com': com commands the centre of mass; eval.policy: model follows the pelvis" in found


def test_a_controller_that_sets_joint_targets_itself_follows_no_previous_action(tmp_path: Path) -> None:
    (found,) = problems(tmp_path, "task: {action: {previous_share: 0.5}}\neval: {policy: model}\n")
    assert "task.action.previous_share" in found
    assert "eval.policy: model" in found


def test_a_number_where_text_belongs_is_asked_for_in_quotes(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "name: 1e3\n")
    assert text == "mine.yaml:1:1: key 'name' = 1000.0: should be text; in quotes, a word that reads as a number is"
    assert loaded(tmp_path, "seed: 1\n", 'name="1e3"').recipe.name == "1e3"


def test_a_name_that_is_none_is_told_what_it_may_hold(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "name: Größe\n")
    assert "key 'name' = 'Größe': should be lower-case letters, digits, `-` and `_`" in text


def test_a_misspelt_key_names_place_value_valid_keys_and_the_nearest(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "seed: 1\nteacher:\n  leaning_rate: 0.1\n")
    assert text.startswith("mine.yaml:3:3: key 'teacher.leaning_rate' = 0.1: is not a key of 'teacher'; valid: ")
    assert text.endswith("did you mean 'learning_rate'?")


def test_a_key_in_the_wrong_section_names_the_right_one(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "average_half_life: 9\n")
    assert text.endswith("did you mean 'teacher.average_half_life'?")


def test_all_problems_are_listed_with_their_lines(tmp_path: Path) -> None:
    texts = problems(tmp_path, "seed: -1\nteacher:\n  gamma: high\n  steps: 1.5\nrobots: g1\n")
    assert [text.split(": ")[0] for text in texts] == [
        "mine.yaml:1:1",
        "mine.yaml:3:3",
        "mine.yaml:4:3",
        "mine.yaml:5:1",
    ]
    assert "key 'teacher.gamma' = 'high': should be a valid number" in texts[1]


def test_a_wrong_choice_names_the_valid_ones_and_the_nearest(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "stages: [rg-dataset, teachr]\n")
    assert text.startswith("mine.yaml:1:22: key 'stages.1' = 'teachr'")
    assert text.endswith("did you mean 'teacher'?")


def test_true_is_not_a_number(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "seed: 1\nteacher:\n  clip: true\n")
    assert text == "mine.yaml:3:3: key 'teacher.clip' = True: should be a number, not true or false"


def test_infinity_is_refused(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "teacher:\n  learning_rate: .inf\n")
    assert "finite" in text


def test_stages_run_in_the_pipelines_order(tmp_path: Path) -> None:
    assert loaded(tmp_path, "stages: [teacher, rg-fit, rg-dataset]\n").recipe.stages == (
        "rg-dataset",
        "rg-fit",
        "teacher",
    )


def test_a_recipe_changes_what_it_extends_key_by_key(tmp_path: Path) -> None:
    write(tmp_path, "name: base\nseed: 4\nteacher:\n  gamma: 0.9\n  steps: 4096\n", "base.yaml")
    found = loaded(tmp_path, "extends: base.yaml\nteacher:\n  steps: 8192\n")
    assert (found.recipe.seed, found.recipe.teacher.gamma, found.recipe.teacher.steps) == (4, 0.9, 8192)
    assert found.recipe.name == "mine"
    assert found.place("teacher.steps") == f"{tmp_path}/mine.yaml:3:3"
    assert found.place("teacher.gamma") == f"{tmp_path}/base.yaml:4:3"
    assert found.place("teacher.clip") == "default"


def test_a_section_that_is_off_by_default_may_hold_any_part_of_its_keys(tmp_path: Path) -> None:
    file = tmp_path / "one.yaml"
    file.write_text("eval: {simulation: {partner: {share: {probability: 0.5}}}}\n")
    world = load_recipe(file).recipe.eval.simulation
    usual = SimulationSettings()
    assert world is not None
    assert world.partner.share == usual.partner.share.model_copy(update={"probability": 0.5})
    assert world.model_dump(exclude={"partner"}) == usual.model_dump(exclude={"partner"})


def test_a_recipe_of_ones_own_extends_one_of_the_package_by_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shipped = load_recipe("quickstart").recipe.teacher.steps
    for word in ("quickstart.yaml", "quickstart"):
        assert load_recipe(write(tmp_path, f"extends: {word}\n")).recipe.teacher.steps == shipped
    (text,) = problems(tmp_path, "extends: quikstart.yaml\n")
    assert "recipes by name: blind, " in text
    assert text.endswith("did you mean 'quickstart.yaml'?")
    write(tmp_path, "teacher: {steps: 4096}\n", "quickstart.yaml")
    assert load_recipe(write(tmp_path, "extends: quickstart.yaml\n")).recipe.teacher.steps == 4096


def test_an_error_in_an_inherited_file_names_that_file(tmp_path: Path) -> None:
    write(tmp_path, "seed: none\n", "base.yaml")
    (text,) = problems(tmp_path, "extends: base.yaml\n")
    assert text.startswith("base.yaml:1:1: key 'seed' = 'none'")


def test_recipes_that_extend_each_other_in_a_circle_are_refused(tmp_path: Path) -> None:
    write(tmp_path, "extends: mine.yaml\n", "other.yaml")
    (text,) = problems(tmp_path, "extends: other.yaml\n")
    assert "in a circle" in text


def test_a_chain_of_recipes_has_an_end(tmp_path: Path) -> None:
    for number in range(1000):
        write(tmp_path, f"extends: {number + 1}.yaml\n", f"{number}.yaml")
    (text,) = problems(tmp_path, "extends: 0.yaml\n")
    assert "which extends another, and so on more than 20 times" in text


def test_a_recipe_names_a_known_robot_and_the_command_line_any_folder(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "robot: ../elsewhere\n")
    assert text.startswith("mine.yaml:1:1: key 'robot' = '../elsewhere': a recipe names a folder under robots/")
    assert loaded(tmp_path, "seed: 1\n", "robot=../elsewhere").recipe.robot == "../elsewhere"


def test_a_missing_file_lists_the_recipes_beside_it(tmp_path: Path) -> None:
    write(tmp_path, "seed: 1\n", "full.yaml")
    with pytest.raises(RecipeError, match=r"no such file; recipes in .*: full.yaml; .*did you mean 'full.yaml'\?"):
        load_recipe(tmp_path / "ful.yaml")


def test_a_recipe_is_found_by_its_name_here_first_then_in_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert load_recipe("quickstart").recipe.name == "quickstart"
    (tmp_path / "recipes").mkdir()
    write(tmp_path / "recipes", "seed: 77\n", "quickstart.yaml")
    assert load_recipe("quickstart").recipe.seed == 77
    with pytest.raises(RecipeError, match=r"^recipe quikstart: no .*by name: quickstart, .*did you mean 'quickstart'"):
        load_recipe("quikstart")
    assert load_recipe("smoke.yaml").recipe.name == "smoke"
    assert load_recipe("experts/quick").recipe.name == "quick"
    with pytest.raises(RecipeError, match=r"^recipe experts/quikc: .*by name: experts/.*did you mean 'experts/quick'"):
        load_recipe("experts/quikc")


def test_an_override_goes_before_the_file_and_is_its_own_place(tmp_path: Path) -> None:
    found = loaded(tmp_path, "teacher:\n  steps: 4096\n", "teacher.steps=1e4", "seed=7")
    assert (found.recipe.teacher.steps, found.recipe.seed) == (10000, 7)
    assert found.place("teacher.steps") == "--set teacher.steps=1e4"


def test_an_override_reaches_into_a_list_that_is_a_default(tmp_path: Path) -> None:
    acceptance = loaded(tmp_path, "seed: 1\n", "export.acceptance.0.sequence.0.duration=1.25").recipe.export.acceptance
    (segment,) = acceptance[0].sequence
    assert (segment.duration, segment.ramp) == (1.25, 0.0)


def test_a_wrong_override_is_told_like_a_wrong_line(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, "seed: 1\n", "teacher.step=5")
    assert text.startswith("--set teacher.step=5: key 'teacher.step' = 5: is not a key of 'teacher'")
    (text,) = problems(tmp_path, "seed: 1\n", "teacher.steps")
    assert "should read a.b.c=value" in text
    (text,) = problems(tmp_path, "seed: 1\n", "task.reward.sync.height=2")
    assert text.endswith("= 2: should be a section, with any of the keys weight, width")
    (text,) = problems(tmp_path, "seed: 1\n", "seed=0..4")
    assert text.endswith("'0..4': should be a valid integer; several values are for `iowbc sweep`")
    (text,) = problems(tmp_path, "stages: [teacher]\n", "stages.3=eval")
    assert text == "--set stages.3=eval: '3' is not an index of 'stages'; valid: 0 to 0"


def test_a_recipe_is_validated_fast_and_without_heavy_imports(tmp_path: Path) -> None:
    script = tmp_path / "validate.py"
    script.write_text(
        "import sys; from iowbc.recipe.reading.loading import load_recipe; load_recipe(sys.argv[1]);"
        "print([m for m in ('torch', 'mujoco', 'mlflow', 'numpy', 'pandas', 'pinocchio') if m in sys.modules])"
    )
    path = write(tmp_path, "teacher:\n  steps: 4096\n")
    done = subprocess.run([sys.executable, script, path], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert function_calls(str(script), str(path)) < 550_000
