"""Reading of a YAML file as a tree with the location of each value; writing of a resolved recipe as YAML."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

import yaml
from pydantic import BaseModel

from iowbc.errors import Problem, RecipeError, shown

Scalar: TypeAlias = "str | int | float | bool | None"
Tree: TypeAlias = "dict[str, Located] | list[Located] | Scalar"
Plain: TypeAlias = "dict[str, Plain] | list[Plain] | Scalar"
PlaceOf: TypeAlias = Callable[[Any], str]
"""Converts a PyYAML mark to a location."""

MAXIMUM_DEPTH = 40
"""Largest nesting depth; deeper nesting indicates an alias that contains itself."""
MAXIMUM_NODES = 100_000
"""Largest number of values; more indicate aliases that multiply each other."""
LONGEST_NUMBER = 100
"""Largest number of characters of a number: the cost of parsing grows with their square."""


@dataclass(frozen=True)
class Located:
    """A value and its location: `file:line:column` of its key, `--set ...`, or `default`."""

    value: Tree
    place: str


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """Resolves scalars by YAML 1.2: `1e-3` is a number, `010` is decimal, `on` and `1:30` are text."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012 (PyYAML's own attribute)


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Quotes text that any version of YAML reads as another type; PyYAML by itself does not quote `1e3`."""


PLAIN_TAGS = [f"tag:yaml.org,2002:{name}" for name in ("null", "bool", "int", "float", "str", "seq", "map")]
_NULL, _BOOL, _INT, _FLOAT = PLAIN_TAGS[:4]
IMPLICIT = (
    (_NULL, re.compile(r"^(?:~|null|Null|NULL|)$"), ["~", "n", "N", ""]),
    (_BOOL, re.compile(r"^(?:true|True|TRUE|false|False|FALSE)$"), list("tTfF")),
    (_INT, re.compile(r"^(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$"), list("-+0123456789")),
    (
        _FLOAT,
        re.compile(
            r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$"
        ),
        list("-+.0123456789"),
    ),
)
"""Unquoted scalars that are not text: tag, pattern, and possible first characters."""
CONVERSIONS: dict[str, Callable[[str], Scalar]] = {
    _NULL: lambda text: None,
    _BOOL: lambda text: text.lower() == "true",
    _INT: lambda text: int(text, 0 if text[:2] in ("0o", "0x") else 10),
    _FLOAT: lambda text: float(text.lower().replace(".inf", "inf").replace(".nan", "nan")),
}
"""Values of these scalars, by tag."""
for _resolver in IMPLICIT:
    _Loader.add_implicit_resolver(*_resolver)
    _Dumper.add_implicit_resolver(*_resolver)


def read_document(text: str, file: str) -> Located:
    """The tree of one YAML document; the root's place is the file's first line. Raises `RecipeError` for bad syntax,
    duplicate keys (all of them) and tags other than YAML's plain scalars."""
    return _read(text, lambda mark: f"{file}:{mark.line + 1}:{mark.column + 1}", f"{file}:1:1")


def read_value(text: str, place: str) -> Located:
    """The tree of a value given on the command line; all its values have the location `place`."""
    return _read(text, lambda mark: place, place)


def _read(text: str, place_of: PlaceOf, root: str) -> Located:
    try:
        _limit_depth(text, place_of)
        node = yaml.compose(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        lines = text.splitlines()
        at_tab = mark and mark.line < len(lines) and lines[mark.line][mark.column : mark.column + 1] == "\t"
        reason = "a tab; indent with spaces" if at_tab else error.problem
        raise RecipeError([Problem(place_of(mark) if mark else root, f"not valid YAML: {reason}")]) from None
    except yaml.YAMLError as error:
        raise RecipeError([Problem(root, f"not valid YAML: {error}")]) from None
    if node is None:
        return Located(None, root)
    builder = _Builder(place_of)
    tree = builder.build(node, root, 0)
    if builder.problems:
        raise RecipeError(builder.problems)
    return tree


def _limit_depth(text: str, place_of: PlaceOf) -> None:
    """Raises `RecipeError` for nesting that would overflow the stack of the C parser."""
    depth = 0
    for event in yaml.parse(text, Loader=_Loader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAXIMUM_DEPTH:
            raise RecipeError([Problem(place_of(event.start_mark), f"is nested more than {MAXIMUM_DEPTH} deep")])


class _Builder:
    """Converts PyYAML nodes to a tree and collects problems."""

    def __init__(self, place_of: PlaceOf) -> None:
        self.place_of = place_of
        self.problems: list[Problem] = []
        self.nodes = 0

    def build(self, node: yaml.Node, place: str, depth: int) -> Located:
        self.nodes += 1
        if depth > MAXIMUM_DEPTH or self.nodes > MAXIMUM_NODES:
            raise RecipeError([Problem(place, "an alias (*name) that contains itself, or far too many values")])
        if node.tag not in PLAIN_TAGS:
            self._complain(node, f"tag {node.tag!r} is not allowed in a recipe")
            return Located(None, place)
        if isinstance(node, yaml.MappingNode):
            return Located(self._mapping(node, depth), place)
        if isinstance(node, yaml.SequenceNode):
            items = [self.build(item, self.place_of(item.start_mark), depth + 1) for item in node.value]
            return Located(items, place)
        return Located(self._scalar(node), place)

    def _mapping(self, node: yaml.MappingNode, depth: int) -> dict[str, Located]:
        entries: dict[str, Located] = {}
        for key_node, value_node in node.value:
            place = self.place_of(key_node.start_mark)
            if not isinstance(key_node, yaml.ScalarNode):
                self.problems.append(Problem(place, "a key must be a single word"))
                continue
            key = str(key_node.value)
            if key in entries:
                self.problems.append(Problem(place, f"key '{key}' is written twice; first at {entries[key].place}"))
            entries[key] = self.build(value_node, place, depth + 1)
        return entries

    def _scalar(self, node: yaml.Node) -> Scalar:
        text = str(node.value)
        if node.tag in (_INT, _FLOAT) and len(text) > LONGEST_NUMBER:
            self._complain(node, f"{shown(text)} has {len(text):,} characters; no number of a recipe has so many")
            return None
        try:
            return CONVERSIONS.get(node.tag, str)(text)
        except ValueError:
            self._complain(node, f"{shown(text)} is not a {node.tag.split(':')[-1]}")
            return None

    def _complain(self, node: yaml.Node, text: str) -> None:
        self.problems.append(Problem(self.place_of(node.start_mark), text))


def plain(tree: Located) -> Plain:
    """The tree's values without locations."""
    if isinstance(tree.value, dict):
        return {key: plain(entry) for key, entry in tree.value.items()}
    if isinstance(tree.value, list):
        return [plain(item) for item in tree.value]
    return tree.value


def located(value: Any, place: str) -> Located:
    """Plain data (mappings, sequences, scalars) as a tree with a single location."""
    if isinstance(value, dict):
        return Located({str(key): located(entry, place) for key, entry in value.items()}, place)
    if isinstance(value, (list, tuple)):
        return Located([located(item, place) for item in value], place)
    return Located(value, place)


def merged(base: Located, over: Located) -> Located:
    """`over` merged into `base`: mappings merge key by key, everything else (lists too) is replaced."""
    if not (isinstance(base.value, dict) and isinstance(over.value, dict)):
        return over
    below = base.value
    changed = {key: merged(below[key], entry) if key in below else entry for key, entry in over.value.items()}
    return Located(below | changed, over.place)


def leaves(tree: Located, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Located]]:
    """Every scalar and every empty collection with its path; list items are named by their index."""
    if not isinstance(tree.value, dict | list) or not tree.value:
        yield path, tree
        return
    for name, entry in tree.value.items() if isinstance(tree.value, dict) else enumerate(tree.value):
        yield from leaves(entry, (*path, str(name)))


def as_yaml(recipe: BaseModel) -> str:
    """Every field with its value, in the order of the recipe's sections."""
    return str(yaml.dump(recipe.model_dump(mode="json"), Dumper=_Dumper, sort_keys=False))
