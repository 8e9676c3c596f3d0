// Writes and reads eight-bit texels at once.
var image: texture_storage_2d<rgba8unorm, read_write>;

@compute @workgroup_size(1)
fn touch() {
    textureStore(image, vec2u(0u), textureLoad(image, vec2u(0u)));
}
