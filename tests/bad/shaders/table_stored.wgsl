var texels: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(1) fn fill() {
    textureStore(texels, vec2u(0u), vec4u(1u));
}
