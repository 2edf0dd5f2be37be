//! SHA-256 of files and texts, in hexadecimal.

use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Size and SHA-256 of a file, which is not held in memory.
///
/// # Errors
/// If it cannot be read.
pub fn of_file(path: &Path) -> io::Result<(u64, String)> {
    let mut file = File::open(path)?;
    let mut digest = Sha256::new();
    let mut block = vec![0_u8; 1 << 16];
    let mut bytes = 0;
    loop {
        let count = file.read(&mut block)?;
        if count == 0 {
            break;
        }
        bytes += count as u64;
        digest.update(&block[..count]);
    }
    Ok((bytes, hexadecimal(&digest.finalize())))
}

/// SHA-256 of texts, each ended by a zero byte.
pub fn bytes_of_texts(parts: &[&str]) -> [u8; 32] {
    let mut digest = Sha256::new();
    for part in parts {
        digest.update(part.as_bytes());
        digest.update([0]);
    }
    digest.finalize().into()
}

/// The same in hexadecimal.
pub fn of_texts(parts: &[&str]) -> String {
    hexadecimal(&bytes_of_texts(parts))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
