"""Digests of the modules that a stage imports, and versions of packages; with its key they determine a result."""

import ast
import functools
import hashlib
import importlib.metadata
import platform
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from socket import gethostname

from iowbc.files import content_digest, file_digest
from iowbc.pipeline.stage import Stage

PACKAGE = Path(__file__).parents[1]
INFRASTRUCTURE = ("pipeline", "errors", "files", "full_disk", "processes")
"""Subpackages and modules that run stages but compute no result; they and their imports are ignored."""
IN_KEYS = "recipe.recipe"
"""The module of the whole recipe, whose imports are ignored: its values are in keys, and sections count only if a
stage's code imports them itself."""
RECORDED_PACKAGES = (
    *("coal", "crocoddyl", "daqp", "drake", "mujoco", "numpy", "onnxruntime", "pin", "scikit-learn", "scipy"),
    *("stable-baselines3", "torch"),
)
"""Packages that shape results; their versions are kept with every artifact."""
CODE_DIGITS = 12
"""Hexadecimal digits of the digest by which machines compare their code."""


def stage_code(stage: Stage) -> Mapping[str, str]:
    """Digest of the stage's own module, and of its transitive imports within the package, by subpackage."""
    own = stage.run.__module__.removeprefix(f"{PACKAGE.name}.")
    return _code_of(own) if own != stage.run.__module__ else {}


@functools.cache
def _code_of(own: str) -> Mapping[str, str]:
    modules = module_closure(own)
    parts = {name: name if name == own else name.split(".")[0] for name in modules}
    return {
        part: content_digest({name: syntax_digest(_source(name)) for name in modules if parts[name] == part})
        for part in sorted(set(parts.values()))
    }


@functools.cache
def syntax_digest(source: Path) -> str:
    """Digest of a module's syntax tree, without comments, docstrings and the sentences under fields."""
    tree = ast.parse(source.read_bytes(), filename=str(source))
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            body[:] = [statement for statement in body if not _is_text(statement)]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()


def _is_text(statement: ast.AST) -> bool:
    value = statement.value if isinstance(statement, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def changed_code(old: Mapping[str, str], new: Mapping[str, str]) -> list[str]:
    """Names of the subpackages and modules whose code differs."""
    return sorted(name for name in old.keys() | new.keys() if old.get(name) != new.get(name))


@functools.cache
def module_closure(module: str) -> frozenset[str]:
    """A module of the package and all that its imports lead to, by their names below the package."""
    found, open_ones = {module}, [module]
    while open_ones:
        new = _imports(_source(open_ones.pop())) - found
        found |= new
        open_ones += new
    return frozenset(found)


@functools.cache
def _imports(source: Path) -> frozenset[str]:
    """Modules of the package that a module imports when it runs, also within functions, by their names below it."""
    tree = ast.parse(source.read_bytes(), filename=str(source))
    names = {name.removeprefix(f"{PACKAGE.name}.") for name in _imported(tree) if name.startswith(f"{PACKAGE.name}.")}
    counting = {name for name in names if name != IN_KEYS and name.split(".")[0] not in INFRASTRUCTURE}
    return frozenset(name for name in counting if _source(name).is_file())


def _imported(node: ast.AST) -> Iterator[str]:
    """Dotted names of all imports in a syntax tree except those under `TYPE_CHECKING`."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        yield str(node.module)
        yield from (f"{node.module}.{alias.name}" for alias in node.names)
    checked = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    for child in node.orelse if isinstance(node, ast.If) and checked else ast.iter_child_nodes(node):
        yield from _imported(child)


def _source(module: str) -> Path:
    return PACKAGE / f"{module.replace('.', '/')}.py"


@functools.cache
def versions() -> dict[str, str]:
    """Versions of Python and of the packages that shape a result."""
    found = {"python": platform.python_version()}
    for name in ("iowbc", *RECORDED_PACKAGES):
        with suppress(importlib.metadata.PackageNotFoundError):
            found[name] = importlib.metadata.version(name)
    return found


@functools.cache
def identity() -> Mapping[str, str]:
    """This machine's name as `host`, its `versions()`, and the digest of the package's modules as `code`."""
    sources = sorted(PACKAGE.rglob("*.py"))
    code = content_digest({path.relative_to(PACKAGE).as_posix(): file_digest(path) for path in sources})
    return {"host": gethostname(), **versions(), "code": code[:CODE_DIGITS]}


def mismatch(own: Mapping[str, str], other: Mapping[str, str]) -> str:
    """Differences of another machine from this one, with both values; empty where results would be the same."""
    return "; ".join(
        f"{name} {own.get(name, 'missing')} here, {other.get(name, 'missing')} on {other['host']}"
        for name in sorted((own.keys() | other.keys()) - {"host"})
        if own.get(name) != other.get(name)
    )
