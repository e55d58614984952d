"""Labels on disk: shards, from which an interrupted stage resumes, and the whole dataset, `dataset.npz`."""

from collections import Counter
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
    """Labels of some samples, and reasons for rejecting others."""

    kept: Indices
    """Numbers of the labelled samples, shape (k,)."""
    labels: Mapping[str, Array]
    """Arrays of the labels, leading dimension k."""
    rejected: Indices
    """Numbers of the samples without a label, shape (r,)."""
    reasons: Sequence[str]
    """Reason for each rejection."""


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


@dataclass(frozen=True)
class Dataset:
    """Kept samples with their labels (leading dimension n), and rejected samples with their reasons (r)."""

    index: Array
    """Sample numbers, shape (n,)."""
    group: Array
    """Mirror images share a group, shape (n,)."""
    arm: Array
    """Arm postures, shape (n, 14) [rad]."""
    command: Array
    """Height [m] and torso pitch [rad], shape (n, 2)."""
    support: Array
    """The labels: support postures, shape (n, 15) [rad]."""
    base_position: Array
    """Base position from the middle of the soles, shape (n, 3) [m]."""
    base_quaternion: Array
    """Base orientation, wxyz, shape (n, 4)."""
    wrench: Array
    """Wrench of the ground on each sole in the sole's frame, force then moment, shape (n, 2, 6) [N, N·m]."""
    torque: Array
    """Torques of the support joints, shape (n, 15) [N·m]."""
    margin: Array
    """Distance of the centre of mass inside the support polygon, shape (n,) [m]."""
    reached: Array
    """Height reached, shape (n,) [m]."""
    rejected_command: Array
    rejected_index: Array
    rejected_reason: Array
    """Of samples without a label: command, shape (r, 2) [m, rad], number, shape (r,), and reason, shape (r,), text."""

    def __len__(self) -> int:
        return len(self.index)

    def save(self, path: Path) -> None:
        np.savez_compressed(path, allow_pickle=False, **vars(self))

    @classmethod
    def load(cls, path: Path) -> "Dataset":
        """Reads the archive. Raises ValueError for missing arrays or values that are not finite."""
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            missing = [f.name for f in fields(cls) if f.name not in stored.files]
            if missing:
                raise ValueError(f"{path}: no arrays {', '.join(missing)}; make it anew with `--force rg-dataset`")
            dataset = cls(**{f.name: stored[f.name] for f in fields(cls)})
        for name, values in vars(dataset).items():
            if values.dtype.kind == "f" and not np.isfinite(values).all():
                text = f"{path}: {name} has values that are not finite"
                raise ValueError(f"{text}; make it anew with `--force rg-dataset`")
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
        rejected_command=np.array([sample.command for sample in rejected]).reshape(-1, 2),
        rejected_index=result.rejected,
        rejected_reason=np.array(result.reasons, dtype=np.str_),
    )
