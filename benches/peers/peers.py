"""Renders a camlux scene with Mitsuba 3, alone and denoised by Open Image Denoise; prints what it took as JSON lines.

README.md says what is measured; `run` makes the environment that this needs."""

import argparse
import contextlib
import importlib.metadata
import json
import os
import statistics
import sys
from pathlib import Path

from failure import Failure, Unsupported

VARIANT = "llvm_ad_rgb"
SAMPLES = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024]
PEERS = ["mitsuba", "mitsuba-path", "mitsuba+oidn", "mitsuba+oidn-fast"]
QUICK_SAMPLES = [1, 4, 16, 64]
# Denoising more samples is not useful, because the denoiser's bias remains.
MOST_SAMPLES_DENOISED = 32
# The error falls with the square root of the samples, so the curve beyond this is a straight line.
MOST_SAMPLES_OF_PATH = 256
REFERENCE_SAMPLES = 16384
FIRST_SAMPLES = 64
RUNS = 3
LONG_RUN_SECONDS = 10.0

NOTES = [
    "Timed: rendering direct and indirect light, denoising, writing the OpenEXR file. Not timed: starting Python, "
    "loading the scene, building its acceleration structure, compiling the kernels (0.1 to 1 s) and making the "
    "denoiser. No timed run compiles: checked.",
    "Every frame spends a few milliseconds of Python on tracing its kernels; this is timed.",
    "mitsuba: Mitsuba's rays, materials and lights, but an estimator made for this comparison, in Mitsuba's "
    "favour: the primary hit is traced once a pixel and not once a sample, no sample is spent on direct light, "
    "and the samples are multi-jittered.",
    "mitsuba-path: the plugin path as it is shipped, max_depth 2 above the bounces, independent samples, less the direct light. "
    "With several lights its indirect light holds the noise of choosing one for the direct light.",
    "mitsuba+oidn: the frames of mitsuba with the indirect light denoised in the best quality, guided by albedo "
    "and normals without noise; mitsuba+oidn-fast: in the fastest.",
    "All compute the same number of bounces, with visibility; camlux's estimators may leave visibility out.",
    "Mitsuba is general: it would also render area lights and transmission.",
]

NOTES_OF_TIME_OF_FLIGHT = [
    "Phasors: mitsuba's samples each with cosine and sine of the length of its path; mitransient: its plugin "
    "transient_path as it is shipped, max_depth 2 above the bounces, by rays through the pixels' centres, which its film does not send.",
    "mitsuba-path and the denoised peers have no phasors.",
]


def main() -> int:
    # Mitsuba and the denoiser may print, but standard output is for results only.
    results = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    options = parse_arguments()
    threads = thread_count()
    try:
        run(options, threads, results)
    except Failure as failure:
        print(f"peers: {failure}", file=sys.stderr)
        return 1
    except (RuntimeError, OSError, MemoryError) as error:
        # Mitsuba, Dr.Jit and OpenEXR raise these for files they cannot read or write, and if memory runs out.
        reason = " ".join(str(error).split()) or type(error).__name__
        print(
            f"peers: {options.scene}: {reason}; check the files it names, the space for the output, and the size",
            file=sys.stderr,
        )
        return 1
    return 0


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="benches/peers/run", description=__doc__)
    parser.add_argument("--scene", type=Path, required=True, metavar="SCENE.toml")
    parser.add_argument("--size", type=positive, nargs=2, required=True, metavar=("W", "H"))
    parser.add_argument("--output", type=Path, metavar="FOLDER", help="for the images; made where it is missing")
    parser.add_argument("--quick", action="store_true", help=f"fewer points: {QUICK_SAMPLES} samples a pixel")
    parser.add_argument("--spp", type=sample_counts, metavar="1,2,4", help="samples a pixel")
    parser.add_argument("--check", type=Path, metavar="IMAGE.exr", help="compare with an image instead of measuring")
    parser.add_argument(
        "--reference", type=Path, metavar="IMAGE.exr", help="write an image with the standard error of each pixel instead"
    )
    parser.add_argument("--first", type=Path, metavar="IMAGE.exr", help="write mitsuba's first picture and measure nothing")
    options = parser.parse_args()
    if not (options.check or options.reference or options.first or options.output):
        parser.error("give --output, the folder for the images, or --check, --reference or --first")
    return options


def positive(word: str) -> int:
    number = int(word)
    if number < 1:
        raise argparse.ArgumentTypeError("must be at least 1")
    return number


def sample_counts(word: str) -> list[int]:
    return [positive(number) for number in word.split(",")]


def thread_count() -> int:
    """The number of threads from lavapipe's variable, which also applies to camlux on a CPU."""
    word = os.environ.get("LP_NUM_THREADS", str(os.cpu_count() or 1))
    if not word.isdigit() or int(word) < 1:
        raise SystemExit(f"peers: LP_NUM_THREADS is {word!r}; set it to 1 or more, or unset it")
    return int(word)


def run(options: argparse.Namespace, threads: int, results):
    import scene

    def put(**line):
        print(json.dumps(line), file=results, flush=True)

    try:
        loaded = scene.load(options.scene, tuple(options.size))
        if loaded.has_area_light() and options.check is None:
            raise Unsupported("a light has an area: its direct light is an estimate, which the peers do not time")
    except Unsupported as unsupported:
        put(about="camlux's peers", notes=NOTES)
        for peer in PEERS:
            put(peer=peer, unsupported=str(unsupported))
        return
    except (KeyError, IndexError, TypeError, ValueError) as error:
        problem = f"{type(error).__name__}: {error}"
        raise Failure(
            f"{options.scene}: cannot be read ({problem}); camlux render says what is wrong with it"
        ) from error

    mi, dr = start_mitsuba(threads, with_transients=options.first is None)
    from tracer import Tracer

    tracer = Tracer(loaded)
    if options.check is not None:
        import check

        compare = check.compare_whole if loaded.has_area_light() else check.compare
        compare(tracer, loaded.size_px, options.check)
        return
    if options.reference is not None:
        import reference

        reference.render(tracer, loaded.size_px, options.spp[-1] if options.spp else REFERENCE_SAMPLES, options.reference)
        return

    from frames import Denoised, Denoiser, PathPlugin, PathTraced, TransientPath

    if options.first is not None:
        PathTraced(tracer, loaded.size_px, options.spp[-1] if options.spp else FIRST_SAMPLES).render(options.first)
        return
    try:
        options.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Failure(f"cannot make the folder {options.output}: {error.strerror}; give another --output") from error
    notes = NOTES + (NOTES_OF_TIME_OF_FLIGHT if loaded.tof else [])
    put(about="Mitsuba 3, alone and denoised by Open Image Denoise, on a scene of camlux", notes=notes)
    mitsuba, oidn = mi.__version__, oidn_version()
    samples = options.spp or (QUICK_SAMPLES if options.quick else SAMPLES)
    size_px = loaded.size_px

    def put_frames(peer: str, version: str, label: str, most_samples: int, frame):
        for spp in samples:
            if spp <= most_samples:
                path = options.output / f"{options.scene.stem}_{peer.replace('+', '_')}_{spp}.exr"
                timed = measure(frame(spp), path, dr)
                put(
                    peer=peer,
                    version=version,
                    variant=VARIANT,
                    label=f"{label}, {VARIANT}, {spp} spp",
                    spp=spp,
                    threads=threads,
                    **timed,
                )

    put_frames("mitsuba", mitsuba, f"Mitsuba {mitsuba}", max(samples), lambda spp: PathTraced(tracer, size_px, spp))
    if loaded.tof:
        mitransient = importlib.metadata.version("mitransient")
        put_frames(
            "mitransient",
            mitransient,
            f"mitransient {mitransient} transient_path",
            MOST_SAMPLES_OF_PATH,
            lambda spp: TransientPath(tracer, size_px, spp),
        )
    put_frames(
        "mitsuba-path",
        mitsuba,
        f"Mitsuba {mitsuba} path",
        MOST_SAMPLES_OF_PATH,
        lambda spp: PathPlugin(tracer, size_px, spp),
    )
    for peer, quality, fast in (("mitsuba+oidn", "", False), ("mitsuba+oidn-fast", " fast", True)):
        denoiser = Denoiser(size_px, threads, fast)
        put_frames(
            peer,
            f"{mitsuba} + {oidn}",
            f"Mitsuba {mitsuba} + OIDN {oidn}{quality}",
            MOST_SAMPLES_DENOISED,
            lambda spp, denoiser=denoiser: Denoised(tracer, size_px, spp, denoiser),
        )


def start_mitsuba(threads: int, with_transients: bool):
    import drjit as dr
    import mitsuba as mi

    try:
        mi.set_variant(VARIANT)
        dr.set_thread_count(threads)
        dr.eval(dr.arange(mi.Float, 2) + 1)
    except (ImportError, RuntimeError) as error:
        raise Failure(
            f"Mitsuba cannot compile for this processor ({str(error).splitlines()[0]}); install a newer LLVM (Debian: "
            "libllvm19) and name its library in DRJIT_LIBLLVM_PATH"
        ) from error
    mi.set_log_level(mi.LogLevel.Error)
    if with_transients:
        # The import registers its plugins.
        import mitransient  # noqa: F401

    return mi, dr


def oidn_version() -> str:
    # The fourth number is the wrapper's own.
    return ".".join(importlib.metadata.version("pyoidn").split(".")[:3])


def measure(frame, path: Path, dr) -> dict:
    """Times several runs of a frame, after a run that compiles. The times of the parts are those of the median run."""
    frame.render(path, iterations=1)
    runs = []
    while len(runs) < RUNS:
        with compiling_nothing(dr):
            runs.append(frame.render(path))
        if total(runs[-1]) > LONG_RUN_SECONDS:
            break
    return {
        "seconds": [total(parts) for parts in runs],
        "seconds_median": statistics.median_low(total(parts) for parts in runs),
        "seconds_of": sorted(runs, key=total)[(len(runs) - 1) // 2],
        "image": str(path),
    }


def total(parts: dict[str, float]) -> float:
    return sum(parts.values())


@contextlib.contextmanager
def compiling_nothing(dr):
    dr.kernel_history_clear()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        yield
    kernels = [kernel for kernel in dr.kernel_history() if kernel["type"] == dr.KernelType.JIT]
    if not kernels or not all(kernel["cache_hit"] for kernel in kernels):
        raise Failure("a timed run compiled a kernel, so its time is not the frame's; please report it with the scene")


if __name__ == "__main__":
    sys.exit(main())
