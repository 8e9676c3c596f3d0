//! Hashes that stand for contents.

use std::hash::{DefaultHasher, Hash, Hasher};

/// 128 bits, so that two contents never share a hash by chance; the same for equal values in every run of the program.
pub fn hash(value: &(impl Hash + ?Sized)) -> u128 {
    let half = |salt: u8| {
        let mut h = DefaultHasher::new();
        salt.hash(&mut h);
        value.hash(&mut h);
        u128::from(h.finish())
    };
    half(0) << 64 | half(1)
}
