// Reads a table as if its rows were numbers.
var<storage, read> triangles: array<f32>;

struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Targets {
    return Targets(vec4f(triangles[0]));
}
