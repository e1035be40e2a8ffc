"""Runs the Python blocks of the manual that are marked `run`, page by page, in a folder that looks like the repository, and checks their types.

The blocks of a page are one program. A block with a main guard is a program of its own, because the processes that it starts import it.
"""

import os
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[2]
BLOCK = re.compile(r"^```(sh|python) run\n(.*?)^```", re.MULTILINE | re.DOTALL)
PAGES = {
    str(page.relative_to(ROOT)): BLOCK.findall(page.read_text(encoding="utf-8"))
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
}
# Shell blocks run, too, because Python blocks may use their output.
PAGES = {page: blocks for page, blocks in PAGES.items() if any(language == "python" for language, _ in blocks)}
CHECKERS = {
    "mypy": [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "."],
    "pyright": [f"{pathlib.Path(sys.executable).parent}/basedpyright", "--pythonpath", sys.executable, "--level", "error", "."],
}


def is_program(code):
    return "__main__" in code


def programs(page, run):
    """The names and texts of a page's Python programs. `run`: whether the first one also runs the shell blocks and the other programs."""
    name = page.replace("/", "_").removesuffix(".md").replace("-", "_").lower()
    first, others = "", {}
    for language, code in PAGES[page]:
        command = ["bash", "-euo", "pipefail", "-c", code]
        if language == "python" and not is_program(code):
            first += code
            continue
        if language == "python":
            others[f"{name}_{len(others)}.py"] = code
            command = [sys.executable, list(others)[-1]]
        if run:
            first += f"import subprocess as _subprocess\n_subprocess.run({command!r}, check=True)\n"
    return {f"{name}.py": first, **others}


@pytest.mark.parametrize("page", PAGES)
def test_blocks_run(page, tmp_path):
    for name in ("docs", "examples", "scenes"):
        (tmp_path / name).symlink_to(ROOT / name)
    texts = programs(page, run=True)
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    program = pathlib.Path(os.environ.get("CAMLUX_PROGRAM", ROOT / "target/release/camlux"))
    environment = dict(os.environ, PATH=f"{program.parent}:{os.environ['PATH']}")
    done = subprocess.run([sys.executable, next(iter(texts))], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("checker", CHECKERS)
def test_blocks_have_right_types(checker, tmp_path):
    for page in PAGES:
        for name, text in programs(page, run=False).items():
            (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "use.py").write_text((ROOT / "python/tests/types_of_users.py").read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "pyrightconfig.json").write_text('{"typeCheckingMode": "standard"}', encoding="utf-8")
    done = subprocess.run(CHECKERS[checker], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_there_are_such_blocks():
    assert len(PAGES) >= 3
