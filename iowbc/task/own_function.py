"""User-defined functions: their file is executed on loading, and their return values are checked."""

import functools
import linecache
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import decode_source
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.errors import StageFailed, nearest
from iowbc.recipe.beside import CustomFunction, ModuleFile

ArrayShape = tuple[int | None, ...]
"""Shape of an array; None stands for any length."""
LARGEST = float(np.finfo(np.float32).max)
"""Largest finite float32, the type of observations and rewards."""


@dataclass(frozen=True)
class CheckedFunction:
    """A function whose values are checked against its contract."""

    where: str
    """Location for error messages: path in the recipe, file, function name."""
    contract: str
    """Description of argument and return value."""
    file: ModuleFile
    function: Callable[[Any], Any]

    def __call__(self, source: Any, *shapes: ArrayShape, excused: Mask | None = None) -> Array:
        """Values of the function, of one of the shapes, (n, ...). `excused`: rows that need not be finite, (n,). Raises
        StageFailed if the function raises or returns anything else."""
        try:
            found = np.asarray(self.function(source), np.float64)
        except (Exception, SystemExit) as error:
            raise StageFailed(f"{self.where}: raised {_told(error, self.file)}; {self.contract}") from error
        if not any(_fits(found.shape, shape) for shape in shapes):
            expected = " or ".join(str(shape).replace("None", "k") for shape in shapes)
            raise StageFailed(f"{self.where}: returned shape {found.shape}, expected {expected}; {self.contract}")
        count = len(found)
        wrong = ~(np.abs(found) <= LARGEST).reshape(count, -1).all(axis=1)
        if excused is not None:
            wrong &= ~excused
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            text = f"returned {found[first]} for environment {first} of {count}"
            raise StageFailed(f"{self.where}: {text}; {self.contract}")
        return found


def load_function(path: str, own: CustomFunction, contract: str) -> CheckedFunction:
    """Executes the file of a function. `path`: in the recipe; `contract`: see `CheckedFunction`. Raises StageFailed."""
    where = f"{path}: {own.module.path}"
    try:
        module = _executed(own.module)
    except (Exception, SystemExit) as error:
        raise StageFailed(f"{where}: cannot be executed: {_told(error, own.module)}") from error
    function = getattr(module, own.function, None)
    if not callable(function):
        functions = [known for known, value in vars(module).items() if isinstance(value, FunctionType)]
        known = ", ".join(functions) or "none"
        hint = nearest(own.function, functions)
        raise StageFailed(f"{where}: has no function {own.function!r}; there are: {known}{hint}; {contract}")
    return CheckedFunction(f"{where}, function {own.function}", contract, own.module, function)


def _fits(found: tuple[int, ...], shape: ArrayShape) -> bool:
    return len(found) == len(shape) and all(wanted in (None, size) for size, wanted in zip(found, shape, strict=True))


@functools.cache
def _executed(file: ModuleFile) -> Any:
    """The module of a file; its lines are shown in tracebacks."""
    source = decode_source(file.unpacked())
    name = f"<{file.path} {file.sha256[:8]}>"
    linecache.cache[name] = (len(source), None, source.splitlines(keepends=True), name)
    module = ModuleType(f"iowbc_own_{file.sha256[:16]}")
    sys.modules[module.__name__] = module  # dataclasses look their module up by its name
    exec(compile(source, name, "exec"), vars(module))
    return module


def _told(error: BaseException, file: ModuleFile) -> str:
    """Message of an error in the user's code, with the last line of the file in its traceback."""
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    lines = [error.lineno] if isinstance(error, SyntaxError) and error.lineno else []
    name = f"<{file.path} {file.sha256[:8]}>"
    lines += [line for frame, line in traceback.walk_tb(error.__traceback__) if frame.f_code.co_filename == name]
    line = f" in line {lines[-1]}" if lines else ""
    return f"{type(error).__name__}: {text}{line}"
