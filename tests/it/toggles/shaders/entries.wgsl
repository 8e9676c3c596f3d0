#import placed::seen

var<storage, read_write> entered: array<f32>;
var source: texture_2d<f32>;
var result: texture_storage_2d<r32float, write>;

@vertex fn place(@location(0) position: vec3f, @location(3) node: u32) -> @builtin(position) vec4f {
    return seen(position, node);
}
@fragment fn dim() -> @location(0) vec4f { return vec4f(0.25); }
@fragment fn bright() -> @location(0) vec4f { return vec4f(0.75); }

@compute @workgroup_size(4) fn few(@builtin(global_invocation_id) id: vec3u) { entered[id.x] = 1.0; }
@compute @workgroup_size(4) fn many(@builtin(global_invocation_id) id: vec3u) { entered[id.x] = 9.0; }

@compute @workgroup_size(1) fn lower() { textureStore(result, vec2u(0u), textureLoad(source, vec2u(0u), 0)); }
@compute @workgroup_size(1) fn higher() { textureStore(result, vec2u(0u), textureLoad(source, vec2u(0u), 0) + 1.0); }
