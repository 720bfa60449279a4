"""The shape of the source tree: who may include whom, and how large a file may grow."""

import ast
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CPP = ROOT / "cpp"

# What each C++ module may use directly, in the order in which the modules build on each other.
ALLOWED: dict[str, set[str]] = {}
ALLOWED["core"] = set()
ALLOWED["projection"] = {"core"}
ALLOWED["proxy"] = {"core"}
ALLOWED["image"] = {"core"}
ALLOWED["shading"] = {"core"}
ALLOWED["envmap"] = {"core", "projection", "proxy", "image"}
ALLOWED["prefilter"] = ALLOWED["envmap"] | {"envmap"}
ALLOWED["surface"] = ALLOWED["envmap"] | {"envmap"}
ALLOWED["scene"] = {"core", "image", "shading"}
# captures the world into a projection, records where the reflector is seen
ALLOWED["tracer"] = ALLOWED["scene"] | ALLOWED["surface"] | {"scene", "surface"}
ALLOWED["inference"] = ALLOWED["surface"] | {"surface"}  # never the tracer
ALLOWED["pem"] = set(ALLOWED)

# Each library is the business of the modules named here, and of their implementation only.
OWNERS = {
    "embree": ("tracer",),
    "OpenEXR": ("image",),
    "OpenImageIO": ("image",),
    "tbb": ("core",),
    "tiny_gltf": ("scene",),
    "tiny_obj_loader": ("scene",),
}

# The parts of the Python package, in the order in which they build on each other; the flat modules are the
# toolbox, which all may use.
PYTHON_FLOORS = ("scene", "pem", "bake", "evaluate", "study", "viewer", "commands")

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)
MAX_LINES = 600
MAX_COLUMNS = 110
MAX_FUNCTION_LINES = 89
"""From its first line to its last, tests and tables included."""
MAX_LIBRARY_LINES = {".py": 400, ".cpp": 500, ".hpp": 500}
"""Of the library's own files."""


def tracked_files() -> list[Path]:
    """Every file that git tracks or would track."""
    listing = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    return [ROOT / line for line in listing.stdout.splitlines() if (ROOT / line).is_file()]


def text_files() -> Iterator[tuple[Path, str]]:
    for path in tracked_files():
        try:
            yield path, path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue


def module_sources() -> Iterator[tuple[str, Path, list[str]]]:
    """Module, path and includes of every file of the library."""
    for area in (CPP / "include" / "mirrorbake", CPP / "src"):
        for path in sorted(area.rglob("*.[ch]pp")):
            yield path.relative_to(area).parts[0], path, INCLUDE.findall(path.read_text(encoding="utf-8"))


def test_every_module_has_its_place_in_the_order() -> None:
    modules = {module for module, _, _ in module_sources()}
    assert {"core", "projection", "envmap", "tracer"} <= modules
    assert modules <= set(ALLOWED)


def test_includes_follow_the_direction_of_dependencies() -> None:
    violations = [
        f"{path.relative_to(ROOT)} includes {include}"
        for module, path, includes in module_sources()
        for include in includes
        if include.startswith("mirrorbake/") and include.split("/")[1] not in ALLOWED[module] | {module}
    ]
    assert not violations


def linked_modules() -> dict[str, set[str]]:
    """Modules that each module links, as its CMakeLists.txt says."""
    links: dict[str, set[str]] = {}
    for path in (CPP / "src").glob("*/CMakeLists.txt"):
        call = re.search(
            r"mirrorbake_add_module\((\w+)\s(.*?)\)", path.read_text(encoding="utf-8"), re.DOTALL
        )
        assert call, path
        depends = re.search(r"DEPENDS\s+([a-z\s]+)", call[2])
        links[call[1]] = set(depends[1].split()) if depends else set()
    return links


def test_link_lines_follow_the_direction_of_dependencies() -> None:
    declared = linked_modules()
    assert declared["projection"] == {"core"}
    violations = [
        f"{module} links {other}"
        for module, others in declared.items()
        for other in others
        if other not in ALLOWED[module]
    ]
    assert not violations


def python_imports() -> Iterator[tuple[Path, str]]:
    """File and module of every import of the package from itself, those for annotations included."""
    package = ROOT / "python" / "mirrorbake"
    for path in sorted(package.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module is not None:
                names = [f"{node.module}.{alias.name}" for alias in node.names]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            else:
                continue
            for name in names:
                if name.startswith("mirrorbake."):
                    yield path.relative_to(package), name


def python_floor(name: str) -> int:
    return PYTHON_FLOORS.index(name) if name in PYTHON_FLOORS else -1


def test_python_imports_go_down_or_stay() -> None:
    violations = [
        f"{path} imports {imported}"
        for path, imported in python_imports()
        if path.name != "__main__.py" and python_floor(imported.split(".")[1]) > python_floor(path.parts[0])
    ]
    assert not violations


def test_modules_link_what_they_include() -> None:
    """What a module includes lies in the closure of what it links, so that it builds on its own."""
    links = linked_modules()

    def closure(module: str) -> set[str]:
        return {module}.union(*(closure(other) for other in links[module]))

    violations = {
        f"{path.relative_to(ROOT)} includes {include}"
        for module, path, includes in module_sources()
        for include in includes
        if include.startswith("mirrorbake/") and include.split("/")[1] not in closure(module)
    }
    assert not violations


@pytest.mark.parametrize("library", OWNERS)
def test_third_party_library_stays_behind_its_module(library: str) -> None:
    headers = CPP / "include"
    violations = [
        str(path.relative_to(ROOT))
        for module, path, includes in module_sources()
        for include in includes
        if include.startswith(library) and (path.is_relative_to(headers) or module not in OWNERS[library])
    ]
    assert not violations


def test_public_headers_are_guarded_and_include_public_headers_by_full_name() -> None:
    for _, path, includes in module_sources():
        if not path.is_relative_to(CPP / "include"):
            continue
        assert path.read_text(encoding="utf-8").startswith("#pragma once\n"), path
        for include in includes:
            if include.endswith(".hpp") and not include.startswith("glm/"):
                assert (CPP / "include" / include).is_file(), f"{path} includes {include}"


def test_no_source_file_is_too_long_to_read() -> None:
    suffixes = {".cpp", ".hpp", ".py", ".cmake", ".txt", ".toml", ".ts", ".js", ".html", ".css"}
    too_long = {
        str(path.relative_to(ROOT)): lines
        for path, text in text_files()
        if path.suffix in suffixes and (lines := text.count("\n")) > MAX_LINES
    }
    assert not too_long


def test_no_file_of_the_library_is_two() -> None:
    too_long = {
        str(path.relative_to(ROOT)): lines
        for path, text in text_files()
        if path.is_relative_to(ROOT / "python") or path.is_relative_to(CPP)
        if path.suffix in MAX_LIBRARY_LINES and (lines := text.count("\n")) > MAX_LIBRARY_LINES[path.suffix]
    }
    assert not too_long


def cpp_functions(text: str) -> Iterator[tuple[int, int]]:
    """First line and length of functions and of blocks in classes, in files as clang-format leaves them.

    Their closing brace stands alone in the column in which their first line begins.
    """
    raw_string = re.compile(r'R"(\w*)\(.*?\)\1"', re.DOTALL)
    lines = raw_string.sub(lambda match: "\n" * match[0].count("\n") + '    ""', text).splitlines()
    for end, line in enumerate(lines):
        if line not in {"}", "  }"}:
            continue
        column = len(line) - 1
        for start in range(end - 1, -1, -1):
            first = lines[start].lstrip()
            indented = len(lines[start]) - len(first)
            if first and indented <= column and not first.startswith(("#", ")", "}", "//", ":")):
                yield start + 1, end - start + 1
                break


def python_functions(text: str) -> Iterator[tuple[int, int]]:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.end_lineno is not None:
            yield node.lineno, node.end_lineno - node.lineno + 1


def test_functions_are_measured_from_their_first_line_to_their_last() -> None:
    code = 'int f(int a,\n      int b) {\n  return R"(\n}\n)";\n}\n\nstruct S {\n  void g() {\n  }\n};\n'
    assert list(cpp_functions(code)) == [(1, 6), (9, 2)]
    assert list(python_functions("@a\ndef f(\n    b,\n):\n    pass\n")) == [(2, 4)]


def test_no_function_is_too_long_to_read() -> None:
    too_long = [
        f"{path.relative_to(ROOT)}:{line}: {length} lines"
        for path, text in text_files()
        if path.suffix in {".cpp", ".hpp", ".py"}
        for line, length in (python_functions if path.suffix == ".py" else cpp_functions)(text)
        if length > MAX_FUNCTION_LINES
    ]
    assert not too_long


def test_texts_of_bindings_that_take_several_lines_are_raw_strings() -> None:
    """Not literals side by side, which fall apart wherever a line happens to end."""
    literal = r'"(?:[^"\\\n]|\\.)*"'
    side_by_side = re.compile(rf'(?<![\w"\\]){literal}(?:\s*\n\s*{literal})+')
    ragged = [
        f"{path.relative_to(ROOT)}: {match[0].splitlines()[0]}"
        for path in sorted((CPP / "bindings").glob("*.cpp"))
        for match in side_by_side.finditer(path.read_text(encoding="utf-8"))
    ]
    assert not ragged


def test_comments_of_the_library_fit_the_columns() -> None:
    """What clang-format leaves alone; the rows of tables are as wide as they are."""
    too_wide = [
        f"{path.relative_to(ROOT)}:{number}"
        for path, text in text_files()
        if path.suffix in {".cpp", ".hpp"} and path.is_relative_to(CPP)
        for number, line in enumerate(text.splitlines(), 1)
        if len(line) > MAX_COLUMNS and "//" in line and not line.lstrip().startswith("/// |")
    ]
    assert not too_wide


def test_files_hold_no_unfinished_work_and_no_private_paths() -> None:
    # Written in pieces, so that this file passes its own test.
    words = re.compile(r"\b(TO" + r"DO|FIX" + r"ME|X" + r"XX)\b|^#if 0$", re.MULTILINE)
    private = re.compile(r"(?<![\w.$}])/(?:home|root|work|Users)/")
    hits = [
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path, text in text_files()
        for match in (words.search(text), private.search(text))
        if match
    ]
    assert not hits
