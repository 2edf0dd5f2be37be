//! Settings into the image of a firmware.
//!
//! An image says by three symbols where its two slots are: `_settings_slot_0`,
//! `_settings_slot_1` and `_settings_slot_bytes`. They are not part of it, so
//! that flashing new firmware leaves the settings as they are; here they become
//! part of it, as a loaded section: the record in the first slot, the second
//! blank, for a record left there from before might be newer.

use object::build::elf::{Builder, SectionData};
use object::elf;
use object::write::WritableBuffer;

/// The section that holds both slots.
const SECTION: &str = ".settings";
/// What flash reads as after it is erased.
const ERASED: u8 = 0xFF;
const ALIGNMENT: u64 = 8;
/// The largest sector of an STM32F405's flash: no slot is larger.
const LARGEST_SLOT_BYTES: u64 = 128 * 1024;
/// What tables and alignment may add to an image beside the slots.
const GROWTH_BYTES: usize = 64 * 1024;

/// Why an image cannot take settings; one line without the image's name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// It is none.
    #[error("is no ELF image of a firmware: {0}")]
    NotAnImage(String),
    /// It does not say where its slots are.
    #[error("does not say where its settings go: it has no symbol {0}")]
    NoSlots(&'static str),
    /// The slots cannot be one section.
    #[error("has its settings' slots apart, expected one behind the other")]
    SlotsApart,
    /// Its headers ask for more than the file holds.
    #[error("is damaged: its headers ask for more than the file holds; build or copy it again")]
    Damaged,
    /// The record is longer than a slot.
    #[error("has slots of {0} bytes, too few for the settings")]
    SlotTooSmall(u64),
}

/// The image with the record in its first slot.
pub fn write_into(image: &[u8], record: &[u8]) -> Result<Vec<u8>, ImageError> {
    let not_an_image = |error: object::build::Error| ImageError::NotAnImage(error.to_string());
    let mut builder = Builder::read32(image).map_err(not_an_image)?;
    let first = symbol(&builder, "_settings_slot_0")?;
    let second = symbol(&builder, "_settings_slot_1")?;
    let slot_bytes = symbol(&builder, "_settings_slot_bytes")?;
    if slot_bytes > LARGEST_SLOT_BYTES || !has_sound_alignments(&mut builder) {
        return Err(ImageError::Damaged);
    }
    if second != first + slot_bytes {
        return Err(ImageError::SlotsApart);
    }
    let length = usize::try_from(slot_bytes).unwrap_or(usize::MAX);
    if record.len() > length {
        return Err(ImageError::SlotTooSmall(slot_bytes));
    }
    let mut slots = vec![ERASED; 2 * length];
    slots[..record.len()].copy_from_slice(record);
    put_section(&mut builder, first, slots);
    let mut written = Bounded::of(image.len() + 2 * length + GROWTH_BYTES);
    let outcome = builder.write(&mut written);
    if written.is_over {
        return Err(ImageError::Damaged);
    }
    outcome.map_err(not_an_image)?;
    Ok(written.bytes)
}

/// Whether every section is aligned to a power of two that a sector holds; none
/// at all is written as 1.
fn has_sound_alignments(builder: &mut Builder<'_>) -> bool {
    builder.sections.iter_mut().all(|section| {
        section.sh_addralign = section.sh_addralign.max(1);
        section.sh_addralign.is_power_of_two() && section.sh_addralign <= LARGEST_SLOT_BYTES
    })
}

/// A buffer that refuses to grow beyond what the image can need: offsets and
/// alignments of a damaged file may ask for gigabytes.
struct Bounded {
    bytes: Vec<u8>,
    most: usize,
    is_over: bool,
}

impl Bounded {
    fn of(most: usize) -> Self {
        Self {
            bytes: Vec::new(),
            most,
            is_over: false,
        }
    }

    fn has_room(&mut self, more: u64) -> bool {
        let end = usize::try_from(more).ok();
        let end = end.and_then(|more| self.bytes.len().checked_add(more));
        self.is_over |= end.is_none_or(|end| end > self.most);
        !self.is_over
    }
}

impl WritableBuffer for Bounded {
    fn reserve(&mut self, size: u64) -> Result<(), ()> {
        if self.has_room(size) { Ok(()) } else { Err(()) }
    }

    fn write_bytes(&mut self, bytes: &[u8]) {
        if self.has_room(bytes.len() as u64) {
            self.bytes.extend_from_slice(bytes);
        }
    }

    fn write_zeros(&mut self, additional: u64) {
        if self.has_room(additional) {
            let length = self.bytes.len() + additional as usize;
            self.bytes.resize(length, 0);
        }
    }
}

fn symbol(builder: &Builder<'_>, name: &'static str) -> Result<u64, ImageError> {
    let mut symbols = builder.symbols.iter();
    let found = symbols.find(|symbol| symbol.name.as_slice() == name.as_bytes());
    found
        .map(|symbol| symbol.st_value)
        .ok_or(ImageError::NoSlots(name))
}

fn put_section(builder: &mut Builder<'_>, address: u64, content: Vec<u8>) {
    let mut sections = builder.sections.iter_mut();
    let present = sections.find(|section| section.name.as_slice() == SECTION.as_bytes());
    if let Some(section) = present {
        section.data = SectionData::Data(content.into());
        return;
    }
    // A processor without an operating system has no use for this entry, and
    // the table of segments, behind which the image begins, cannot grow.
    for segment in &mut builder.segments {
        segment.delete |= segment.p_type == elf::PT_GNU_STACK;
    }
    let loaded = builder.segments.iter().filter(|segment| segment.is_load());
    let end = loaded.map(|segment| segment.p_offset + segment.p_filesz);
    let offset = end.max().unwrap_or(0).next_multiple_of(ALIGNMENT);
    let section = builder.sections.add();
    section.name = SECTION.into();
    section.sh_type = elf::SHT_PROGBITS;
    section.sh_flags = elf::SHF_ALLOC;
    section.sh_addralign = ALIGNMENT;
    section.sh_size = content.len() as u64;
    section.data = SectionData::Data(content.into());
    let segment = builder.segments.add();
    segment.p_type = elf::PT_LOAD;
    segment.p_flags = elf::PF_R;
    segment.p_align = ALIGNMENT;
    segment.p_offset = offset;
    segment.p_vaddr = address;
    segment.p_paddr = address;
    segment.append_section(section);
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::settings::Settings;
    use firmware::settings::record::{decode, encode};
    use object::{Endianness, Object, ObjectSection};

    const CODE_AT: u64 = 0x100;
    const SLOTS_AT: u64 = 0x4000;

    /// An image as a linker leaves it: code, two absolute symbols, the entry for
    /// a stack that the linker always adds.
    fn image(slot_symbols: &[(&'static str, u64)]) -> Vec<u8> {
        let mut builder = Builder::new(Endianness::Little, false);
        builder.header.e_type = elf::ET_EXEC;
        builder.header.e_machine = elf::EM_ARM;
        builder.header.e_phoff = 52;
        let code = builder.sections.add();
        code.name = ".text".into();
        code.sh_type = elf::SHT_PROGBITS;
        code.sh_flags = elf::SHF_ALLOC;
        code.sh_addralign = 4;
        code.sh_size = 8;
        code.data = SectionData::Data(vec![1, 2, 3, 4, 5, 6, 7, 8].into());
        let segment = builder.segments.add();
        segment.p_type = elf::PT_LOAD;
        segment.p_align = 4;
        segment.p_offset = CODE_AT;
        segment.p_vaddr = CODE_AT;
        segment.p_paddr = CODE_AT;
        segment.append_section(code);
        builder.segments.add().p_type = elf::PT_GNU_STACK;
        for (name, value) in slot_symbols {
            let symbol = builder.symbols.add();
            symbol.name = (*name).into();
            symbol.st_shndx = elf::SHN_ABS;
            symbol.st_value = *value;
        }
        for (name, data, sh_type) in [
            (".symtab", SectionData::Symbol, elf::SHT_SYMTAB),
            (".strtab", SectionData::String, elf::SHT_STRTAB),
            (".shstrtab", SectionData::SectionString, elf::SHT_STRTAB),
        ] {
            let section = builder.sections.add();
            section.name = name.into();
            section.sh_type = sh_type;
            section.data = data;
        }
        let mut written = Vec::new();
        builder.write(&mut written).expect("it is an image");
        written
    }

    fn slots(second: u64, bytes: u64) -> [(&'static str, u64); 3] {
        [
            ("_settings_slot_0", SLOTS_AT),
            ("_settings_slot_1", second),
            ("_settings_slot_bytes", bytes),
        ]
    }

    fn section(image: &[u8], name: &str) -> (u64, Vec<u8>) {
        let file = object::File::parse(image).expect("it is an image");
        let section = file.section_by_name(name).expect("it is there");
        let data = section.data().expect("it has content");
        (section.address(), data.to_vec())
    }

    #[test]
    fn prop_an_image_takes_settings_again_and_again() {
        let plain = image(&slots(SLOTS_AT + 2048, 2048));
        let mut settings = Settings::built_in();
        let mut image = plain;
        for mass_kg in [2.0, 3.0] {
            settings.carriage.mass_kg = mass_kg;
            let record = encode(1, &settings).expect("it fits");
            image = write_into(&image, &record).expect("it has slots");
            let (address, content) = section(&image, SECTION);
            assert_eq!((address, content.len()), (SLOTS_AT, 4096));
            let stored = decode(&content).expect("it is a record");
            assert_eq!(stored.settings, settings);
            assert!(content[2048..].iter().all(|byte| *byte == ERASED));
            let code = (CODE_AT, vec![1, 2, 3, 4, 5, 6, 7, 8]);
            assert_eq!(section(&image, ".text"), code);
        }
    }

    /// A word of the headers that was hit used to ask for up to 584 GB.
    #[test]
    fn prop_a_damaged_image_never_grows() {
        let sound = image(&slots(SLOTS_AT + 2048, 2048));
        let most = sound.len() + 2 * 2048 + GROWTH_BYTES;
        for place in (0..sound.len() - 4).step_by(4) {
            for word in [u32::MAX, 0x7FFF_FFFF, 0x4000_0000, 0x8000_0000, 0] {
                let mut damaged = sound.clone();
                damaged[place..place + 4].copy_from_slice(&word.to_le_bytes());
                if let Ok(written) = write_into(&damaged, &[0; 1000]) {
                    assert!(written.len() <= most, "word {word:x} at {place}");
                }
            }
        }
    }

    #[test]
    fn prop_images_without_slots_are_refused() {
        let refused = |image: &[u8]| write_into(image, &[0; 1000]).expect_err("it has no slots");
        assert_eq!(
            refused(&image(&[])),
            ImageError::NoSlots("_settings_slot_0")
        );
        let apart = image(&slots(SLOTS_AT + 9000, 2048));
        assert_eq!(refused(&apart), ImageError::SlotsApart);
        let small = image(&slots(SLOTS_AT + 512, 512));
        assert_eq!(refused(&small), ImageError::SlotTooSmall(512));
        let huge = image(&slots(SLOTS_AT + 0xF000_0000, 0xF000_0000));
        assert_eq!(refused(&huge), ImageError::Damaged);
        assert!(matches!(refused(b"PNMA"), ImageError::NotAnImage(_)));
    }
}
