//! Numbers and words that follow from a seed and tell nothing of it.

use crate::hash::{bytes_of_texts as bytes, of_texts as hexadecimal};

/// The seed of a case: 32 bits of a hash.
pub(super) fn case_seed(trial_seed: u64, number: usize) -> u64 {
    let [a, b, c, d, ..] = bytes(&["case", &trial_seed.to_string(), &number.to_string()]);
    u64::from(u32::from_le_bytes([a, b, c, d]))
}

/// The salt of a seal: 128 bits of a hash.
pub(super) fn salt(trial_seed: u64, number: usize) -> String {
    let mut salt = hexadecimal(&["salt", &trial_seed.to_string(), &number.to_string()]);
    salt.truncate(32);
    salt
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_hash_is_sha_256() {
        // FIPS 180-4: SHA-256 of one zero byte, here of an empty text and its end.
        assert_eq!(
            hexadecimal(&[""]),
            "6e340b9cffb37a989ca544e6bb780a2c78901d3fb33738768511a30617afa01d"
        );
        assert_ne!(hexadecimal(&["a", "b"]), hexadecimal(&["ab"]));
    }

    #[test]
    fn regress_salts_and_seeds_differ() {
        assert_eq!(salt(1, 2).len(), 32);
        assert_ne!(salt(1, 2), salt(1, 3));
        assert_ne!(case_seed(1, 2), case_seed(2, 1));
    }
}
