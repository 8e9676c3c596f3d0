"""Finds the light that a picture was made with: scipy moves the scene's first light until the picture fits.

`python fit.py SCENE`
"""

import sys

import numpy as np
from scipy.optimize import minimize

import lightgraph as lg


def main(scene: str, steps: int = 60) -> tuple[np.ndarray, np.ndarray]:
    renderer = lg.Renderer("lightgraph:graphs/gi/direct.ron", scene, size=(48, 48))
    light = renderer.scene.lights[0]
    start = np.array(renderer.position(light))
    wanted = start + (0.25, -0.2, 0.15)
    renderer.move(light, to=wanted)
    reference = renderer.frame()["color"]

    def error(place: np.ndarray) -> float:
        renderer.move(light, to=place)
        return lg.compare(renderer.frame()["color"], reference)["rmse_percent"]

    found = minimize(
        error, start, method="Nelder-Mead", options={"maxfev": steps, "initial_simplex": start + 0.3 * np.eye(4, 3)}
    )
    print(
        f"{light}: found {found.x.round(3)}, made with {wanted.round(3)}, "
        f"error {found.fun:.2f} % after {found.nfev} frames"
    )
    return found.x, wanted


if __name__ == "__main__":
    main(sys.argv[1])
