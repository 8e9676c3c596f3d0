//! How much of the half space over each pixel's surface is open, as far as depths near it tell.
var depth: texture_depth_2d;

struct Params {
    camera_view_projection: mat4x4f,
    camera_inverse_view_projection: mat4x4f,
    camera_position: vec3f,
    radius: f32,
    samples: u32,
}
var<uniform> params: Params;

struct Out {
    @location(0) open: f32,
}

fn place(pixel: vec2u) -> vec3f {
    let size = vec2f(textureDimensions(depth));
    let clip = vec2f(2.0, -2.0) * (vec2f(pixel) + 0.5) / size + vec2f(-1.0, 1.0);
    let at = params.camera_inverse_view_projection * vec4f(clip, textureLoad(depth, pixel, 0), 1.0);
    return at.xyz / at.w;
}

/// The shorter way along an axis, so that no edge is bridged.
fn along(pixel: vec2u, step: vec2u, middle: vec3f) -> vec3f {
    let last = textureDimensions(depth) - 1u;
    let ahead = place(min(pixel + step, last)) - middle;
    let behind = middle - place(pixel - min(step, pixel));
    let use_behind = all(pixel + step > last) || dot(ahead, ahead) > dot(behind, behind) && all(pixel >= step);
    return select(ahead, behind, use_behind);
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Out {
    let pixel = vec2u(at.xy);
    if textureLoad(depth, pixel, 0) >= 1.0 {
        return Out(1.0);
    }
    let middle = place(pixel);
    let normal = normalize(cross(along(pixel, vec2u(0u, 1u), middle), along(pixel, vec2u(1u, 0u), middle)));
    let size = vec2f(textureDimensions(depth));
    var hidden = 0.0;
    let turn = fract(52.9829189 * fract(dot(at.xy, vec2f(0.06711056, 0.00583715)))) * 6.2831853;
    for (var i = 0u; i < params.samples; i++) {
        // A spiral over the sphere, turned at every pixel, and folded to the side of the normal.
        let share = (f32(i) + 0.5) / f32(params.samples);
        let height = 1.0 - 2.0 * share;
        let angle = turn + 2.3999632 * f32(i);
        let ring = sqrt(1.0 - height * height);
        var direction = vec3f(ring * cos(angle), ring * sin(angle), height);
        direction *= sign(dot(direction, normal));
        let reach = params.radius * (0.1 + 0.9 * share * share);
        let point = middle + normal * params.radius * 0.02 + direction * reach;
        let clip = params.camera_view_projection * vec4f(point, 1.0);
        let seen = vec2f(0.5, -0.5) * clip.xy / clip.w + 0.5;
        if clip.w <= 0.0 || any(seen < vec2f(0.0)) || any(seen >= vec2f(1.0)) {
            continue;
        }
        let surface = place(vec2u(seen * size));
        let nearer = distance(point, params.camera_position) - distance(surface, params.camera_position);
        if nearer > 0.0 {
            // What lies far before the point is another thing.
            hidden += smoothstep(0.0, 1.0, params.radius / max(distance(surface, middle), 1e-4));
        }
    }
    return Out(clamp(1.0 - hidden / f32(params.samples), 0.0, 1.0));
}
