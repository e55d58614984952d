"""Files beside a recipe. Reading the recipe embeds their content, so that artifacts, worker processes and exported
folders are self-contained, and a cache key changes with the content."""

import base64
import binascii
import hashlib
import zlib
from importlib.util import decode_source
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from iowbc.files import read_limited
from iowbc.recipe.section import COSMETIC, Section


class EmbeddedFile(Section):
    """A file that a recipe names by a path relative to itself, with the file's embedded content."""

    suffixes: ClassVar[tuple[str, ...]] = ()
    """Permitted file extensions."""
    largest: ClassVar[int] = 0
    """Largest file size [bytes]."""

    path: str = Field(json_schema_extra=COSMETIC)
    """Path of the file, as written in the recipe."""
    sha256: str
    """SHA-256 digest of the file's bytes."""
    content: str = Field(json_schema_extra=COSMETIC)
    """The file's bytes, compressed by zlib, in base64."""

    @classmethod
    def taken_in(cls, file: Path, path: str) -> Self:
        """Embed `file`, written `path` in the recipe. Raises ValueError for another extension, an unreadable, too large
        or empty file."""
        if file.suffix.lower() not in cls.suffixes:
            raise ValueError(f"should be a file that ends in {' or '.join(cls.suffixes)}")
        try:
            data = read_limited(file, cls.largest)
        except OSError as error:
            raise ValueError(f"{file}: cannot be read: {error.strerror}; its path is taken from the recipe") from None
        if not data:
            raise ValueError(f"{file}: is empty")
        packed = base64.b64encode(zlib.compress(data, 9)).decode("ascii")
        return cls(path=path, sha256=hashlib.sha256(data).hexdigest(), content=packed)

    def unpacked(self) -> bytes:
        """The file's bytes. Raises ValueError if the content is damaged or does not match the digest."""
        unpacking = zlib.decompressobj()
        try:
            data = unpacking.decompress(base64.b64decode(self.content, validate=True), self.largest + 1)
        except (binascii.Error, zlib.error) as error:
            raise ValueError(f"{self.path}: its content is damaged: {error}") from None
        if hashlib.sha256(data).hexdigest() != self.sha256:
            raise ValueError(f"{self.path}: its content is not that of its digest {self.sha256}")
        return data

    @model_validator(mode="after")
    def _is_what_its_digest_says(self) -> Self:
        if Path(self.path).suffix.lower() not in self.suffixes:
            raise ValueError(f"path {self.path!r}: should end in {' or '.join(self.suffixes)}")
        self.unpacked()
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Accept a path (as in a recipe file) or the embedded file (as in a resolved recipe)."""
        taken: dict[str, Any] = handler.resolve_ref_schema(super().__get_pydantic_json_schema__(core, handler))
        return {"anyOf": [{"type": "string", "description": "Path from the recipe's file."}, taken]}


class ModuleFile(EmbeddedFile):
    """Python code. Reading a recipe or an artifact does not execute it, and neither do plans."""

    suffixes: ClassVar[tuple[str, ...]] = (".py",)
    largest: ClassVar[int] = 100_000

    @classmethod
    def taken_in(cls, file: Path, path: str) -> Self:
        """As for any file; raises ValueError also for one that is no Python."""
        own = super().taken_in(file, path)
        try:
            compile(decode_source(own.unpacked()), path, "exec")
        except (SyntaxError, UnicodeDecodeError) as error:
            line = f", line {error.lineno}" if isinstance(error, SyntaxError) and error.lineno else ""
            raise ValueError(f"{file}{line}: {error.msg if isinstance(error, SyntaxError) else error}") from None
        return own


class MeshFile(EmbeddedFile):
    """Triangle mesh of an object. A few thousand triangles suffice, because collisions use their convex hull."""

    suffixes: ClassVar[tuple[str, ...]] = (".obj", ".stl")
    largest: ClassVar[int] = 400_000


class CustomFunction(Section):
    """A function in a user's Python file."""

    module: ModuleFile
    """Python file beside the recipe. It may import installed packages, but not other files beside the recipe."""
    function: str = Field(pattern="^[A-Za-z_][A-Za-z0-9_]*$", max_length=100)
    """Name of the function in that file."""
