"""A scene of gltf.py as Radiance's files, and light along rays by its `rtrace`."""

import os
import subprocess
from pathlib import Path

import image_files
import numpy as np
import pyradiance
from gltf import Unsupported

HOME = Path(pyradiance.__file__).parent
ENVIRONMENT = {"PATH": f"{HOME}/bin:/usr/bin:/bin", "RAYPATH": f".:{HOME}/lib"}

# Radiance has no lights without size: a lamp is a ball of this radius (m), far smaller than any distance lit from it.
LAMP_RADIUS = 1e-3
# Nor directional ones: the sun is a disc of this many degrees.
SUN_ANGLE = 0.01

# Brightness of a spot in the direction D of the ray that looks at it: KHR_lights_punctual's cone.
# A1 to A3: direction of the light; A4: cos outer; A5: cos inner − cos outer.
SPOT_CAL = """
across = -(Dx*A1 + Dy*A2 + Dz*A3) - A4;
share = across / A5;
corr = if(share, if(share - 1, 1, share*share), 0);
"""


def build(scene, folder):
    """Writes the scene into `folder` and compiles it. Returns the octree's path."""
    if scene.panorama is not None:
        raise Unsupported("Radiance: panoramas are not translated")
    if all(max(m.emission) > 0 for m in scene.materials):
        raise Unsupported("Radiance's surfaces either emit or reflect; walls that do both can't be stated")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "spot.cal").write_text(SPOT_CAL)
    text = [material(m, i, folder) for i, m in enumerate(scene.materials)]
    text += [lamp(l, i) for i, l in enumerate(scene.lights)]
    text += [shape(m, i, scene, folder) for i, m in enumerate(scene.meshes)]
    (folder / "scene.rad").write_text("\n".join(text))
    with open(folder / "scene.oct", "wb") as out:
        tool(["oconv", "-r", "65536", "scene.rad"], folder, stdout=out)
    return folder / "scene.oct"


def material(m, index, folder):
    m.only_matte("Radiance")
    if max(m.emission) > 0:
        return f"void light m{index} 0 0 3 {numbers(m.emission)}"
    pattern = "void" if m.picture is None else f"p{index}"
    return f"{picture(m, index, folder)}{pattern} plastic m{index} 0 0 5 {numbers(m.albedo)} 0 0"


def picture(m, index, folder):
    if m.picture is None:
        return ""
    rgb = image_files.decoded(m.picture.data)
    image_files.write(folder / f"p{index}.hdr", rgb)
    # A picture's shorter edge is 1 long; glTF's v counts from the top.
    height, width = rgb.shape[:2]
    across, up = width / min(width, height), height / min(width, height)
    (folder / f"p{index}.cal").write_text(f"u = {across} * frac(Lu);\nv = {up} * frac(Lv);\nfrac(x) : x - floor(x);\n")
    return f"void colorpict p{index} 7 red green blue p{index}.hdr p{index}.cal u v 0 0\n"


def lamp(l, index):
    if l.kind == "directional":
        radiance = [i / (np.pi * np.sin(np.radians(SUN_ANGLE / 2)) ** 2) for i in l.intensity]
        return (
            f"void light lamp{index} 0 0 3 {numbers(radiance)}\n"
            f"lamp{index} source sun{index} 0 0 4 {numbers(-l.direction)} {SUN_ANGLE}"
        )
    radiance = [i / (np.pi * LAMP_RADIUS**2) for i in l.intensity]
    pattern, text = "void", ""
    if l.kind == "spot":
        width = max(l.cos_inner - l.cos_outer, 0.001)
        cone = f"{numbers(l.direction)} {l.cos_outer:.9g} {width:.9g}"
        pattern, text = f"cone{index}", f"void brightfunc cone{index} 2 corr spot.cal 0 5 {cone}\n"
    return (
        f"{text}{pattern} light lamp{index} 0 0 3 {numbers(radiance)}\n"
        f"lamp{index} sphere ball{index} 0 0 4 {numbers(l.position)} {LAMP_RADIUS}"
    )


def shape(m, index, scene, folder):
    """A light as one polygon, for Radiance samples it by its shape; other triangles as polygons or as a mesh."""
    if max(scene.materials[m.material].emission) > 0:
        corners = outline(m)
        return f"m{m.material} polygon s{index} 0 0 {3 * len(corners)} {numbers(np.ravel(corners))}"
    if m.normals is None and m.uv is None:
        corners = m.positions[m.faces].reshape(-1, 9)
        return "\n".join(f"m{m.material} polygon s{index}.{k} 0 0 9 {numbers(c)}" for k, c in enumerate(corners))
    lines = ["v " + numbers(p) for p in m.positions]
    lines += ["vn " + numbers(n) for n in m.normals] if m.normals is not None else []
    # Upwards, as Radiance's pictures are.
    lines += [f"vt {u:.9g} {1 - v:.9g}" for u, v in m.uv] if m.uv is not None else []
    corner = {
        (False, True): "{0}/{0}",
        (True, False): "{0}//{0}",
        (True, True): "{0}/{0}/{0}",
    }[m.normals is not None, m.uv is not None]
    lines += ["f " + " ".join(corner.format(i) for i in face) for face in m.faces + 1]
    (folder / f"s{index}.obj").write_text("\n".join(lines) + "\n")
    tool(["obj2mesh", f"s{index}.obj", f"s{index}.rtm"], folder)
    return f"m{m.material} mesh s{index} 1 s{index}.rtm 0 0"


def outline(m):
    """The corners of a flat mesh without holes, in order: along the edges that only one triangle has."""
    points = [tuple(p) for p in m.positions]
    edges = {(points[f[k]], points[f[(k + 1) % 3]]) for f in m.faces for k in range(3)}
    follows = {a: b for a, b in edges if (b, a) not in edges}
    start = min(follows)
    corners = [start]
    while follows[corners[-1]] != start and len(corners) <= len(follows):
        corners.append(follows[corners[-1]])
    offsets = np.array(corners, float) - start
    if len(corners) != len(follows) or np.linalg.matrix_rank(offsets, tol=1e-4) > 2:
        raise Unsupported("lights of Radiance are flat polygons; other emissive shapes are not translated")
    return corners


def numbers(values):
    return " ".join(f"{v:.9g}" for v in values)


def tool(command, folder, **options):
    result = subprocess.run(command, cwd=folder, env=ENVIRONMENT, stderr=subprocess.PIPE, check=False, **options)
    if result.returncode != 0:
        raise RuntimeError(f"{command[0]}: {result.stderr.decode().strip()}")
    return result


def trace(octree, origin, directions, options):
    """Radiance along rays, n × 3."""
    rays = np.empty((len(directions), 6), np.float32)
    rays[:, :3] = origin
    rays[:, 3:] = directions
    command = ["rtrace", "-h", "-w", "-fff", "-n", str(os.cpu_count()), *options, octree.name]
    out = tool(command, octree.parent, input=rays.tobytes(), stdout=subprocess.PIPE).stdout
    return np.frombuffer(out, np.float32).reshape(-1, 3).astype(float)


def version():
    text = subprocess.run(["rtrace", "-version"], env=ENVIRONMENT, capture_output=True, text=True, check=True).stdout
    return text.strip()
