"""What this engine draws, against Cycles in the same Blender, of the same file."""

import bpy
import numpy as np
import pytest

import lightgraph as lg
import scenes


def cycles(samples, bounces):
    scene = bpy.context.scene
    settings = scene.cycles
    settings.device, settings.samples, settings.use_denoising = "CPU", samples, False
    settings.use_adaptive_sampling = False
    # Light at the centre of each pixel, as lightgraph has it, and no clamp.
    settings.pixel_filter_type, settings.filter_width = "BLACKMAN_HARRIS", 0.01
    settings.sample_clamp_direct = settings.sample_clamp_indirect = 0
    settings.max_bounces = settings.diffuse_bounces = bounces
    settings.caustics_reflective = settings.caustics_refractive = False
    settings.use_light_tree = False
    settings.blur_glossy = 0
    if hasattr(settings, "light_sampling_threshold"):
        settings.light_sampling_threshold = 0
    scene.render.threads_mode, scene.render.threads = "FIXED", 2


def inner(image):
    """Pixels away from edges: where neighbours differ by less than a quarter."""
    grey = image.mean(axis=2)
    grown = np.pad(grey, 1, mode="edge")
    around = np.stack([grown[dy : dy + grey.shape[0], dx : dx + grey.shape[1]] for dy in range(3) for dx in range(3)])
    low, high = around.min(axis=0), around.max(axis=0)
    return high - low < 0.25 * high + 1e-3


@pytest.mark.parametrize("scene", scenes.DIRECT, ids=lambda s: s.__name__)
def test_direct_light(scene, empty, rendered, record_property):
    scene()
    ours = rendered(graph=graph("direct"), emitter_samples=2048, environment_samples=256)
    cycles(512, 0)
    wanted = rendered("CYCLES")
    mask = inner(wanted) & inner(ours)
    found = lg.compare(ours, wanted, mask)
    all_of_it = lg.compare(ours, wanted)
    lg.write(rendered.out(f"{scene.__name__}-difference.png"), np.abs(ours - wanted))
    print(f"{scene.__name__}: direct rmse {found['rmse_percent']:.3f} % bias {found['bias_percent']:+.3f} %",
          f"({mask.mean():.0%} of the pixels; of all {all_of_it['rmse_percent']:.2f} %)")
    assert mask.mean() > 0.7
    assert found["rmse_percent"] <= 1.0
    assert abs(found["bias_percent"]) <= 0.5


def means(images, mask):
    """The mean of independent images over what a mask leaves of blocks of 8 × 8 pixels, and its standard errors."""

    def blocks(image):
        return image.reshape(image.shape[0] // 8, 8, image.shape[1] // 8, 8, -1).mean(axis=(1, 3))

    share = blocks(mask)
    kept = share[:, :, 0] > 0.3
    all_of_them = np.array([(blocks(i * mask)[kept] / share[kept]) for i in images])
    return all_of_them.mean(axis=0), all_of_them.std(axis=0, ddof=1) / np.sqrt(len(images))


@pytest.mark.parametrize("scene", scenes.ALL, ids=lambda s: s.__name__)
def test_all_of_the_light(scene, empty, rendered):
    scene()
    size = empty.render
    size.resolution_x, size.resolution_y = size.resolution_x // 2, size.resolution_y // 2
    ours = [rendered(graph=graph("pathtrace"), rounds_final=32, samples=8, bounces=8, seed=i) for i in range(8)]
    cycles(512, 8)
    wanted = []
    for seed in range(4):
        empty.cycles.seed = seed
        wanted.append(rendered("CYCLES"))
    mask = (inner(np.mean(ours, axis=0)) & inner(np.mean(wanted, axis=0)))[:, :, None].astype(np.float32)
    (a, error_a), (b, error_b) = means(ours, mask), means(wanted, mask)
    error = np.sqrt(error_a**2 + error_b**2)
    # Noise of one block tells nothing of another.
    whole = abs(a.mean() - b.mean()) / (np.sqrt((error**2).sum()) / error.size)
    # Of four images a standard error is known to a third, and what is exact in both has none.
    inside = np.abs(a - b) <= 3 * error + 1e-3 * b.mean()
    bias = 100 * (a.mean() / b.mean() - 1)
    print(
        f"{scene.__name__}: pathtrace {bias:+.3f} % from Cycles, {whole:.2f} standard errors;",
        f"{inside.mean():.1%} of the blocks within 3",
    )
    assert whole <= 3
    assert inside.mean() > 0.95


def graph(name):
    return next(g for g in lg.builtin_graphs() if g.endswith(f"/{name}.ron"))
