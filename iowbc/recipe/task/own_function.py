"""What a recipe says of a function in a file of one's own."""

from pydantic import Field

from iowbc.recipe.beside import ModuleFile
from iowbc.recipe.section import Section


class OwnFunction(Section):
    """A function in a file of one's own."""

    module: ModuleFile
    """Python file beside the recipe, which may import what is installed, and no file beside it."""
    function: str = Field(pattern="^[A-Za-z_][A-Za-z0-9_]*$", max_length=100)
    """Its function."""
