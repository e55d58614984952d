"""The sentences below the fields of a section, as its source file has them."""

import ast
import functools
import inspect
import itertools
import textwrap

from pydantic import BaseModel


@functools.cache
def sentences(section: type[BaseModel]) -> dict[str, str]:
    """The string below each field of a section and its bases, by the field's name.

    For those who ask: pydantic's `use_attribute_docstrings` reads every section's source whenever a command starts.
    """
    bases = [base for base in section.__bases__ if issubclass(base, BaseModel) and base is not BaseModel]
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(section))).body
    assert isinstance(definition, ast.ClassDef)
    own = {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in itertools.pairwise(definition.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }
    return {name: sentence for base in bases for name, sentence in sentences(base).items()} | own
