"""Links between the pages of the documentation lead somewhere, and the pictures that they show are there."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from pages import DOCS

ROOT = DOCS.parent
PAGES = [*(ROOT / f"{name}.md" for name in ("README", "CHANGELOG", "CONTRIBUTING")), *sorted(DOCS.rglob("*.md"))]
ELSEWHERE = ("http://", "https://", "mailto:")


def prose(page: Path) -> str:
    """A page without its blocks of code."""
    return re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)


def targets(page: Path) -> Iterator[str]:
    """What a page links to or shows of this repository."""
    text = re.sub(r"`[^`]*`", "", prose(page))
    found = re.findall(r"\]\(([^)\s]+)[^)]*\)|^\[[^\]]+\]:\s*(\S+)|(?:src|href)=\"([^\"]+)\"", text, flags=re.MULTILINE)
    yield from (target for target in map("".join, found) if not target.startswith(ELSEWHERE))


def anchors(page: Path) -> set[str]:
    """Names of a page's headings in addresses."""
    headings = re.findall(r"^#+ (.+)$", prose(page), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def dead(page: Path) -> list[str]:
    """Links of a page that lead nowhere."""
    broken = []
    for target in targets(page):
        name, _, anchor = target.partition("#")
        place = page.parent / name if name else page
        if not place.exists() or (anchor and anchor not in anchors(place)):
            broken.append(target)
    return broken


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_link_and_picture_of_a_page_is_there(page: Path) -> None:
    assert dead(page) == []


def test_a_link_leads_to_every_page() -> None:
    linked = {(page.parent / target.partition("#")[0]).resolve() for page in PAGES for target in targets(page)}
    assert set(DOCS.rglob("*.md")) - {DOCS / "index.md"} <= linked


def test_a_dead_link_is_found(tmp_path: Path) -> None:
    (tmp_path / "other.md").write_text("# What it is\n\n```sh\n# no heading\n```\n")
    page = tmp_path / "page.md"
    page.write_text(
        "## Here\n[a](other.md) [b](other.md#what-it-is) [c](#here) [d](https://x.org) `[e](code.md)`\n"
        "[f](none.md) [g](other.md#no-heading) ![h](none.png) [i](#there)\n"
    )
    assert dead(page) == ["none.md", "other.md#no-heading", "none.png", "#there"]


def test_every_file_that_the_architecture_names_is_there() -> None:
    named = set(re.findall(r"`((?:iowbc|tests)/[\w/.]+)`", (DOCS / "architecture.md").read_text(encoding="utf-8")))
    assert len(named) > 30
    assert sorted(name for name in named if not (ROOT / name).exists()) == []


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_bytes()) <= 12_000
