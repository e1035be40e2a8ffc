"""Runs the Python blocks of the manual that are marked `run`, page by page, in a folder that looks like the repository."""

import os
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[2]
BLOCK = re.compile(r"^```python run\n(.*?)^```", re.MULTILINE | re.DOTALL)
PAGES = {
    str(page.relative_to(ROOT)): "\n".join(BLOCK.findall(page.read_text(encoding="utf-8")))
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
}
# Shell blocks run, too, because Python blocks may use their output.
BEFORE = re.compile(r"^```(sh|python) run\n(.*?)^```", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", [page for page, code in PAGES.items() if code])
def test_blocks_run(page, tmp_path):
    for name in ("docs", "examples", "scenes"):
        (tmp_path / name).symlink_to(ROOT / name)
    program = pathlib.Path(os.environ.get("CAMLUX_PROGRAM", ROOT / "target/release/camlux"))
    environment = dict(os.environ, PATH=f"{program.parent}:{os.environ['PATH']}")
    for language, code in BEFORE.findall((ROOT / page).read_text(encoding="utf-8")):
        command = ["bash", "-euo", "pipefail", "-c"] if language == "sh" else [sys.executable, "-c"]
        done = subprocess.run([*command, code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_there_are_such_blocks():
    assert sum(map(bool, PAGES.values())) >= 3
