//! The shadow volume of every triangle in every light: see lib/shadow_volumes.wgsl.
struct Light {
    /// 2: directional.
    kind: u32,
    position: vec3f,
    direction: vec3f,
}
var<storage, read> lights: array<Light>;

struct Triangle {
    a: vec3f,
    b: vec3f,
    c: vec3f,
}
var<storage, read> triangles: array<Triangle>;

struct Params {
    bounds_min: vec3f,
    bounds_max: vec3f,
    lights: u32,
    triangles: u32,
    shadow_triangles: u32,
}
var<uniform> params: Params;

struct Volume {
    plane: vec4f,
    a: vec4f,
    b: vec4f,
    c: vec4f,
}
var<storage, read_write> shadow_volumes: array<Volume>;

/// Nothing lies within.
const EMPTY: vec4f = vec4f(0.0, 0.0, 0.0, 1.0);

/// The plane through `a`, `b` and the light, with `c` on its negative side. It is moved outwards by `slack`, so that nothing slips
/// between the volumes of two triangles with an edge in common.
fn side(a: vec3f, b: vec3f, c: vec3f, light: vec4f, slack: f32) -> vec4f {
    let normal = normalize(cross(b - a, light.xyz - light.w * a));
    let turned = select(normal, -normal, dot(normal, c - a) > 0.0);
    return vec4f(turned, -slack - dot(turned, a));
}

/// x: the triangle; y: the light.
@compute @workgroup_size(16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.shadow_triangles || id.y >= params.lights {
        return;
    }
    var volume = Volume(EMPTY, EMPTY, EMPTY, EMPTY);
    if id.x < params.triangles {
        let extent = params.bounds_max - params.bounds_min;
        let slack = 1e-6 * max(max(extent.x, extent.y), extent.z);
        let t = triangles[id.x];
        let source = lights[id.y];
        let light = select(vec4f(source.position, 1.0), vec4f(-source.direction, 0.0), source.kind == 2u);
        let normal = normalize(cross(t.b - t.a, t.c - t.a));
        let height = dot(normal, light.xyz - light.w * t.a);
        // A triangle that the light sees from its edge throws no shadow.
        if abs(height) > slack {
            let near = select(normal, -normal, height < 0.0);
            volume = Volume(
                vec4f(near, -dot(near, t.a)),
                side(t.a, t.b, t.c, light, slack),
                side(t.b, t.c, t.a, light, slack),
                side(t.c, t.a, t.b, light, slack),
            );
        }
    }
    shadow_volumes[id.y * params.shadow_triangles + id.x] = volume;
}
