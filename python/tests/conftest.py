"""Shared fixtures. scripts/test-python runs the tests with the installed wheel and the program in CAMLUX_PROGRAM."""

import os
import subprocess
from pathlib import Path

import camlux
import numpy as np
import pytest

REPOSITORY = Path(__file__).parents[2]
SCENES = REPOSITORY / "scenes"


@pytest.fixture(scope="session")
def device():
    """A device under the validation layer, which must report nothing until the end."""
    device = camlux.Device(validation=True)
    yield device
    assert device.validation_messages == []


@pytest.fixture(scope="session")
def renderer(device):
    return camlux.Renderer(device)


@pytest.fixture
def program():
    """A function that runs the command line program and returns its stdout."""

    def run(*arguments, cwd=None):
        done = subprocess.run([os.environ["CAMLUX_PROGRAM"], *map(str, arguments)], capture_output=True, text=True, cwd=cwd)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture
def scene():
    """A scene from arrays: a floor and a wall lit by a point light."""
    floor = camlux.Mesh("floor", np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], np.float32), [[0, 1, 2], [0, 2, 3]])
    wall = camlux.Mesh("wall", [[-1.0, 0, -1], [1, 0, -1], [1, 2, -1], [-1, 2, -1]], [[0, 1, 2], [0, 2, 3]], material=1)
    return camlux.Scene(
        camera=camlux.Camera((32, 24), position_m=(0, 1, 3), look_at_m=(0, 0.7, 0), fov_y_deg=45),
        lights=[camlux.PointLight((0.2, 1, 0.1), power_w=20)],
        meshes=[floor, wall],
        materials=[camlux.Material("white", kd=0.8), camlux.Material("red", kd=(0.7, 0.1, 0.1))],
        indirect=camlux.FinalGather(target_error=0.1),
    )
