"""Terms of the reward in a user's file. Training environments execute it; nothing else does."""

import functools
import linecache
from collections.abc import Callable
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.errors import StageFailed, nearest
from iowbc.recipe.beside import ModuleFile
from iowbc.recipe.task.reward import OwnTerm, Reward
from iowbc.task.rewards.table import Step

CONTRACT = "it takes a Step (iowbc/task/rewards/table.py) and returns a finite number for each environment, shape (n,)"


def load_terms(recipe: Reward) -> dict[str, Callable[[Step], Array]]:
    """The recipe's own terms that have a weight, by name. Raises StageFailed for one that cannot be used."""
    return {name: _term(name, term) for name, term in recipe.own_terms.items()}


def _term(name: str, term: OwnTerm) -> Callable[[Step], Array]:
    where = f"task.reward.own.{name}: {term.module.path}"
    try:
        module = _executed(term.module)
    except Exception as error:
        raise StageFailed(f"{where}: cannot be executed: {_told(error, term.module)}") from error
    functions = [known for known, value in vars(module).items() if isinstance(value, FunctionType)]
    function = getattr(module, term.function, None)
    if not callable(function):
        known = ", ".join(functions) or "none"
        hint = nearest(term.function, functions)
        raise StageFailed(f"{where}: has no function {term.function!r}; there are: {known}{hint}; {CONTRACT}")
    where = f"{where}, function {term.function}"

    def value(step: Step) -> Array:
        try:
            found = np.asarray(function(step), np.float64)
        except Exception as error:
            raise StageFailed(f"{where}: raised {_told(error, term.module)}; {CONTRACT}") from error
        count = len(step.command)
        if found.shape[:1] != (count,) or found.ndim > (1 if term.width is None else 2):
            expected = f"({count},)" if term.width is None else f"({count},) or ({count}, k)"
            raise StageFailed(f"{where}: returned shape {found.shape}, expected {expected}; {CONTRACT}")
        wrong = ~np.isfinite(found.reshape(count, -1)).all(axis=1) & ~step.state.diverged
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            raise StageFailed(f"{where}: returned {found[first]} for environment {first} of {count}; {CONTRACT}")
        return found

    return value


@functools.cache
def _executed(file: ModuleFile) -> Any:
    """The module of a file; its lines are shown in tracebacks."""
    source = file.unpacked().decode("utf-8")
    name = f"<{file.path} {file.sha256[:8]}>"
    linecache.cache[name] = (len(source), None, source.splitlines(keepends=True), name)
    module = ModuleType(f"iowbc_own_{file.sha256[:16]}")
    exec(compile(source, name, "exec"), vars(module))
    return module


def _told(error: Exception, file: ModuleFile) -> str:
    """An error of the user's code, with the last line of the file that led to it."""
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    lines = [error.lineno] if isinstance(error, SyntaxError) else []
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == f"<{file.path} {file.sha256[:8]}>":
            lines.append(trace.tb_lineno)
        trace = trace.tb_next
    line = f" in line {lines[-1]}" if lines else ""
    return f"{type(error).__name__}: {text}{line}"
