"""Light seen along rays, by Mitsuba's `path`, and what the rays meet first."""

import drjit as dr
import mitsuba as mi
import numpy as np

# Sets the variant that `mi` has from here on.
from mitsuba_scene import build

# No limit on the bounces: chance ends the paths (Russian roulette from the fifth segment on).
ALL = -1
# Rays in flight at a time; about 1 GB, and 16 GB on a GPU, which fewer would not fill.
RAYS = 1 << (24 if mi.variant().startswith("cuda") else 20)


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
        return self.mean(mi.load_dict({"type": self.integrator, "max_depth": depth}), samples, seed)

    def after_first_bounce(self, depth, samples, seed):
        """The same without direct light, where nothing that rays can meet shines."""
        return self.mean(AfterFirstBounce(self.integrator, depth), samples, seed)

    def mean(self, integrator, samples, seed):
        """Mean over paths of an integrator, pixels × 3, f64."""
        sampler = mi.load_dict({"type": "independent"})
        most = max(RAYS // self.pixels, 1)
        total = np.zeros((self.pixels, 3))
        done = now = 0
        while done < samples:
            if min(most, samples - done) != now:
                now = min(most, samples - done)
                rays = self.rays(now)
            sampler.seed(seed + done, self.pixels * now)
            light, _, _ = integrator.sample(self.scene, sampler, rays)
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


class AfterFirstBounce(mi.SamplingIntegrator):
    """Light of paths of at least two bounces, traced by itself.

    The difference of all light and direct light is no substitute: rounding may light a point at a shadow's edge in only
    one of them."""

    def __init__(self, integrator, depth):
        super().__init__(mi.Properties())
        self.rest = mi.load_dict({"type": integrator, "max_depth": depth if depth == ALL else depth - 1})

    def sample(self, scene, sampler, ray, medium=None, active=True):
        si = scene.ray_intersect(ray, active)
        active &= si.is_valid()
        context = mi.BSDFContext()
        bounce, weight = si.bsdf(ray).sample(context, si, sampler.next_1d(active), sampler.next_2d(active), active)
        light, _, _ = self.rest.sample(scene, sampler, si.spawn_ray(si.to_world(bounce.wo)), medium, active)
        return dr.select(active, weight * light, 0), active, []


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
        if tracer.direct_is_exact:
            if k == 0:
                direct = tracer.radiance(2, 1, stream)
            parts.append(tracer.after_first_bounce(depth, each, stream))
        else:
            # Of one stream the direct light is the same in both, so the difference has the noise of the bounces alone.
            direct = tracer.radiance(2, each, stream)
            parts.append(tracer.radiance(depth, each, stream) - direct)
        directs.append(direct)
    return parts, directs
