"""Labelled samples: in pieces on disk, with which an interrupted stage goes on, and as one file, `dataset.npz`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from io import BytesIO
from pathlib import Path

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.files import newest_checked, write_checked
from iowbc.reference.labels.plan import SamplePlan


@dataclass(frozen=True)
class Shard:
    """Labels of some samples and the reasons why others have none."""

    kept: Indices
    """Numbers of the labelled samples, shape (k,)."""
    labels: Mapping[str, Array]
    """Arrays of the labels, leading dimension k."""
    rejected: Indices
    """Numbers of the samples without a label, shape (r,)."""
    reasons: Sequence[str]
    """Why, one for each of them."""


def cut(indices: Sequence[int], size: int, folder: Path) -> tuple[list[list[int]], list[Path]]:
    """Samples in chunks of a size, and the file of each chunk's shard in a folder."""
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
    """All shards as one, sorted by sample number."""
    kept = np.concatenate([shard.kept for shard in shards])
    rejected = np.concatenate([shard.rejected for shard in shards])
    reasons = [reason for shard in shards for reason in shard.reasons]
    order, rejected_order = np.argsort(kept), np.argsort(rejected)
    filled = [shard for shard in shards if len(shard.kept)]
    names = filled[0].labels.keys() if filled else ()
    labels = {name: np.concatenate([shard.labels[name] for shard in filled])[order] for name in names}
    return Shard(kept[order], labels, rejected[rejected_order], [reasons[i] for i in rejected_order])


@dataclass(frozen=True)
class Dataset:
    """Kept samples with their labels (leading dimension n), and rejected samples with their reasons (r)."""

    index: Array
    """Number of the sample, shape (n,)."""
    group: Array
    """Mirror images share a group, shape (n,)."""
    arm: Array
    """Arm postures, shape (n, 14) [rad]."""
    command: Array
    """Height [m] and torso pitch [rad], shape (n, 2)."""
    support: Array
    """The labels: support postures, shape (n, 15) [rad]."""
    base_position: Array
    """Base over the middle of the soles, shape (n, 3) [m]."""
    base_quaternion: Array
    """Base orientation, wxyz, shape (n, 4)."""
    wrench: Array
    """Ground on each sole, in the sole's frame, force and moment, shape (n, 2, 6) [N, N·m]."""
    torque: Array
    """Torques of the support joints, shape (n, 15) [N·m]."""
    margin: Array
    """Distance of the centre of mass inside the support polygon, shape (n,) [m]."""
    reached: Array
    """Height reached, shape (n,) [m]."""
    rejected_arm: Array
    rejected_command: Array
    """Samples without a label, shapes (r, 14), (r, 2)."""
    rejected_index: Array
    """Their numbers, shape (r,)."""
    rejected_reason: Array
    """Why, shape (r,), text."""

    def __len__(self) -> int:
        return len(self.index)

    def save(self, path: Path) -> None:
        np.savez_compressed(path, allow_pickle=False, **{f.name: getattr(self, f.name) for f in fields(self)})

    @classmethod
    def load(cls, path: Path) -> "Dataset":
        """Reads the archive. Raises ValueError where arrays are missing or not finite."""
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            missing = [f.name for f in fields(cls) if f.name not in stored.files]
            if missing:
                raise ValueError(f"{path}: no arrays {', '.join(missing)}; make it anew with `--force rg-dataset`")
            dataset = cls(**{f.name: stored[f.name] for f in fields(cls)})
        for f in fields(cls):
            values = getattr(dataset, f.name)
            if values.dtype.kind == "f" and not np.isfinite(values).all():
                raise ValueError(
                    f"{path}: {f.name} has values that are not finite; make it anew with `--force rg-dataset`"
                )
        return dataset


def assemble(plan: SamplePlan, result: Shard) -> Dataset:
    """Joins labels with the samples they belong to."""
    if not len(result.kept):
        counted = ", ".join(f"{count} {reason}" for reason, count in reasons(result).items())
        raise ValueError(
            f"no sample has a label ({counted}); widen rg.sampling.height and rg.sampling.pitch or rg.gates"
        )
    kept, rejected = plan.draw(result.kept), plan.draw(result.rejected)
    return Dataset(
        index=result.kept,
        group=np.array([plan.group(int(index)) for index in result.kept]),
        arm=np.stack([sample.arm for sample in kept]),
        command=np.stack([sample.command for sample in kept]),
        **result.labels,
        rejected_arm=np.array([sample.arm for sample in rejected]).reshape(-1, len(plan.rest)),
        rejected_command=np.array([sample.command for sample in rejected]).reshape(-1, 2),
        rejected_index=result.rejected,
        rejected_reason=np.array(result.reasons, dtype=np.str_),
    )


def reasons(result: Shard) -> dict[str, int]:
    """Counts of the reasons for rejection, most frequent first."""
    names, counts = np.unique(np.array(result.reasons, dtype=np.str_), return_counts=True)
    order = np.argsort(-counts, kind="stable")
    return {str(names[i]): int(counts[i]) for i in order}
