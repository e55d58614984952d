"""What a page of the documentation asks a reader to write and to type."""

import re
import shlex
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def files(page: str) -> dict[str, str]:
    """Text of each file that a page shows, by the title of its block."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return dict(re.findall(r'```\w+ title="([^"]+)"\n(.*?)```', text, flags=re.DOTALL))


def commands(page: str) -> list[list[str]]:
    """Words of each `iowbc ...` that a page asks to type or speaks of, without the program's name."""
    text = (DOCS / page).read_text(encoding="utf-8")
    blocks = re.findall(r"```sh\n(.*?)```", text, flags=re.DOTALL)
    typed = [line for block in blocks for line in block.splitlines() if line.startswith("iowbc ")]
    spoken_of = re.findall(r"`(iowbc [^`]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL))
    return [shlex.split(line.replace("\n", " "), comments=True)[1:] for line in (*typed, *spoken_of)]


def write(page: str, folder: Path) -> None:
    """The files of a page, where it says."""
    for title, body in files(page).items():
        (folder / title).parent.mkdir(parents=True, exist_ok=True)
        (folder / title).write_text(body, encoding="utf-8")
