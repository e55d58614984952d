"""The code that an artifact records is all that its stage's imports lead to, and nothing else."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from iowbc.pipeline import code
from iowbc.pipeline.code import stage_code

pytestmark = pytest.mark.unit


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    sources = {
        "stages/cook.py": "def run(job):\n    from iowbc.task.soup import boil\n    from iowbc.pipeline import stage\n",
        "task/soup.py": "if TYPE_CHECKING:\n    from iowbc.task.guests import hunger\nimport iowbc.task.salt\n",
        "task/salt.py": "",
        "task/guests.py": "",
        "pipeline/stage.py": "from iowbc.task import guests\n",
    }
    for name, text in sources.items():
        (tmp_path / "iowbc" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "iowbc" / name).write_text(text)
    monkeypatch.setattr(code, "PACKAGE", tmp_path / "iowbc")
    return tmp_path / "iowbc"


def digests(package: Path, changed: str = "", module: str = "iowbc.stages.cook") -> Mapping[str, str]:
    """What is recorded after a module has changed."""
    for cached in (code.module_closure, code._imports, code._code_of, code.syntax_digest):
        cached.cache_clear()
    if changed:
        (package / changed).write_text((package / changed).read_text() + "answer = 42\n")
    stage: Any = SimpleNamespace(run=SimpleNamespace(__module__=module))
    return stage_code(stage)


def test_an_import_counts_however_deep_and_also_within_functions(package: Path) -> None:
    before = digests(package)
    assert set(before) == {"stages.cook", "task"}
    after = digests(package, "task/salt.py")
    assert after["task"] != before["task"]
    assert after["stages.cook"] == before["stages.cook"]


def test_neither_the_pipeline_nor_imports_for_types_count(package: Path) -> None:
    before = digests(package)
    assert digests(package, "pipeline/stage.py") == digests(package, "task/guests.py") == before


def test_a_stage_outside_of_the_package_records_none(package: Path) -> None:
    assert digests(package, module="elsewhere.cook") == {}


@pytest.mark.parametrize(
    ("stage", "module"),
    [
        ("eval", "recipe.evaluation.sequences"),
        ("teacher", "stages.environments"),
        ("distill", "stages.environments"),
    ],
)
def test_a_module_that_decides_a_result_is_recorded(stage: str, module: str) -> None:
    assert module in code.module_closure(f"stages.{stage}")
