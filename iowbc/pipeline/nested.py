"""Recipes and their parts as trees of values: leaves, and what differs between two."""

from collections.abc import Iterator, Mapping
from typing import Any


class _Missing:
    def __repr__(self) -> str:
        return "(absent)"


MISSING = _Missing()


def nested(slices: Mapping[str, Any]) -> dict[str, Any]:
    """Values by dotted path as a tree."""
    tree: dict[str, Any] = {}
    for path, value in slices.items():
        *above, name = path.split(".")
        branch = tree
        for part in above:
            branch = branch.setdefault(part, {})
        branch[name] = value
    return tree


def differences(before: Any, after: Any, path: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Dotted path, old and new value wherever two trees differ; a branch that only one of them has is one entry."""
    branches = _branches(before), _branches(after)
    if branches[0] is None or branches[1] is None:
        if before != after:
            yield path, before, after
        return
    for name in sorted(branches[0].keys() | branches[1].keys()):
        below = f"{path}.{name}" if path else name
        yield from differences(branches[0].get(name, MISSING), branches[1].get(name, MISSING), below)


def _branches(value: Any) -> dict[str, Any] | None:
    """Entries of a mapping or a list of mappings, by name; None for a leaf."""
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, (list, tuple)) and any(isinstance(item, Mapping) for item in value):
        return {str(index): item for index, item in enumerate(value)}
    return None


def flattened(value: Any, path: str = "") -> dict[str, Any]:
    """Leaves of nested mappings, and of lists of mappings, by dotted path; a list of plain values is one leaf."""
    branches = _branches(value)
    if not branches:
        return {path: value}
    return {
        leaf: found
        for name, entry in branches.items()
        for leaf, found in flattened(entry, f"{path}.{name}" if path else str(name)).items()
    }
