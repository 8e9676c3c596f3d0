//! Spherical harmonics, sampling, colour: the CPU twins of what shaders compute.
