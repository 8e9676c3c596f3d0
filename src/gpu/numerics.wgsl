// One reduction over all numbers of a texture or buffer: what is not a number, infinite or outside of its range, and
// where the first of them is; the extremes and the sums. `size()`, `channels_of(i)` and `load(i)` stand above, by
// source.

struct Check {
    // Bit c: channel c holds a number.
    channels: u32,
    // Words: an element's words, and a bit for each that holds a float.
    stride: u32,
    floats: u32,
    // The first row to write.
    row: u32,
    // Values outside are counted.
    low: f32,
    high: f32,
    // Of an atlas: texels along a tile (0: no atlas), tiles in a row, tiles that count.
    tile: u32,
    columns: u32,
    tiles: u32,
}
@group(0) @binding(1) var<uniform> check: Check;

struct Row {
    not_numbers: u32,
    infinite: u32,
    below: u32,
    above: u32,
    // Place of the first that is no finite number, and of the first outside of the range; 0xffffffff: none.
    broken_at: u32,
    outside_at: u32,
    least: f32,
    largest: f32,
    // Of the magnitudes of all finite numbers, and of the negative ones.
    sum: f32,
    negative: f32,
    unused: vec2u,
}
@group(0) @binding(2) var<storage, read_write> rows: array<Row>;

// The channels of a texel: none in the rest of an atlas, which no step need write.
fn in_tiles(texel: vec2u) -> u32 {
    if check.tile == 0u {
        return check.channels;
    }
    let at = texel / check.tile;
    return select(0u, check.channels, at.x < check.columns && at.y * check.columns + at.x < check.tiles);
}

const LANES: u32 = 64u;
var<workgroup> partial: array<Row, LANES>;

fn joined(a: Row, b: Row) -> Row {
    return Row(
        a.not_numbers + b.not_numbers,
        a.infinite + b.infinite,
        a.below + b.below,
        a.above + b.above,
        min(a.broken_at, b.broken_at),
        min(a.outside_at, b.outside_at),
        min(a.least, b.least),
        max(a.largest, b.largest),
        a.sum + b.sum,
        a.negative + b.negative,
        vec2u(0u),
    );
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    var r = Row(0u, 0u, 0u, 0u, 0xffffffffu, 0xffffffffu, 3.4028234e38, -3.4028234e38, 0.0, 0.0, vec2u(0u));
    let texels = size();
    for (var i = group.x * LANES + lane; i < texels; i += groups.x * LANES) {
        let value = load(i);
        let channels = channels_of(i);
        for (var c = 0u; c < 4u; c++) {
            if ((channels >> c) & 1u) == 0u {
                continue;
            }
            let x = value[c];
            // By the bits: a compiler may take it that no number is without value.
            let magnitude = bitcast<u32>(x) & 0x7fffffffu;
            if magnitude >= 0x7f800000u {
                r.not_numbers += select(0u, 1u, magnitude > 0x7f800000u);
                r.infinite += select(0u, 1u, magnitude == 0x7f800000u);
                r.broken_at = min(r.broken_at, i);
                continue;
            }
            r.below += select(0u, 1u, x < check.low);
            r.above += select(0u, 1u, x > check.high);
            r.outside_at = select(r.outside_at, min(r.outside_at, i), x < check.low || x > check.high);
            r.least = min(r.least, x);
            r.largest = max(r.largest, x);
            r.sum += abs(x);
            r.negative += max(-x, 0.0);
        }
    }
    partial[lane] = r;
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if lane < half {
            partial[lane] = joined(partial[lane], partial[lane + half]);
        }
    }
    if lane == 0u {
        rows[check.row + group.x] = partial[0];
    }
}
