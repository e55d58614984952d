"""A folder that cannot be written is refused before work begins, with the reason and the remedy."""

from pathlib import Path

import pytest

from iowbc.errors import UsageError
from iowbc.pipeline.store import runs as folders
from iowbc.pipeline.store.runs import Runs, require_writable, require_writable_runs


def test_a_missing_folder_is_made_and_nothing_is_left_in_it(tmp_path: Path) -> None:
    require_writable_runs(Runs(tmp_path / "new" / "runs"))
    assert list((tmp_path / "new" / "runs").iterdir()) == []


def test_a_file_in_its_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match=r"/file is not a folder; give another folder with --runs"):
        require_writable_runs(Runs(tmp_path / "file"))


def test_a_file_above_it_or_in_place_of_a_part_is_refused(tmp_path: Path) -> None:
    (tmp_path / "store").write_text("")
    for root in (tmp_path, tmp_path / "store" / "below"):
        with pytest.raises(UsageError, match=r"cannot be written: .*ot a (folder|directory)"):
            require_writable_runs(Runs(root))


def test_a_link_that_leads_nowhere_is_named_with_its_target(tmp_path: Path) -> None:
    (tmp_path / "work").symlink_to("/disk/that/is/not/mounted")
    for root in (tmp_path, tmp_path / "work"):
        with pytest.raises(UsageError, match="/disk/that/is/not/mounted is not a folder"):
            require_writable_runs(Runs(root))


def test_a_folder_where_the_system_lets_nobody_write_is_refused() -> None:
    with pytest.raises(UsageError, match="/proc/v1 cannot be written: "):
        require_writable_runs(Runs(Path("/proc/v1")))


def test_anothers_folder_is_to_be_given_to_this_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As of `runs/` that the container's root made, seen by its ordinary user."""
    runs = tmp_path / "runs"
    runs.mkdir()

    def refuse(**_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(folders.tempfile, "NamedTemporaryFile", refuse)
    owner = runs.stat().st_uid
    monkeypatch.setattr(folders.os, "geteuid", lambda: owner + 1000)
    with pytest.raises(UsageError, match=rf"belongs to user {owner} and .* `sudo chown -R {owner + 1000} runs`"):
        require_writable_runs(Runs(runs))
    with pytest.raises(UsageError, match="Permission denied; give another folder with --output"):
        require_writable(runs, "--output")
    monkeypatch.setattr(folders.os, "geteuid", lambda: owner)
    with pytest.raises(UsageError, match="Permission denied; give another folder with --runs"):
        require_writable_runs(Runs(runs))
