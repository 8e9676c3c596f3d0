#import placed::seen

struct Varying { @builtin(position) at: vec4f, @location(0) @interpolate(flat) view: u32 }

@vertex fn place(@location(0) position: vec3f, @location(3) node: u32, @builtin(view_index) view: u32) -> Varying {
    return Varying(seen(position, node), view);
}
@fragment fn shade(in: Varying) -> @location(0) vec4f { return vec4f(0.5 + f32(in.view)); }
