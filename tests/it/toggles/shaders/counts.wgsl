var<storage, read_write> few: array<u32>;
var<storage, read_write> many: array<u32>;
@compute @workgroup_size(1) fn count() {
    few[0] = 3u;
    few[1] = 1u;
    few[2] = 1u;
    few[3] = 0u;
    many[0] = 6u;
    many[1] = 2u;
    many[2] = 1u;
    many[3] = 0u;
}
