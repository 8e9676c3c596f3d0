"""What a frame takes when nothing changed and when the camera moved, and what of it is Python's:
python frame_times.py SCENE

The images stay on the device. `in Rust` is the library's call within the same frame; the rest is what Python adds.
"""

import statistics
import sys
import time

import lightgraph as lg

GRAPH = "lightgraph:graphs/gi/fast_grid.ron"


def main(scene: str, frames: int = 200, size: tuple[int, int] = (640, 480)) -> dict[str, tuple[float, float]]:
    """By what changed: median milliseconds of a frame from Python, and of the same in Rust."""
    renderer = lg.Renderer(GRAPH, scene, size=size, grid=(4, 4, 4))
    renderer.frame()
    seen = renderer.camera

    def turn(i: int) -> None:
        eye = (seen.eye[0] + 0.01 * (1 + i % 50), *seen.eye[1:])
        renderer.camera = lg.Camera(eye, seen.target, seen.fov)

    found = {}
    for name, change in [("nothing changed", lambda i: None), ("the camera moved", turn)]:
        took, rust = [], []
        for i in range(frames):
            start = time.perf_counter()
            change(i)
            renderer.frame(outputs=[])
            took.append(1e3 * (time.perf_counter() - start))
            rust.append(renderer.stats["call_ms"])
        found[name] = statistics.median(took), statistics.median(rust)
        more = statistics.median(a - b for a, b in zip(took, rust))
        print(f"{name:<18} {found[name][0]:8.3f} ms, in Rust {found[name][1]:.3f} ms; from Python {more:+.3f} ms")
    return found


if __name__ == "__main__":
    main(sys.argv[1])
