"""What a frame takes on the host when nothing changed and when the camera moved: python frame_times.py SCENE"""

import statistics
import sys
import time

import lightgraph as lg

GRAPH = "lightgraph:graphs/gi/fast_grid.ron"


def main(scene: str, frames: int = 500) -> dict[str, tuple[float, float]]:
    """By what changed: median milliseconds of a frame, and of the device in it."""
    renderer = lg.Renderer(GRAPH, scene, size=(128, 128), grid=(4, 4, 4))
    renderer.frame()
    seen = renderer.camera

    def turn(i: int) -> None:
        eye = (seen.eye[0] + 0.01 * (1 + i % 50), *seen.eye[1:])
        renderer.camera = lg.Camera(eye, seen.target, seen.fov)

    found = {}
    for name, before in [("nothing changed", lambda i: None), ("the camera moved", turn)]:
        took, device = [], []
        for i in range(frames):
            before(i)
            start = time.perf_counter()
            renderer.frame()
            took.append(1e3 * (time.perf_counter() - start))
            device.append(renderer.stats["device_ms"] or 0.0)
        found[name] = statistics.median(took), statistics.median(device)
        print(f"{name:<18} {found[name][0]:8.3f} ms, of them {found[name][1]:.3f} on {lg.adapter()[0]}")
    return found


if __name__ == "__main__":
    main(sys.argv[1])
