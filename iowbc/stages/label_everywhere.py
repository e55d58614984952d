"""Labelling of the stage rg-dataset on several machines."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.spread import NodeSpread
    from iowbc.reference.labels.labelling import LabelTask
    from iowbc.reference.labels.shards import Shard

SHARES = 4
"""Pieces per core on other machines, so that cores idle for at most a quarter of the time at the end."""


def label_everywhere(
    task: "LabelTask",
    indices: Sequence[int],
    *,
    spread: "NodeSpread",
    folder: Path,
    key: str,
    chunk_size: int,
    interrupted: Callable[[], bool],
    progress: Callable[[int, int], None],
) -> "Shard":
    """Like `label_all`, but other machines make the missing shards, several per piece."""
    from iowbc.reference.labels.pool import label_all
    from iowbc.reference.labels.shards import cut, read_shard

    folder.mkdir(parents=True, exist_ok=True)
    chunks, paths = cut(indices, chunk_size, folder)
    missing = [number for number, path in enumerate(paths) if read_shard(path, key, chunks[number]) is None]
    size = max(1, len(missing) // (SHARES * spread.width))
    shares = [missing[start : start + size] for start in range(0, len(missing), size)]
    ready = len(indices) - sum(len(chunks[number]) for number in missing)
    progress(ready, len(indices))
    calls = [(task, [chunks[number] for number in share], key, chunk_size) for share in shares]
    for place, shards in spread(label_share, calls, {"robot": task.robot}):
        for number, content in zip(shares[place], shards, strict=True):
            paths[number].write_bytes(content)
            ready += len(chunks[number])
        progress(ready, len(indices))
    return label_all(
        task,
        indices,
        folder=folder,
        key=key,
        chunk_size=chunk_size,
        workers=1,
        interrupted=interrupted,
        progress=progress,
    )


def label_share(
    task: "LabelTask", chunks: Sequence[Sequence[int]], key: str, chunk_size: int, *, robot: Path
) -> list[bytes]:
    """File contents of the shards of some chunks, made in a separate process, which a solver may crash."""
    from iowbc.reference.labels.pool import label_all

    with tempfile.TemporaryDirectory(prefix="iowbc-labels-") as folder:
        label_all(
            replace(task, robot=robot),
            [index for chunk in chunks for index in chunk],  # only the last may be short: cut again, they are equal
            folder=Path(folder),
            key=key,
            chunk_size=chunk_size,
            workers=1,
            interrupted=lambda: False,
            progress=lambda done, total: None,
        )
        return [path.read_bytes() for path in sorted(Path(folder).glob("*.shard"))]
