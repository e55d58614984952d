"""Writes a web page from an exported folder; npm fetches its parts in pinned versions, and esbuild bundles them."""

import hashlib
import json
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from iowbc.deploy import exported_folder
from iowbc.errors import UsageError
from iowbc.evaluation.exported import exported_world
from iowbc.recipe.simulation.holding import FREE
from iowbc.robot.description import load_robot
from iowbc.web.scenes import accepted, web_scenes

SOURCE = Path(__file__).parent / "source"
PINNED = ("package.json", "package-lock.json")
OLDEST_NODE = 18
WASM = {
    "mujoco.wasm": "@mujoco/mujoco/mujoco.wasm",
    "onnxruntime.wasm": "onnxruntime-web/dist/ort-wasm-simd-threaded.wasm",
}
"""WebAssembly files of the page, and their paths in `node_modules`."""
LIBRARY, PAGE = "iowbc.js", "page.js"
BUNDLING = ("--bundle", "--format=esm", "--minify", "--target=es2022", "--external:module", "--log-level=warning")
LAST_LINES = 6
SCENES = "scenes.json"
"""File that the page adds to the exported ones, with scenes, the first scene, and the golden vectors."""


def write_page(exported: Path, out: Path, cache: Path, say: Callable[[str], None]) -> None:
    """Write a page with an exported controller, and all that it needs, into `out`; `cache`: folder of npm's packages.
    Raises ContractBroken for a damaged export, UsageError without npm."""
    world = exported_world(exported)
    parts = npm_parts(cache, say)
    scenes = web_scenes(world, load_robot(world.robot))
    first = next((name for name, _ in accepted(world.recipe)), FREE)
    golden = None
    if (path := exported / exported_folder.GOLDEN).is_file():
        with np.load(path, allow_pickle=False) as file:
            golden = {name: values.tolist() for name, values in file.items()}  # a row for each step
    about = {"scenes": scenes, "first": first, "golden": golden}
    out.mkdir(parents=True, exist_ok=True)
    (out / SCENES).write_text(json.dumps(about, separators=(",", ":")), encoding="utf-8")  # first: it marks the folder
    for name in (exported_folder.SETTLE, exported_folder.STEP, exported_folder.CONTRACT):
        shutil.copyfile(exported / name, out / name)
    bundle(parts, out)


def npm_parts(cache: Path, say: Callable[[str], None]) -> Path:
    """The `node_modules` of the pinned versions in a cache, fetched if missing. Raises `UsageError` if npm fails."""
    folder = parts_folder(cache)
    if (folder / "node_modules").is_dir():
        return folder / "node_modules"
    require_node()
    fresh = folder.with_name(f"{folder.name}.part")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir(parents=True)
    for name in PINNED:
        shutil.copy(SOURCE / name, fresh / name)
    say(f"npm fetches MuJoCo, onnxruntime and three.js for the browser into {cache} (200 MB, once)")
    _run(
        ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"],
        fresh,
        "npm could not fetch the page's parts: is there a network, or a registry set in .npmrc? Then run it again",
    )
    fresh.rename(folder)
    return folder / "node_modules"


def parts_folder(cache: Path) -> Path:
    """Folder of the pinned versions in a cache."""
    pinned = b"".join((SOURCE / name).read_bytes() for name in PINNED)
    return cache / hashlib.sha256(pinned).hexdigest()[:12]


def require_node() -> None:
    """Raises `UsageError` where Node.js or npm is missing or too old."""
    missing = [name for name in ("node", "npm") if shutil.which(name) is None]
    advice = f"install Node.js {OLDEST_NODE} or newer with npm (nodejs.org, or `apt install nodejs npm`)"
    if missing:
        raise UsageError(f"a web page needs {' and '.join(missing)} to be bundled: {advice}")
    output = subprocess.run(["node", "--version"], capture_output=True, text=True, check=False).stdout.strip()
    number = output.removeprefix("v").partition(".")[0]
    if not number.isdecimal() or int(number) < OLDEST_NODE:
        raise UsageError(
            f"a web page needs Node.js {OLDEST_NODE} or newer, found {output or 'none that runs'}: {advice}"
        )


def bundle(parts: Path, out: Path) -> None:
    """Write scripts, WebAssembly, HTML, style and licenses into a folder. Raises `UsageError`."""
    parts = parts.resolve()
    with tempfile.TemporaryDirectory(dir=parts.parent) as build:  # imports are resolved beside and above the source
        shutil.copytree(SOURCE, build, dirs_exist_ok=True)
        for name, others in ((LIBRARY, ()), (PAGE, (f"--external:./{LIBRARY}",))):
            words = ["node", str(parts / "esbuild/bin/esbuild"), name, *BUNDLING, *others]
            _run([*words, f"--outfile={out.resolve() / name}"], Path(build), "esbuild could not bundle the page")
    for name, place in WASM.items():
        shutil.copyfile(parts / place, out / name)
    for name in ("index.html", "style.css"):
        shutil.copyfile(SOURCE / name, out / name)
    (out / "licenses.txt").write_text(licenses(parts), encoding="utf-8")


def licenses(parts: Path) -> str:
    """Name, version, license and home of every package that the page contains."""
    lines = []
    for name in json.loads((SOURCE / "package.json").read_text())["dependencies"]:
        about = json.loads((parts / name / "package.json").read_text(encoding="utf-8"))
        home = about.get("homepage") or about["repository"]["url"]
        lines.append(f"{name} {about['version']}: {about['license']}, {home}\n")
    return "".join(lines)


def _run(words: list[str], folder: Path, advice: str) -> None:
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        output = "\n".join((done.stderr or done.stdout).strip().splitlines()[-LAST_LINES:])
        raise UsageError(f"{advice}:\n{output}")
