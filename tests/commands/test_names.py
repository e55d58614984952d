"""One name means the same in every command and from Python."""

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from iowbc import open_artifact
from iowbc.commands import completion
from iowbc.commands.lookup import named
from iowbc.commands.playable import playable
from iowbc.deploy.exported_folder import exported_folder
from iowbc.errors import ContractBroken
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store

Command = Callable[..., "subprocess.CompletedProcess[str]"]
Key = Callable[[str, str], str]


def forget(folder: Path) -> None:
    """Remove all but what is published."""
    for name in ("store", "recipes", "first", "second"):
        shutil.rmtree(folder / "runs" / name)


@pytest.mark.parametrize("word", ["first", "first.yaml"])
def test_a_recipe_and_its_stages_are_named_alike_everywhere(folder: Path, command: Command, word: str) -> None:
    (folder / "recipes").mkdir()
    shutil.copy(folder / "first.yaml", folder / "recipes" / "first.yaml")
    assert "all stages are cached" in command("plan", word).stdout
    assert "teacher" in command("show", word).stdout
    assert "attempt" in command("show", f"{word}/teacher").stdout
    assert command("diff", word, "first").stdout == "no difference\n"


def test_a_file_means_the_recipe_that_it_names(folder: Path, command: Command) -> None:
    (folder / "another.yaml").write_text("extends: first.yaml\nname: first\n")
    assert "teacher" in command("show", "another.yaml").stdout


def test_links_lead_by_name_to_what_a_recipe_has(folder: Path, command: Command, key: Key) -> None:
    link = folder / "runs" / "first" / "teacher"
    assert link.resolve().name == key("first", "teacher")
    assert command("run", "first.yaml", "--set", "seed=4").returncode == 0
    assert link.resolve().name == key("first", "teacher")
    assert command("gc", "--recipe", "second").returncode == 0
    assert not (folder / "runs" / "second" / "teacher").is_symlink()
    assert all(path.exists() for path in (folder / "runs" / "second").glob("*"))


def test_a_recipe_that_is_named_like_a_part_of_runs_has_no_links(folder: Path, command: Command) -> None:
    (folder / "store.yaml").write_text("extends: first.yaml\n")
    assert command("run", "store.yaml").returncode == 0
    assert {path.name for path in (folder / "runs" / "store").iterdir()} >= {"teacher", "export"}
    assert not any(path.is_symlink() for path in (folder / "runs" / "store").iterdir())


def test_a_recipe_runs_although_a_link_stands_where_its_links_would(folder: Path, command: Command) -> None:
    shutil.rmtree(folder / "runs" / "first")
    (folder / "runs" / "first").symlink_to("nowhere")
    assert command("run", "first.yaml").returncode == 0


def test_what_is_published_goes_by_its_recipes_name_before_anything_ran(
    folder: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert command("publish", "first.yaml").returncode == 0
    forget(folder)
    assert "teacher" in command("show", "first").stdout
    assert "did you mean 'first'?" in command("show", "frist").stderr
    assert "first (published)" in command("ls").stdout
    monkeypatch.chdir(folder)
    assert completion.ran("") == ["first"]
    assert completion.artifacts("first/t") == ["first/teacher"]
    assert open_artifact("first/export", folder / "runs").published


def test_what_was_published_for_another_recipe_is_found_by_each_that_used_it(folder: Path, command: Command) -> None:
    for name in ("first", "second"):
        assert command("publish", f"{name}.yaml").returncode == 0
    forget(folder)
    store = Store(Runs(folder / "runs"))
    found, own = named(store, "second"), [one for one in store.artifacts() if one.manifest.recipe == "second"]
    assert [*found.artifacts] == ["rg-dataset", "rg-fit", "teacher", "distill", "export"]
    assert 0 < len(own) < len(found.artifacts)
    assert found.recipe == own[-1].recipe


def test_a_run_that_has_begun_does_not_hide_what_is_published_until_it_has_its_own(
    folder: Path, command: Command, key: Key
) -> None:
    assert command("publish", "first.yaml").returncode == 0
    forget(folder)
    (folder / "first.yaml").write_text("seed: 5\nexecution: {track: false}\n")
    assert command("run", "first.yaml", "--until", "teacher").returncode == 0
    store = Store(Runs(folder / "runs"))
    shipped = open_artifact("first/export", folder / "runs")
    assert shipped.published
    assert playable(store, "first", None) == shipped
    assert playable(store, "first", "export") == shipped
    assert playable(store, "first", "teacher").manifest.key == key("first", "teacher")
    assert [*named(store, "first").artifacts] == ["rg-dataset", "rg-fit", "teacher"], "those of this run alone"
    assert command("run", "first.yaml").returncode == 0
    assert playable(store, "first", None).manifest.key == key("first", "export")
    assert not playable(store, "first", None).published


def test_what_is_published_and_would_be_used_next_belongs_to_a_run_that_ended_early(
    folder: Path, command: Command
) -> None:
    assert command("publish", "first.yaml").returncode == 0
    forget(folder)
    assert command("run", "first.yaml", "--until", "rg-fit").returncode == 0
    assert "attempt" in command("show", "first/export").stdout
    assert "export" in command("show", "first").stdout


def test_a_local_copy_of_what_is_published_is_found_by_the_same_name(folder: Path, command: Command) -> None:
    assert command("publish", "second.yaml").returncode == 0
    for name in ("recipes", "first", "second"):
        shutil.rmtree(folder / "runs" / name)
    found = named(Store(Runs(folder / "runs")), "second").artifacts
    assert {"rg-dataset", "rg-fit", "teacher", "distill", "export"} <= found.keys()
    assert not any(artifact.published for artifact in found.values())


def test_a_run_with_overrides_neither_takes_a_published_name_nor_is_mixed_with_others(
    folder: Path, command: Command
) -> None:
    assert command("publish", "first.yaml").returncode == 0
    forget(folder)
    store = Store(Runs(folder / "runs"))
    assert command("run", "first.yaml", "--until", "teacher", "--set", "teacher.steps=9999").returncode == 0
    assert all(artifact.published for artifact in named(store, "first").artifacts.values())
    assert [*named(store, "first").artifacts][-1] == "export"
    assert [path.name.partition("-")[0] for path in (folder / "runs" / "first").glob("teacher*")] == ["teacher"]
    assert not (folder / "runs" / "first" / "teacher").exists()
    for words in (("status",), ("ls",), ("show", "first"), ("gc", "--unused", "--dry-run")):
        assert command(*words).returncode == 0, words
    assert re.search(r"\nfirst +[\d.]+ \w+ ago *\n$", command("status").stdout), "used, but no stage of its own"


def test_a_plain_run_begins_anew_where_one_with_overrides_had_the_name(folder: Path, command: Command) -> None:
    assert command("run", "second.yaml", "--set", "name=third", "--set", "seed=8").returncode == 0
    store = Store(Runs(folder / "runs"))
    assert [*named(store, "third").artifacts][-1] == "export"
    assert command("run", "second.yaml", "--set", "name=third", "--until", "rg-fit").returncode == 0
    assert [*named(store, "third").artifacts] == ["rg-dataset", "rg-fit"]
    assert sorted(path.name for path in (folder / "runs" / "third").iterdir()) == ["rg-dataset", "rg-fit"]


def test_the_controller_is_found_by_its_recipes_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    export = tmp_path / "runs" / "mine" / "export"
    export.mkdir(parents=True)
    (export / "contract.json").write_text(json.dumps({}))
    monkeypatch.chdir(tmp_path)
    assert exported_folder("mine") == Path("runs/mine/export")
    with pytest.raises(ContractBroken, match=r"nothing: neither an export folder nor .* those with one: mine$"):
        exported_folder("nothing")
    shipped = Path("runs/published/export/0123")
    shipped.mkdir(parents=True)
    (shipped / "contract.json").write_text("{}")
    for text in ("", "[]", '{"name": 3}'):
        (shipped / "recipe.json").write_text(text)
        with pytest.raises(ContractBroken, match=r"those with one: mine$"):
            exported_folder("shipped")
    (shipped / "recipe.json").write_text('{"name": "shipped"}')
    assert exported_folder("shipped") == shipped
    (shipped / "recipe.json").write_text('{"name": "mine"}')
    assert exported_folder("mine") == Path("runs/mine/export"), "what was made here comes first"
    assert exported_folder("mine/export") == Path("runs/mine/export")
    assert exported_folder("0123") == shipped, "a key"
    with pytest.raises(ContractBroken, match="012: neither an export folder nor"):
        exported_folder("012")  # too few characters of a key
    for key in ("0123aa", "4567aa"):
        stored = Path("runs/store/export", key)
        stored.mkdir(parents=True)
        (stored / "contract.json").write_text("{}")
    assert exported_folder("4567") == stored
    with pytest.raises(ContractBroken, match="2 exports begin like that"):
        exported_folder("0123")
    monkeypatch.setenv("IOWBC_RUNS", str(tmp_path / "runs"))
    monkeypatch.chdir("/")
    assert exported_folder("mine") == export


def test_init_goes_on_with_what_was_cut_short_and_follows_no_link(folder: Path, command: Command) -> None:
    assert command("init", "whole").returncode == 0
    for name in ("recipes/full.yaml", "robots/g1"):
        path = folder / "whole" / name
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    done = command("init", "whole")
    assert (done.returncode, done.stdout.count("whole/")) == (0, 2)
    assert not list((folder / "whole").rglob(".*"))
    (folder / "linked" / "recipes").mkdir(parents=True)
    (folder / "linked" / "recipes" / "full.yaml").symlink_to(folder / "elsewhere.yaml")
    refused = command("init", "linked")
    assert refused.returncode == 2
    assert "linked/recipes/full.yaml: a link leads elsewhere" in refused.stderr
    assert not (folder / "elsewhere.yaml").exists()
    assert not (folder / "linked" / "robots").exists()


def test_init_copies_recipes_and_a_robot_and_replaces_nothing(folder: Path, command: Command) -> None:
    done = command("init", "mine")
    assert done.returncode == 0, done.stderr
    assert (folder / "mine" / "recipes" / "quickstart.yaml").is_file()
    assert (folder / "mine" / "robots" / "g1" / "robot.yaml").is_file()
    again = command("init", "mine")
    assert again.returncode == 2
    assert "there already" in again.stderr
    assert "no robot 'r2d2'" in command("init", "other", "--robot", "r2d2").stderr
