//! Flash and memory that a firmware image takes, from its ELF sections.
//!
//! Field places: Tool Interface Standard, Executable and Linking Format 1.2, figures
//! 1-3 and 1-9 (32 bit, little endian: what Cortex-M tools write).

use crate::chip::TARGET;
use crate::shell::{self, Outcome};
use std::fs;
use std::path::PathBuf;

/// Section occupies memory while the program runs.
const ALLOCATED: u32 = 0x2;
/// Section can be written.
const WRITABLE: u32 = 0x1;
/// Section has no bytes in the file (`SHT_NOBITS`).
const NO_BITS: u32 = 8;
const HEADER_BYTES: usize = 52;
const SECTION_HEADER_BYTES: usize = 40;

/// Bytes of an image.
#[derive(Debug, Default, PartialEq)]
struct Size {
    /// Code, constants and the start values of variables.
    flash: u64,
    /// Variables; the stack is not in the image.
    memory: u64,
}

/// The task `size`.
pub fn run(images: &[String]) -> Outcome {
    let default = shell::target_directory()
        .join(TARGET)
        .join("release/firmware");
    let images: Vec<PathBuf> = match images {
        [] => vec![default],
        named => named.iter().map(PathBuf::from).collect(),
    };
    println!("| image | flash, bytes | static memory, bytes |\n|---|---:|---:|");
    for image in images {
        let shown = image.display();
        let bytes = fs::read(&image).map_err(|error| {
            format!("{shown}: {error}\nbuild the firmware first, or name an image")
        })?;
        let size = measure(&bytes).ok_or_else(|| format!("{shown}: no 32-bit ELF image"))?;
        println!("| {shown} | {} | {} |", size.flash, size.memory);
    }
    Ok(())
}

/// Sum the sections of an image; `None` if it is not one.
fn measure(image: &[u8]) -> Option<Size> {
    // Magic number, then class 1 (32 bit) and data 1 (little endian).
    if image.len() < HEADER_BYTES || !image.starts_with(b"\x7fELF\x01\x01") {
        return None;
    }
    let table = word(image, 32)? as usize;
    let count = half_word(image, 48)?;
    let mut size = Size::default();
    for section in 0..usize::from(count) {
        let header = image.get(table.checked_add(section * SECTION_HEADER_BYTES)?..)?;
        let (kind, flags, bytes) = (word(header, 4)?, word(header, 8)?, word(header, 20)?);
        if flags & ALLOCATED == 0 {
            continue;
        }
        if kind != NO_BITS {
            size.flash += u64::from(bytes);
        }
        if flags & WRITABLE != 0 {
            size.memory += u64::from(bytes);
        }
    }
    Some(size)
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

fn half_word(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(sections: &[(u32, u32, u32)]) -> Vec<u8> {
        let mut image = vec![0; HEADER_BYTES];
        image[..6].copy_from_slice(b"\x7fELF\x01\x01");
        image[32] = 52; // The section headers follow this one.
        image[48] = u8::try_from(sections.len()).unwrap();
        for (kind, flags, bytes) in sections {
            let mut header = [0; SECTION_HEADER_BYTES];
            header[4..8].copy_from_slice(&kind.to_le_bytes());
            header[8..12].copy_from_slice(&flags.to_le_bytes());
            header[20..24].copy_from_slice(&bytes.to_le_bytes());
            image.extend(header);
        }
        image
    }

    #[test]
    fn start_values_count_twice_and_debug_information_not_at_all() {
        let text = (1, ALLOCATED, 5000);
        let start_values = (1, ALLOCATED | WRITABLE, 40);
        let zeroed = (NO_BITS, ALLOCATED | WRITABLE, 600);
        let debug = (1, 0, 99_999);
        let size = measure(&image(&[text, start_values, zeroed, debug]));
        assert_eq!(
            size,
            Some(Size {
                flash: 5040,
                memory: 640
            })
        );
    }

    #[test]
    fn other_files_are_refused() {
        assert_eq!(measure(b"no image"), None);
        assert_eq!(measure(&[0; 100]), None);
        let whole = image(&[(1, ALLOCATED, 1)]);
        assert_eq!(measure(&whole[..whole.len() - 30]), None);
    }
}
