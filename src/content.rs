//! Hashes that stand for contents.

use siphasher::sip128::{Hasher128, SipHasher13};
use std::hash::Hash;

/// 128 bits, so that two contents never share a hash by chance; the same for equal values in every run of the program.
pub fn hash(value: &(impl Hash + ?Sized)) -> u128 {
    let mut hasher = SipHasher13::new();
    value.hash(&mut hasher);
    hasher.finish128().as_u128()
}
