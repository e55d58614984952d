"""The results of labelling in pieces on disk, so that an interrupted stage goes on where it stopped."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from iowbc.files import replacing

Array = NDArray[Any]


@dataclass(frozen=True)
class Shard:
    """Labels of some samples and the reasons why others have none."""

    kept: NDArray[np.int64]
    """Numbers of the labelled samples, shape (k,)."""
    labels: Mapping[str, Array]
    """Arrays of the labels, leading dimension k."""
    rejected: NDArray[np.int64]
    """Numbers of the samples without a label, shape (r,)."""
    reasons: Sequence[str]
    """Why, one for each of them."""


def write_shard(path: Path, key: str, shard: Shard) -> None:
    """Writes a shard and renames it into place."""
    with replacing(path) as fresh, fresh.open("wb") as file:
        np.savez(
            file,
            allow_pickle=False,
            key=np.array(key),
            kept=shard.kept,
            rejected=shard.rejected,
            reasons=np.array(shard.reasons, dtype=np.str_),
            **{f"label_{name}": values for name, values in shard.labels.items()},
        )


def read_shard(path: Path, key: str, indices: Sequence[int]) -> Shard | None:
    """The shard, or None where it is missing, damaged, of another run, or not finite: it is then made anew."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            content = {name: stored[name] for name in stored.files}
        shard = Shard(
            content["kept"],
            {name.removeprefix("label_"): values for name, values in content.items() if name.startswith("label_")},
            content["rejected"],
            content["reasons"].tolist(),
        )
        matches = str(content["key"]) == key
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):
        return None
    complete = sorted([*shard.kept.tolist(), *shard.rejected.tolist()]) == sorted(indices)
    sizes = all(len(values) == len(shard.kept) for values in shard.labels.values())
    finite = all(np.isfinite(values).all() for values in shard.labels.values())
    return shard if matches and complete and sizes and finite and len(shard.reasons) == len(shard.rejected) else None


def merge(shards: Sequence[Shard]) -> Shard:
    """All shards as one, sorted by sample number."""
    kept = np.concatenate([shard.kept for shard in shards])
    rejected = np.concatenate([shard.rejected for shard in shards])
    reasons = [reason for shard in shards for reason in shard.reasons]
    order, rejected_order = np.argsort(kept), np.argsort(rejected)
    filled = [shard for shard in shards if len(shard.kept)]
    names = filled[0].labels.keys() if filled else ()
    labels = {name: np.concatenate([shard.labels[name] for shard in filled])[order] for name in names}
    return Shard(kept[order], labels, rejected[rejected_order], [reasons[i] for i in rejected_order])
