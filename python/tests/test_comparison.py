"""Comparisons and reference images."""

import json

import camlux
import numpy as np
import pytest


def test_a_comparison_is_the_programs(renderer, scene, program, tmp_path):
    image, reference = renderer.render(scene), camlux.reference(scene, samples_per_pixel=64)
    assert {"stderr", "edge"} <= set(reference)
    image.save(tmp_path / "image.exr")
    reference.save(tmp_path / "reference.exr")
    report = json.loads(program("compare", tmp_path / "image.exr", tmp_path / "reference.exr", "--json"))
    files = camlux.read_exr(tmp_path / "image.exr"), camlux.read_exr(tmp_path / "reference.exr")
    assert {theirs["name"] for theirs in report["layers"]} == {"indirect", "direct", "radiance"}
    for theirs in report["layers"]:
        for images in (image, reference), files:
            ours = camlux.compare(*images, theirs["name"])
            assert ours.value_count == theirs["value_count"] and ours.image_mean == theirs["image_mean"]
            for name, of_program in {"rel_rmse": "relative_rmse", "bias": "bias", "mean_absolute": "mean_relative_error", "percentile_99": "percentile_99"}.items():
                assert getattr(ours, name) == theirs["errors"][of_program]
    ours = camlux.compare(image, reference, "indirect")
    assert ours.rel_rmse_without_noise or ours.rel_rmse_below
    assert 0 < ours.noise_floor < 0.5


def test_arrays_are_compared_by_the_formulas():
    rng = np.random.default_rng(3)
    t = rng.uniform(0.5, 1.5, (5, 7, 3)).astype(np.float32)
    x = (t + rng.normal(0, 0.1, t.shape)).astype(np.float32)
    found = camlux.compare(x, t)
    d, t64 = x.astype(float) - t, t.astype(float)
    assert found.rel_rmse == pytest.approx(np.sqrt((d**2).sum() / (t64**2).sum()))
    assert found.bias == pytest.approx(d.sum() / t64.sum())
    assert found.mean_absolute == pytest.approx(abs(d).sum() / t64.sum())
    assert found.value_count == t.size and found.noise_floor is None and found.edge_pixels == 0
    assert camlux.compare(t[..., 0], t[..., 0]).rel_rmse == 0
    assert camlux.compare(t, np.zeros_like(t)).rel_rmse is None
    with pytest.raises(ValueError, match="both the same shape"):
        camlux.compare(t, t[:4])


def test_a_reference_is_as_exact_as_asked_for(scene):
    seen = []
    reference = camlux.reference(scene, stderr=0.05, progress=seen.append)
    noise = np.sqrt((reference["stderr"] ** 2).sum() / (reference["indirect"] ** 2).sum())
    assert 0 < noise <= 0.05 and seen[-1] == pytest.approx(1, abs=0.2)
    for wrong in [{}, {"stderr": 2}, {"stderr": 0.1, "samples_per_pixel": 4}, {"samples_per_pixel": 0}]:
        with pytest.raises(ValueError, match="give"):
            camlux.reference(scene, **wrong)


def test_a_frame_meets_its_error(renderer, scene):
    scene.indirect = camlux.FinalGather(0.03)
    found = camlux.compare(renderer.render(scene), camlux.reference(scene, stderr=0.01), "indirect")
    assert (found.rel_rmse_without_noise or found.rel_rmse_below) < 0.05
