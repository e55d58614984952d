"""Labels in shards on disk, from which an interrupted stage resumes."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.files import newest_checked, write_checked


@dataclass(frozen=True)
class Shard:
    """Labels of some samples, and reasons for rejecting others."""

    kept: Indices
    """Numbers of the labelled samples, shape (k,)."""
    labels: Mapping[str, Array]
    """Arrays of the labels, leading dimension k."""
    rejected: Indices
    """Numbers of the samples without a label, shape (r,)."""
    reasons: Sequence[str]
    """Reason for each rejection."""


def cut(indices: Sequence[int], size: int, folder: Path) -> tuple[list[list[int]], list[Path]]:
    """Chunks of samples, and the shard file of each chunk."""
    chunks = [list(indices[start : start + size]) for start in range(0, len(indices), size)]
    return chunks, [folder / f"{number:05d}.shard" for number in range(len(chunks))]


def write_shard(path: Path, key: str, shard: Shard) -> None:
    content = BytesIO()
    np.savez(
        content,
        allow_pickle=False,
        kept=shard.kept,
        rejected=shard.rejected,
        reasons=np.array(shard.reasons, dtype=np.str_),
        **{f"label_{name}": values for name, values in shard.labels.items()},
    )
    write_checked(path, key, content.getvalue())


def read_shard(path: Path, key: str, indices: Sequence[int]) -> Shard | None:
    """The stored shard; None if it is missing or damaged, or belongs to another run or other samples."""
    content, _ = newest_checked(path, key)
    if content is None:
        return None
    with np.load(BytesIO(content), allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    kept, rejected, reasons = arrays.pop("kept"), arrays.pop("rejected"), arrays.pop("reasons").tolist()
    labels = {name.removeprefix("label_"): values for name, values in arrays.items()}
    if sorted([*kept.tolist(), *rejected.tolist()]) != sorted(indices):
        return None
    return Shard(kept, labels, rejected, reasons)


def merge(shards: Sequence[Shard]) -> Shard:
    """Joins shards, sorted by sample number."""
    kept = np.concatenate([shard.kept for shard in shards])
    rejected = np.concatenate([shard.rejected for shard in shards])
    reasons = [reason for shard in shards for reason in shard.reasons]
    order, rejected_order = np.argsort(kept), np.argsort(rejected)
    filled = [shard for shard in shards if len(shard.kept)]
    names = filled[0].labels.keys() if filled else ()
    labels = {name: np.concatenate([shard.labels[name] for shard in filled])[order] for name in names}
    return Shard(kept[order], labels, rejected[rejected_order], [reasons[i] for i in rejected_order])


def reasons(result: Shard) -> dict[str, int]:
    """Counts of the reasons for rejection, most frequent first."""
    return dict(Counter(sorted(result.reasons)).most_common())
