"""Light seen along rays, by Mitsuba's `path`, and what the rays meet first."""

import drjit as dr
import mitsuba as mi
import numpy as np

# Sets the variant that `mi` has from here on.
from mitsuba_scene import build

# No limit on the bounces: chance ends the paths (Russian roulette from the fifth segment on).
ALL = -1
# Rays in flight at a time; about 1 GB.
RAYS = 1 << 20


class Tracer:
    """Traces one scene along fixed rays, several to a pixel."""

    def __init__(self, scene, camera, width, height):
        self.scene = build(scene)
        self.origin, self.directions = scene.rays(camera, width, height)
        self.pixels = width * height
        self.shape = (height, width, 3)
        # Direct light from points reaches pixel centres along one path: no chance is involved.
        self.under_panorama = scene.panorama is not None
        self.direct_is_exact = not self.under_panorama and all(max(m.emission) == 0 for m in scene.materials)
        # `path` lets no light of points through masks.
        self.integrator = "path" if all(m.cutoff is None for m in scene.materials) else "volpath"

    def radiance(self, depth, samples, seed):
        """Mean over paths of up to `depth` segments (2: direct light), pixels × 3, f64."""
        integrator = mi.load_dict({"type": self.integrator, "max_depth": depth})
        sampler = mi.load_dict({"type": "independent"})
        most = max(RAYS // self.pixels, 1)
        total = np.zeros((self.pixels, 3))
        done = 0
        while done < samples:
            now = min(most, samples - done)
            sampler.seed(seed + done, self.pixels * now)
            light, _, _ = integrator.sample(self.scene, sampler, self.rays(now))
            total += np.array(dr.block_sum(dr.ravel(mi.Color3f(light), order="C"), now)).reshape(3, -1).T
            done += now
        return total / samples

    def surfaces(self):
        """Albedo, unit normal on the side seen, and distance, pixels × 3 each; 0 where the ray leaves the scene.

        The normal is 0, too, where an interpolated one turns away from a viewer who sees the front: at silhouettes of
        smooth surfaces. Mitsuba shows black there; comparisons leave such pixels out."""
        rays = self.rays(1)
        si = self.scene.ray_intersect(rays)
        hit = np.array(si.is_valid())[:, None]
        albedo = np.array(si.bsdf().eval_diffuse_reflectance(si)).T
        n = si.sh_frame.n
        away, back = dr.dot(n, rays.d) > 0, dr.dot(si.n, rays.d) > 0
        normal = np.array(dr.select(away == back, dr.select(back, -n, n), 0)).T
        depth = np.repeat(np.array(si.t)[:, None], 3, axis=1)
        return [np.where(hit, a, 0.0) for a in (albedo, normal, depth)]

    def rays(self, samples):
        each = np.repeat(self.directions, samples, axis=0).astype(np.float32)
        return mi.RayDifferential3f(mi.Ray3f(mi.Point3f(self.origin), mi.Vector3f(each.T)))


def mean_and_error(tracer, depth, samples, seed):
    """Light of all bounces after the first: the mean, its standard error pixel by pixel, and the direct light."""
    parts, directs = passes(tracer, depth, samples, seed)
    return np.mean(parts, axis=0), standard_error(parts), np.mean(directs, axis=0)


def standard_error(parts):
    """Of the mean of independent parts."""
    return np.std(parts, axis=0, ddof=1) / np.sqrt(len(parts))


def passes(tracer, depth, samples, seed, count=16):
    """Light of all bounces after the first, and the direct light, in `count` independent parts each."""
    each = max(samples // count, 1)
    parts, directs = [], []
    for k in range(count):
        stream = seed + k * 1_000_003
        # Of one stream the direct light is the same in both, so the difference has the noise of the bounces alone.
        if k == 0 or not tracer.direct_is_exact:
            direct = tracer.radiance(2, 1 if tracer.direct_is_exact else each, stream)
        directs.append(direct)
        parts.append(tracer.radiance(depth, each, stream) - direct)
    return parts, directs
