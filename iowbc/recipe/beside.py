"""Files beside a recipe. Reading it takes them in, so that artifacts, worker processes and exported folders have all
that they were made from, and a key changes with their content."""

import base64
import binascii
import hashlib
import zlib
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from iowbc.files import read_limited
from iowbc.recipe.section import COSMETIC, Section


class FileBeside(Section):
    """A file, named in a recipe by its path from there, and its content."""

    suffixes: ClassVar[tuple[str, ...]] = ()
    """Endings that its name may have."""
    largest: ClassVar[int] = 0
    """Bytes of the largest that is taken in."""

    path: str = Field(json_schema_extra=COSMETIC)
    """Its place, as the recipe says it."""
    sha256: str
    """Digest of its bytes."""
    content: str = Field(json_schema_extra=COSMETIC)
    """Its bytes, compressed by zlib, in base64."""

    @classmethod
    def taken_in(cls, file: Path, path: str) -> Self:
        """The file as it is now; `path`: as the recipe says it. Raises ValueError for one that cannot be taken in."""
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
        """Its bytes. Raises ValueError where they are not those of the digest."""
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
        """In a recipe that people write it is a path; in a resolved one it has been taken in."""
        taken: dict[str, Any] = handler.resolve_ref_schema(super().__get_pydantic_json_schema__(core, handler))
        return {"anyOf": [{"type": "string", "description": "Path from the recipe's file."}, taken]}


class ModuleFile(FileBeside):
    """Python code. Reading a recipe or an artifact does not execute it, and neither do plans."""

    suffixes: ClassVar[tuple[str, ...]] = (".py",)
    largest: ClassVar[int] = 100_000


class MeshFile(FileBeside):
    """Triangles of an object. A few thousand describe any: what touches is their convex hull."""

    suffixes: ClassVar[tuple[str, ...]] = (".obj", ".stl")
    largest: ClassVar[int] = 400_000


class OwnFunction(Section):
    """A function in a file of one's own."""

    module: ModuleFile
    """Python file beside the recipe, which may import what is installed, and no file beside it."""
    function: str = Field(pattern="^[A-Za-z_][A-Za-z0-9_]*$", max_length=100)
    """Its function."""
