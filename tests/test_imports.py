"""Help answers at once, and the rooms depend on each other in one direction only."""

import ast
import functools
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from sssfit.cli import cli

ROOT = Path(__file__).parents[1]
HEAVY = {"numpy", "numba", "scipy", "colour", "matplotlib", "rich", "OpenImageIO"}

# A room may import from rooms before it in this list, never from one after it.
ROOMS = [
    *(
        "errors",
        "methods",
        "messages",
        "files",
        "text",
        "kinds",
        "process",
        "arrays",
        "optics",
        "shapes",
    ),
    *("material", "grid", "profile", "kernel", "formats", "scene"),
    *(
        "simulate",
        "fit",
        "render",
        "measure",
        "export",
        "compare",
        "choose",
        "stability",
        "motion",
        "crowd",
        "sweep",
        "chart",
        "report",
        "cli",
    ),
]
# What verbs ask of the chart's room before there is anything to draw; quick to import.
LIGHT_CHART_FILES = {"data", "files"}
# A record draws itself for a notebook: its ``plot`` imports a chart when it is called, and nothing
# else of the record rests on a room above it.
PLOT_MAY_IMPORT = {
    "sssfit/profile/record.py": {"sssfit.chart.profile"},
    "sssfit/kernel/record.py": {"sssfit.chart.kernel", "sssfit.compare.kernel_view"},
    "sssfit/kernel/taps.py": {"sssfit.chart.taps", "sssfit.compare.taps_view"},
}
FOR_TYPES = {
    "sssfit/profile/record.py": {"matplotlib.figure"},
    "sssfit/kernel/record.py": {"matplotlib.figure"},
    "sssfit/kernel/taps.py": {"matplotlib.figure"},
    # What `load` returns; a reader is imported by its name once a file of its kind is read.
    "sssfit/kinds.py": {f"sssfit.{room}" for room in ("kernel", "material", "profile", "simulate")},
}
# The compiled layer stands beside the list: these rooms may use it, and it uses none of them.
ROOMS_ON_JIT = {"profile", "scene", "simulate", "render"}
# Neighbours that hand records on and know nothing of each other.
APART = {"simulate", "fit", "render"}
JIT_MAY_IMPORT = {"numpy", "numba", "llvmlite", "math", "sssfit"} | set(sys.stdlib_module_names)

CLI = sorted((ROOT / "cli").rglob("*.py"))
JIT = sorted((ROOT / "sssfit" / "_jit").rglob("*.py"))
LIBRARY = sorted((ROOT / "sssfit").rglob("*.py"))
SOURCES = [*LIBRARY, *CLI]
IN_ROOMS = sorted({*SOURCES} - {*JIT} - {ROOT / "sssfit" / "__init__.py"})


def name_of(path: Path) -> str:
    """Test id: the path inside the project."""
    return path.relative_to(ROOT).as_posix()


def package_of(path: Path) -> list[str]:
    """The import name of the folder a file lives in, as installed."""
    folder = path.parent.relative_to(ROOT).parts
    return list(folder) if folder[0] == "sssfit" else ["sssfit", *folder]


def walked(path: Path) -> Iterator[ast.AST]:
    """Every node of a file but what a record's ``plot`` and its return type may import."""
    tree, name = ast.parse(path.read_text(encoding="utf-8")), name_of(path)
    left_out: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name == "plot" and name in PLOT_MAY_IMPORT:
            allowed = PLOT_MAY_IMPORT[name]
        elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            allowed = FOR_TYPES.get(name, set())
        else:
            continue
        inside = [each for each in node.body if isinstance(each, ast.ImportFrom)]
        left_out |= {id(each) for each in inside if each.module in allowed}
    yield from (node for node in ast.walk(tree) if id(node) not in left_out)


@functools.cache
def imports(path: Path) -> list[str]:
    """Every module a file imports, inside functions too, with relative names resolved."""
    found: list[str] = []
    for node in walked(path):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            package = package_of(path)
            base = package[: len(package) - node.level + 1] if node.level else []
            module = [*base, *(node.module.split(".") if node.module else [])]
            if module == ["sssfit"]:  # from sssfit import errors
                found += [f"sssfit.{alias.name}" for alias in node.names]
            else:
                found.append(".".join(module))
    return found


def room_of(module: str) -> str:
    """``simulate`` of ``sssfit.simulate.montecarlo``."""
    return module.split(".")[1]


def module_of(path: Path) -> str:
    """The import name of a file, as installed."""
    return ".".join([*package_of(path), path.stem])


def test_help_and_version_import_nothing_heavy():
    calls = [
        ["--help"],
        ["--version"],
        ["-v", "--version"],
        *([verb, "--help"] for verb in cli.commands),
    ]
    program = f"""
import sys
from sssfit.cli import main
for call in {calls!r}:
    try:
        main(call)
    except SystemExit as end:
        assert not end.code, (call, end.code)
    loaded = {HEAVY!r} & {{name.partition(".")[0] for name in sys.modules}}
    assert not loaded, f"{{call}} imports {{sorted(loaded)}}"
"""
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60
    )
    assert run.returncode == 0, run.stderr


def test_the_photon_walk_does_not_wait_for_scipy():
    # numba imports the bare package itself; what takes 0.4 s are its parts.
    parts = ("scipy.special", "scipy.optimize", "scipy.fft")
    program = f"import sys, sssfit.simulate; assert not {set(parts)} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


@pytest.mark.parametrize("path", IN_ROOMS, ids=name_of)
def test_imports_point_down(path):
    room = room_of(module_of(path))
    assert room in ROOMS, f"give {room} a place in ROOMS"
    for module in imports(path):
        if not module.startswith("sssfit.") or module == "sssfit.__version__":
            continue
        other = room_of(module)
        if other == "_jit":
            assert room in ROOMS_ON_JIT, f"{room} imports {module}"
        else:
            assert other in ROOMS[: ROOMS.index(room) + 1], f"{room} imports {module}"
            assert not (room != other and {room, other} <= APART), f"{room} imports {module}"


def test_package_root_imports_rooms_for_type_checkers_only():
    tree = ast.parse((ROOT / "sssfit" / "__init__.py").read_text(encoding="utf-8"))
    at_run_time = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    assert [ast.unparse(node) for node in at_run_time] == [
        "from importlib import import_module",
        "from typing import TYPE_CHECKING, Any",
    ]


@pytest.mark.parametrize("path", JIT, ids=name_of)
def test_compiled_layer_sees_numbers_only(path):
    for module in imports(path):
        assert module.partition(".")[0] in JIT_MAY_IMPORT, module
        if module.startswith("sssfit."):
            assert module.split(".")[1] in ("_jit", "__version__", "process"), module


@pytest.mark.parametrize("path", LIBRARY, ids=name_of)
def test_library_neither_prints_nor_knows_the_command_line(path):
    assert not any(module.partition(".")[0] in ("click", "rich") for module in imports(path))
    assert not any(module.startswith("sssfit.cli") for module in imports(path))
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id != "print", f"line {node.lineno}"


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_only_charts_import_matplotlib(path):
    if room_of(module_of(path)) != "chart" or path.stem in LIGHT_CHART_FILES:
        assert not any(module.partition(".")[0] == "matplotlib" for module in imports(path))
