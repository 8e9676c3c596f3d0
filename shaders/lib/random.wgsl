//! Numbers that look random, and sequences that cover the unit square evenly.
#define_import_path lightgraph::random

/// A bijection of the 32-bit words that leaves no pattern (PCG-RXS-M-XS; Jarzynski and Olano, "Hash Functions for GPU
/// Rendering", 2020).
fn scramble(word: u32) -> u32 {
    let state = word * 747796405u + 2891336453u;
    let mixed = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (mixed >> 22u) ^ mixed;
}

/// A seed for each pixel and `salt`; others give numbers that have nothing to do with them.
fn seed(pixel: vec2u, salt: u32) -> u32 {
    return scramble(pixel.x + scramble(pixel.y + scramble(salt)));
}

/// The share of 2^32 that a word is, in 0..1 and below 1.
fn unit(word: u32) -> f32 {
    return f32(word >> 8u) / 16777216.0;
}

/// The next number in 0..1 after a state, which moves on.
fn next(state: ptr<function, u32>) -> f32 {
    *state = *state * 747796405u + 2891336453u;
    return unit(scramble(*state));
}

/// Two of them.
fn next_pair(state: ptr<function, u32>) -> vec2f {
    let first = next(state);
    return vec2f(first, next(state));
}

/// Point number `index` of Roberts' R2 sequence, moved round the unit square by what `shift` stands for. Any stretch
/// of it covers the square evenly, and over all shifts each point is uniform. The steps are 2^32 over the
/// plastic number 1.3247 and over its square.
fn even_pair(index: u32, shift: u32) -> vec2f {
    let step = vec2u(3242174889u, 2447445414u) * index;
    return vec2f(unit(step.x + shift), unit(step.y + scramble(shift)));
}

/// A number in 0..1 for each pixel that is spread evenly over any pixels side by side (Roberts' R2 sequence along both
/// axes), and moves by what `shift` stands for. The first is a half: a sum that is asked at 0 may begin with almost
/// nothing.
fn dither(pixel: vec2u, shift: u32) -> f32 {
    return unit(pixel.x * 3242174889u + pixel.y * 2447445414u + shift + 2147483648u);
}

/// Point number `index` of Sobol's sequence in the unit square, scrambled by what `shift` stands for (Owen, "Randomly
/// Permuted (t,m,s)-Nets and (t,s)-Sequences", 1995). Of points 0 to 2^n - 1 each cell of every grid of 2^n equal
/// cells holds one, whether squares, columns or rows: a mean over so many has less noise than one over as many of
/// `even_pair`, which suits stretches that begin anywhere. Over all shifts each point is uniform.
fn sobol_pair(index: u32, shift: u32) -> vec2f {
    // Bit j of `sums` is the parity of the index's bits whose numbers have all the ones of j (Ahmed, "An Implementation
    // Algorithm of 2D Sobol Sequence Fast, Elegant, and Compact", 2024).
    var sums = index;
    sums ^= sums >> 16u;
    sums ^= (sums >> 8u) & 0x00ff00ffu;
    sums ^= (sums >> 4u) & 0x0f0f0f0fu;
    sums ^= (sums >> 2u) & 0x33333333u;
    sums ^= (sums >> 1u) & 0x55555555u;
    return vec2f(unit(owen_scramble(index, shift)), unit(owen_scramble(sums, scramble(shift))));
}

/// Reverses a word's bits and scrambles the result as Owen does: halves of the range swap at random, then the halves of
/// each half, and so on. A hash does so in which each bit depends on lower bits alone (Laine and Karras, "Stratified
/// Sampling for Stochastic Transparency", 2011; constants of Vegdahl, "Building a Better LK Hash", 2021).
fn owen_scramble(word: u32, shift: u32) -> u32 {
    var x = word;
    x ^= x * 0x3d20adeau;
    x += shift;
    x *= (shift >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return reverseBits(x);
}
