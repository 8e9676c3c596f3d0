"""A scene as JSON, for renderers that run in an environment of their own. Arrays are base64 of little-endian numbers."""

import base64
import json
import subprocess

import image_files
import numpy as np
import peer
from gltf import Unsupported


def render(command, name, scene, args, settings, outdoors=False):
    """Runs `command JOB.json FOLDER` and yields the lines of JSON that it prints. Ends this one where it fails. With
    `outdoors` the command knows directional lights and panoramas."""
    if not outdoors and any(light.kind == "directional" for light in scene.lights):
        peer.absent(f"{name}: directional lights are not translated")
    if not outdoors and scene.panorama is not None:
        peer.absent(f"{name}: panoramas are not translated")
    for material in scene.materials:
        try:
            material.only_matte(name)
        except Unsupported as why:
            peer.absent(str(why))
    folder = (args.out / name).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    job = folder / "job.json"
    job.write_text(json.dumps(stated(scene, args.size, settings)))
    done = subprocess.run([*map(str, command), str(job), str(folder)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        reason = [line for line in done.stderr.splitlines() if line.strip()]
        peer.absent(f"{name} ended with {done.returncode}: {reason[-1] if reason else 'it gives no reason'}")
    return folder, [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def stated(scene, size, settings):
    """Everything that the script needs, as JSON; arrays as base64."""
    camera = scene.cameras[scene.camera]
    return {
        "size": size,
        "settings": settings,
        "camera": {k: np.asarray(getattr(camera, k), float).tolist() for k in ("position", "right", "up", "forward")}
        | {"yfov": camera.yfov},
        "panorama": None if scene.panorama is None else str(scene.panorama.resolve()),
        "materials": [
            {
                "albedo": list(m.albedo),
                "emission": list(m.emission),
                "double_sided": m.double_sided,
                "picture": picture(m.picture),
            }
            for m in scene.materials
        ],
        "meshes": [
            {
                "positions": packed(m.positions, np.float32),
                "normals": None if m.normals is None else packed(m.normals, np.float32),
                "uv": None if m.uv is None else packed(m.uv, np.float32),
                "faces": packed(m.faces, np.uint32),
                "material": m.material,
            }
            for m in scene.meshes
        ],
        "lights": [
            {
                "kind": light.kind,
                "position": light.position.tolist(),
                "direction": light.direction.tolist(),
                "intensity": list(light.intensity),
                "inner": float(np.arccos(light.cos_inner)),
                "outer": float(np.arccos(light.cos_outer)),
            }
            for light in scene.lights
        ],
    }


def picture(picture):
    if picture is None:
        return None
    linear = image_files.decoded(picture.data)
    height, width = linear.shape[:2]
    rgba = np.ones((height, width, 4))
    rgba[..., :3] = linear
    return {"width": width, "height": height, "texels": packed(rgba, np.float16)}


def packed(array, kind):
    return base64.b64encode(np.ascontiguousarray(array, dtype=kind).tobytes()).decode()
