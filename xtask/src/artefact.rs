//! The STM32F405's image in the forms that flashing tools take, in `out/firmware/`.
//!
//! | file | tool |
//! |---|---|
//! | `.elf` | probe-rs, gdb; the log's strings are in it |
//! | `.hex` | most programmers; leaves the sectors with the settings alone |
//! | `.dfu` | `dfu-util -a 0 -s :leave -D FILE` over USB, the chip's own loader; leaves them alone |
//! | `.bin` | at 0x08000000; fills the gap, so that it erases the settings |
//!
//! DFU file: STMicroelectronics UM0391, "DfuSe file format specification"; its
//! suffix: "USB device firmware upgrade specification" 1.1, appendix B.

use crate::image;
use crate::shell::{self, Outcome};
use crc::{CRC_32_JAMCRC, Crc};
use ihex::Record;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, elf};
use std::fs;

/// Erased flash.
const ERASED: u8 = 0xFF;
/// The chip's loader on USB.
const VENDOR: u16 = 0x0483;
const PRODUCT: u16 = 0xDF11;
const DFU_VERSION: u16 = 0x011A;
const DFU_SUFFIX_BYTES: u8 = 16;
const TARGET_NAME_BYTES: usize = 255;
const HEX_LINE_BYTES: usize = 16;

/// Bytes that belong at a place in flash.
#[derive(Clone, Debug, PartialEq)]
struct Part {
    address: u32,
    bytes: Vec<u8>,
}

/// The task `image`: builds with these choices, converts, tells.
pub fn run(choices: &[String]) -> Outcome {
    let elf = image::build_with(image::STM32F405, choices)?;
    let bytes = fs::read(&elf).map_err(|error| format!("{}: {error}", elf.display()))?;
    let parts = parts(&bytes).map_err(|reason| format!("{}: {reason}", elf.display()))?;
    let directory = shell::root().join("out/firmware");
    fs::create_dir_all(&directory).map_err(|e| format!("{}: {e}", directory.display()))?;
    let hex = hex(&parts)?;
    for (ending, content) in [
        ("elf", bytes),
        ("hex", hex.into_bytes()),
        ("bin", binary(&parts)),
        ("dfu", dfu(&parts)),
    ] {
        let path = directory.join(format!("pneuma-stm32f405.{ending}"));
        fs::write(&path, &content).map_err(|error| format!("{}: {error}", path.display()))?;
        println!("{}: {} bytes", path.display(), content.len());
    }
    println!(
        "over USB, with BOOT0 high at reset: dfu-util -a 0 -s :leave -D \
         {}/pneuma-stm32f405.dfu\nwith a probe: cargo run -p firmware",
        directory.display()
    );
    Ok(())
}

/// What is loaded into flash, in order of address; parts that touch are one.
fn parts(image: &[u8]) -> Result<Vec<Part>, String> {
    let no_image = |error| format!("no 32-bit ELF image: {error}");
    let file = ElfFile32::<Endianness>::parse(image).map_err(no_image)?;
    let endian = file.endian();
    let mut loaded = Vec::new();
    for header in file.elf_program_headers() {
        let data = header
            .data(endian, image)
            .map_err(|()| "a segment lies beyond the file's end")?;
        if header.p_type(endian) == elf::PT_LOAD && !data.is_empty() {
            loaded.push(Part {
                address: header.p_paddr(endian),
                bytes: data.to_vec(),
            });
        }
    }
    loaded.sort_by_key(|part| part.address);
    Ok(joined(loaded))
}

fn joined(parts: Vec<Part>) -> Vec<Part> {
    let mut joined: Vec<Part> = Vec::new();
    for part in parts {
        match joined.last_mut() {
            Some(last) if end(last) == u64::from(part.address) => last.bytes.extend(part.bytes),
            _ => joined.push(part),
        }
    }
    joined
}

fn end(part: &Part) -> u64 {
    u64::from(part.address) + part.bytes.len() as u64
}

/// From the first part's place on, gaps erased.
fn binary(parts: &[Part]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let begin = parts.first().map_or(0, |part| part.address);
    for part in parts {
        bytes.resize((part.address - begin) as usize, ERASED);
        bytes.extend(&part.bytes);
    }
    bytes
}

fn hex(parts: &[Part]) -> Outcome<String> {
    let mut records = Vec::new();
    for part in parts {
        let mut upper = None;
        for (line, value) in part.bytes.chunks(HEX_LINE_BYTES).enumerate() {
            let address = part.address + (line * HEX_LINE_BYTES) as u32;
            let [high, low] = [(address >> 16) as u16, address as u16];
            if upper.replace(high) != Some(high) {
                records.push(Record::ExtendedLinearAddress(high));
            }
            records.push(Record::Data {
                offset: low,
                value: value.to_vec(),
            });
        }
    }
    records.push(Record::EndOfFile);
    let written = ihex::create_object_file_representation(&records);
    written.map_err(|error| format!("the hex file cannot be written: {error}").into())
}

/// A file with one target, whose elements are the parts.
fn dfu(parts: &[Part]) -> Vec<u8> {
    let mut elements = Vec::new();
    for part in parts {
        elements.extend(part.address.to_le_bytes());
        elements.extend((part.bytes.len() as u32).to_le_bytes());
        elements.extend(&part.bytes);
    }
    let mut name = b"pneuma".to_vec();
    name.resize(TARGET_NAME_BYTES, 0);

    let mut target = b"Target".to_vec();
    target.push(0); // The alternate setting: internal flash.
    target.extend(1_u32.to_le_bytes()); // It has a name.
    target.extend(name);
    target.extend((elements.len() as u32).to_le_bytes());
    target.extend((parts.len() as u32).to_le_bytes());
    target.extend(elements);

    let prefix_bytes = 11;
    let mut file = b"DfuSe\x01".to_vec();
    file.extend((prefix_bytes + target.len() as u32).to_le_bytes());
    file.push(1); // Targets.
    file.extend(target);
    with_suffix(file)
}

fn with_suffix(mut file: Vec<u8>) -> Vec<u8> {
    let any_device_release = 0xFFFF_u16;
    for field in [any_device_release, PRODUCT, VENDOR, DFU_VERSION] {
        file.extend(field.to_le_bytes());
    }
    file.extend(b"UFD");
    file.push(DFU_SUFFIX_BYTES);
    // CRC-32 without the last inversion.
    let crc = Crc::<u32>::new(&CRC_32_JAMCRC).checksum(&file);
    file.extend(crc.to_le_bytes());
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_parts() -> Vec<Part> {
        let vectors = Part {
            address: 0x0800_0000,
            bytes: vec![1, 2, 3, 4],
        };
        let program = Part {
            address: 0x0800_FFF0,
            bytes: (0..40).collect(),
        };
        vec![vectors, program]
    }

    #[test]
    fn parts_that_touch_are_one() {
        let part = |address, bytes: &[u8]| Part {
            address,
            bytes: bytes.to_vec(),
        };
        let parts = joined(vec![part(16, &[1, 2]), part(18, &[3]), part(20, &[4])]);
        assert_eq!(parts, [part(16, &[1, 2, 3]), part(20, &[4])]);
    }

    #[test]
    fn the_binary_fills_the_gap_as_if_erased() {
        let bytes = binary(&two_parts());
        assert_eq!(bytes.len(), 0xFFF0 + 40);
        assert_eq!(bytes[..6], [1, 2, 3, 4, ERASED, ERASED]);
        assert_eq!(bytes[0xFFF0..0xFFF3], [0, 1, 2]);
    }

    #[test]
    fn the_hex_file_holds_the_parts_and_not_the_gap() {
        let text = hex(&two_parts()).unwrap();
        let (mut upper, mut found) = (0, Vec::new());
        for record in ihex::Reader::new(&text) {
            match record.unwrap() {
                Record::ExtendedLinearAddress(high) => upper = u32::from(high) << 16,
                Record::Data { offset, value } => found.push(Part {
                    address: upper | u32::from(offset),
                    bytes: value,
                }),
                Record::EndOfFile => {}
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(joined(found), two_parts());
    }

    #[test]
    fn the_dfu_file_is_laid_out_as_specified() {
        let file = dfu(&two_parts());
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
        let content = 2 * 8 + 4 + 40;
        assert_eq!(file.len(), 11 + 274 + content + 16);
        assert_eq!(&file[..6], b"DfuSe\x01");
        assert_eq!(word(6) as usize, file.len() - 16);
        assert_eq!((file[10], &file[11..17]), (1, &b"Target"[..]));
        assert_eq!((word(277) as usize, word(281)), (content, 2));
        assert_eq!((word(285), word(289)), (0x0800_0000, 4));
        assert_eq!((word(297), word(301)), (0x0800_FFF0, 40));
        let suffix = &file[file.len() - 16..];
        assert_eq!(
            suffix[..12],
            [
                0xFF, 0xFF, 0x11, 0xDF, 0x83, 0x04, 0x1A, 0x01, b'U', b'F', b'D', 16
            ]
        );
        // CRC-32 over the file with its CRC leaves the known residue, here
        // without the last inversion.
        let residue = Crc::<u32>::new(&CRC_32_JAMCRC).checksum(&file);
        assert_eq!(residue, 0, "{residue:08x}");
    }

    #[test]
    fn other_files_are_refused() {
        assert!(parts(b"no image").is_err());
    }
}
