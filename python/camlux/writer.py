"""Writes a data set from a loop."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Literal

from ._camlux import DatasetOptions, Frame, Renderer, SceneState, hash_files
from ._fields import knows_its_arguments
from .errors import ArgumentError, CamluxWarning, Cancelled, Error, FileError
from .scene import Scene


class DatasetWriter:
    """Renders the frames of a loop into a data set like those of `camlux batch`, which camlux.Dataset reads.

        with camlux.DatasetWriter("set", scene) as writer:
            for index in range(20):
                scene.camera.position_m = (0.1 * index, 1, 3)
                writer.render(scene, target_error=0.05)

    The same loop run again continues where it was stopped or killed: frames that are there are not rendered again, unless their scene or
    their settings have changed. A shorter loop keeps the frames that it does not reach, and warns of them.
    """

    folder: Path

    @knows_its_arguments
    def __init__(
        self,
        folder: str | os.PathLike[str],
        scene: Scene,
        *,
        renderer: Renderer | None = None,
        flow: bool = False,
        layers: str | Sequence[str] | None = None,
        half: bool = False,
        compression: Literal["none", "rle", "zips", "zip", "piz"] | None = None,
        plain: bool = False,
        multipart: bool = False,
        format: Literal["exr", "npz"] = "exr",
        depth_png: bool = False,
    ) -> None:
        """scene: what the manifest's mesh poses and changed materials are relative to; the scene before the loop.

        renderer: None: one on the best device. flow: adds the layers flow and scene_flow, from each frame to the next; a mesh that is
        replaced has none. layers: writes only these; also layers on request, and those of a sequence such as flow_backward.
        half, plain, multipart: as for Frame.save. compression: likewise; None: rle, or none of npz files.
        format: OpenEXR files, or archives of numpy, without a header. depth_png: also a PNG of the depth, 16 bits, millimetres.
        """
        self.folder = Path(folder)
        self._renderer = renderer or Renderer()
        self._options = DatasetOptions(flow, layers, half, compression, plain, multipart, format, depth_png)
        #: Whether there is flow to the next frame and to the previous one, and occlusion there.
        (self._to_next, self._hidden_next), (self._to_previous, self._hidden_previous) = self._options.flow
        self._layers = None if layers is None else [layers] if isinstance(layers, str) else list(layers)
        self._settings = [flow, self._layers, half, compression, plain, multipart, format, depth_png]
        self._plain, self._format, self._depth_png = plain, format, depth_png
        self._base = SceneState(scene)
        # A loop may render with a target_error, and so with indirect light.
        self._options.check(self._base, True)
        self._about: dict[str, Any] = json.loads(self._options.describe(self._base))
        _refuse_job(self.folder)
        (self.folder / "frames").mkdir(parents=True, exist_ok=True)
        self._lock = _lock(self.folder / ".manifest.jsonl.lock")
        for unfinished in (self.folder / "frames").glob(".*.part"):
            unfinished.unlink(missing_ok=True)
        self._lines = _read_lines(self.folder / "manifest.jsonl")
        self._write_lines()
        self._write_about(None)
        self._next = 0
        #: The frame before, whose flow needs the next one: its state, its frame (None: it was there), and its line.
        self._held: tuple[SceneState, Frame | None, dict[str, Any]] | None = None
        #: The state of the frame before, and of the one before that frame.
        self._before: tuple[SceneState | None, SceneState | None] = (None, None)

    def render(self, scene: Scene, **options: Any) -> Frame | None:
        """Renders the next frame and writes it. options: those of Renderer.render; frame_index is that in the data set unless given.

        Returns None if the frame is there from an earlier run. With flow, the file is written once the next frame is known.
        An error of the render is recorded in the manifest and raised; the same loop run again tries the frame again.
        """
        index = self._next
        self._next += 1
        options.setdefault("frame_index", index)
        try:
            state = SceneState(scene)
            self._check_layers(state, options)
        except Error as error:
            self._end_held(None)
            self._before = (None, None)
            self._lines.pop(index, None)
            self._append({"index": index, "scene": "scene", "frame": index, "error": str(error)})
            raise
        self._end_held(state)
        self._before = (state, self._before[0])
        description = json.loads(state.describe(self._base))
        line = {"index": index, "scene": "scene", "frame": index, "time_s": None, **description, "seed": options.get("seed")}
        inputs = self._inputs(state, description, options)
        kept = self._lines.get(index)
        if kept is not None and kept.get("inputs") == inputs and self._is_there(kept):
            self._held = (state, None, kept)
            return None
        self._lines.pop(index, None)
        ending = {"device": self._renderer.device.info.name, "inputs": inputs}
        try:
            frame = self._renderer.render(scene, **{**options, **self._layers_to_render(state, options)})
        except Cancelled:
            raise
        except Error as error:
            self._append({**line, "error": str(error), **ending})
            raise
        line["ending"] = ending
        first = self._about["scenes"][0]
        if frame.mesh_names != first["meshes"]:
            line["mesh_names"] = frame.mesh_names
        if frame.material_names != first["materials"]:
            line["material_names"] = frame.material_names
        self._held = (state, frame, line)
        if not self._to_next:
            self._end_held(None)
        return frame

    def close(self) -> None:
        """Writes the last frame and the whole manifest. The `with` statement calls it."""
        self._close()

    def _close(self) -> None:
        if self._lock is None:
            return
        later = sorted(index for index in self._lines if index >= self._next)
        if self._held is None or self._held[1] is not None or not later:
            self._end_held(None)
        # Else the frame before is there, with its flow to a frame that stays.
        self._held = None
        self._write_lines()
        self._write_about(max(self._lines, default=-1) + 1 if later else self._next)
        self._release()
        if later:
            problem = f"frames {later[0]} to {later[-1]} are of an earlier loop, which was longer, and stay; to be rid of them, delete the folder first"
            warnings.warn(f"{self.folder}: {problem}", CamluxWarning, stacklevel=3)

    def __enter__(self) -> DatasetWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is None:
            self._close()
        else:
            # The frame before may not be the last one of the loop, so its flow is not known.
            self._held = None
            self._release()

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def _end_held(self, following: SceneState | None) -> None:
        """Writes the frame before, whose next frame is now known."""
        if self._held is None:
            return
        (state, frame, line), self._held = self._held, None
        flow_to = following.hash if self._to_next and following is not None else None
        if frame is None:
            if self._to_next and line.get("flow_to") != flow_to:
                index = line["index"]
                del self._lines[index]
                self._write_lines()
                problem = f"the flow of frame {index} is to another scene than before; run the loop again to render the frame"
                warnings.warn(problem, CamluxWarning, stacklevel=3)
            return
        ending = line.pop("ending")
        index = line["index"]
        file = f"frames/{index:06}.{self._format}"
        others = [self._other(following, self._hidden_next), self._other(self._before[1], self._hidden_previous)]
        paths, digest, size, texts = self._options.write(self.folder / file, index, frame, state, self._base, others)
        if self._depth_png:
            line["depth_png"] = f"frames/{Path(paths.pop()).name}"
        if self._plain:
            first, last = len(f"{index:06}."), -len(".exr")
            line["files"] = {path.name[first:last]: f"frames/{path.name}" for path in map(Path, paths)}
        else:
            line["file"] = file
        stats = frame.stats
        line |= {
            "blake3": digest,
            "bytes": size,
            "ms": round(stats.wall_ms, 3),
            "estimated_error": stats.estimated_error,
            "estimated_error_upper": stats.estimated_error_upper,
            "stop": stats.stop,
            "warnings": texts,
            **ending,
        }
        for key in [
            "estimated_range_error_mm",
            "estimated_range_error_upper_mm",
            "estimated_interpolation_error",
            "estimated_area_light_error",
        ]:
            if (error := getattr(stats, key)) is not None:
                line[key] = error
        if self._to_next:
            line["flow_to"] = flow_to
        self._append(line)

    def _other(self, state: SceneState | None, is_shown: bool) -> tuple[SceneState, Frame | None] | None:
        """The next or the previous frame, and what it shows if occlusion needs that."""
        if state is None:
            return None
        if not is_shown:
            return state, None
        with warnings.catch_warnings():
            # The scene has no light on purpose.
            warnings.simplefilter("ignore", CamluxWarning)
            return state, self._renderer.render(state.geometry(), layers=["range", "id.instance"])  # type: ignore[arg-type]

    def _layers_to_render(self, state: SceneState, options: dict[str, Any]) -> dict[str, Any]:
        """The argument `layers` of the render, if the files need layers on request."""
        if options.get("layers") is not None:
            return {}
        names = self._options.layers_to_render(state, options.get("target_error") is not None)
        return {} if names is None else {"layers": names}

    def _check_layers(self, state: SceneState, options: dict[str, Any]) -> None:
        """Refuses, before a frame is rendered, layers that it will not have."""
        self._options.check(state, options.get("target_error") is not None)
        copied = options.get("layers")
        if copied is None:
            return
        copied = [copied] if isinstance(copied, str) else list(copied)
        due = self._options.rendered_layers
        due += ["range", "id.instance"] if self._to_next or self._to_previous else []
        due += ["N"] if self._hidden_next or self._hidden_previous else []
        missing = [name for name in dict.fromkeys(due) if name not in copied]
        if missing:
            names = ", ".join(missing)
            raise ArgumentError(f"layers is {copied}, and the files of the data set need {names}; add these, or leave out layers")

    def _inputs(self, state: SceneState, description: dict[str, Any], options: dict[str, Any]) -> str:
        # Imported where it is used, as are others of the package: so that `import camlux` is quick.
        import hashlib

        known = {key: value for key, value in options.items() if key != "progress"}
        previous = self._before[1]
        flow_from = [previous.hash] if self._to_previous and previous is not None else []
        parts = [self._about["engine_hash"], state.hash, description, self._settings, known, *flow_from]
        text = json.dumps(parts, sort_keys=True, default=str)
        return hashlib.blake2b(text.encode(), digest_size=32).hexdigest()

    def _is_there(self, line: dict[str, Any]) -> bool:
        files = line["files"].values() if "files" in line else [line.get("file", "")]
        files = [*files, *([line["depth_png"]] if "depth_png" in line else [])]
        return "blake3" in line and hash_files([self.folder / file for file in files]) == line["blake3"]

    def _append(self, line: dict[str, Any]) -> None:
        self._lines[line["index"]] = line
        with open(self.folder / "manifest.jsonl", "a", encoding="utf-8") as manifest:
            manifest.write(json.dumps(line) + "\n")

    def _write_lines(self) -> None:
        lines = [json.dumps(line) + "\n" for _, line in sorted(self._lines.items())]
        _replace(self.folder / "manifest.jsonl", "".join(lines))

    def _write_about(self, count: int | None) -> None:
        about = self._about | {"frame_count": count, "frames_per_scene": count}
        _replace(self.folder / "dataset.json", json.dumps(about, indent=2) + "\n")


def _refuse_job(folder: Path) -> None:
    """Raises an error for the data set of a job, whose manifest a loop would replace."""
    try:
        about = json.loads((folder / "dataset.json").read_text(encoding="utf-8"))
        job = about["job"] and about["job"]["file"]
    except (OSError, ValueError, KeyError, TypeError):
        return
    if job is not None:
        raise FileError(f"{folder}: this is the data set of the job {job}; name another folder")


def _read_lines(path: Path) -> dict[int, dict[str, Any]]:
    """The lines of a manifest by index, without those that a killed run has cut."""
    lines: dict[int, dict[str, Any]] = {}
    if path.exists():
        for text in path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                line = json.loads(text)
                lines[line["index"]] = line
            except (ValueError, TypeError, KeyError):
                continue
    return lines


def _replace(path: Path, text: str) -> None:
    """Replaces a file as a whole."""
    import tempfile

    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    with open(descriptor, "w", encoding="utf-8") as file:
        file.write(text)
    # tempfile makes private files.
    umask = os.umask(0)
    os.umask(umask)
    os.chmod(name, 0o666 & ~umask)
    os.replace(name, path)


def _lock(path: Path) -> IO[str] | None:
    """Locks the manifest as a batch does, so that no other run writes the same frames. A killed run releases the lock, too."""
    file = open(path, "w", encoding="utf-8")
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except ImportError:
        pass  # There is none on this system.
    except BlockingIOError:
        file.close()
        raise Error(f"{path.parent / 'manifest.jsonl'}: another run uses it; wait until that run ends, or name another folder") from None
    return file
