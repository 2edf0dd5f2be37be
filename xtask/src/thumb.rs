//! What a Thumb-2 instruction means for the flow of calls and for the stack.
//!
//! Encodings: Arm v7-M Architecture Reference Manual (DDI 0403), chapters A5 to
//! A7. Only what goes elsewhere or moves the stack pointer is told apart; the
//! length of every instruction is known from its first half-word (A5.1).

/// What an instruction does, as far as calls and the stack are concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Neither goes elsewhere nor takes stack.
    None,
    /// May go to this address: a call or a jump.
    GoTo(u32),
    /// Goes to an address in a register, other than a return.
    Indirect,
    /// Takes these bytes of the stack.
    Push(u32),
    /// Moves the stack pointer by what a register says.
    Unknown,
}

/// The instruction at `address`, of which `second` is only read where the first
/// half-word says so; also its length in bytes.
pub fn decode(address: u32, first: u16, second: u16) -> (Effect, u32) {
    if first >= 0xE800 {
        (wide(address, u32::from(first), u32::from(second)), 4)
    } else {
        (narrow(address, u32::from(first)), 2)
    }
}

fn narrow(address: u32, code: u32) -> Effect {
    let from_here = |offset| Effect::GoTo(address.wrapping_add(4).wrapping_add(offset));
    match code {
        // PUSH: a word for each register listed, and one for LR.
        code if code & 0xFE00 == 0xB400 => Effect::Push(4 * (code & 0x1FF).count_ones()),
        // SUB SP, #imm7 * 4.
        code if code & 0xFF80 == 0xB080 => Effect::Push(4 * (code & 0x7F)),
        // BLX, BX of a register; BX LR returns.
        0x4770 => Effect::None,
        code if code & 0xFF00 == 0x4700 => Effect::Indirect,
        // MOV, ADD into PC; into SP.
        code if code & 0xFD87 == 0x4487 => Effect::Indirect,
        code if code & 0xFD87 == 0x4485 => Effect::Unknown,
        // B with a condition (14 and 15 are others), B, CBZ and CBNZ.
        code if code & 0xF000 == 0xD000 && code & 0x0E00 != 0x0E00 => {
            from_here(signed(code & 0xFF, 8) << 1)
        }
        code if code & 0xF800 == 0xE000 => from_here(signed(code & 0x7FF, 11) << 1),
        code if code & 0xF500 == 0xB100 => {
            from_here(((code >> 9 & 1) << 6) | ((code >> 3 & 0x1F) << 1))
        }
        _ => Effect::None,
    }
}

fn wide(address: u32, first: u32, second: u32) -> Effect {
    let both = first << 16 | second;
    let from_here = |offset| Effect::GoTo(address.wrapping_add(4).wrapping_add(offset));
    match both {
        // STMDB SP!, and STR of one register with SP moved down by 4.
        both if both & 0xFFFF_0000 == 0xE92D_0000 => Effect::Push(4 * second.count_ones()),
        both if both & 0xFFFF_0FFF == 0xF84D_0D04 => Effect::Push(4),
        // Stores with SP moved down by something else; of two registers.
        both if both & 0xFFFF_0F00 == 0xF84D_0D00 => Effect::Push(second & 0xFF),
        both if both & 0xFFFF_0000 == 0xE96D_0000 => Effect::Push(4 * (second & 0xFF)),
        // VPUSH: as many words as the immediate says, single and double.
        both if both & 0xFFBF_0E00 == 0xED2D_0A00 => Effect::Push(4 * (second & 0xFF)),
        // SUB.W SP, SP, #constant and SUBW SP, SP, #imm12.
        both if both & 0xFBEF_8F00 == 0xF1AD_0D00 => Effect::Push(modified_constant(first, second)),
        both if both & 0xFBFF_8F00 == 0xF2AD_0D00 => {
            Effect::Push((first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF)
        }
        // SUB.W SP, SP, register.
        both if both & 0xFFEF_0F00 == 0xEBAD_0D00 => Effect::Unknown,
        // LDR PC: also a return, from the stack (`LDR PC, [SP], #4`).
        0xF85D_FB04 => Effect::None,
        both if both & 0xFF70_F000 == 0xF850_F000 => Effect::Indirect,
        // BL; B.W; B.W with a condition (14 and 15 are others).
        both if both & 0xF800_D000 == 0xF000_D000 => from_here(far_offset(first, second)),
        both if both & 0xF800_D000 == 0xF000_9000 => from_here(far_offset(first, second)),
        both if both & 0xF800_D000 == 0xF000_8000 && first & 0x380 != 0x380 => {
            let offset = (first >> 10 & 1) << 20
                | (second >> 11 & 1) << 19
                | (second >> 13 & 1) << 18
                | (first & 0x3F) << 12
                | (second & 0x7FF) << 1;
            from_here(signed(offset, 21))
        }
        _ => Effect::None,
    }
}

/// The offset of BL and B.W (A7.7.18, A7.7.12): 25 bits.
fn far_offset(first: u32, second: u32) -> u32 {
    let sign = first >> 10 & 1;
    let bit = |place: u32| 1 ^ (second >> place & 1) ^ sign;
    let offset =
        sign << 24 | bit(13) << 23 | bit(11) << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1;
    signed(offset, 25)
}

/// A constant as data processing instructions encode it (A5.3.2).
fn modified_constant(first: u32, second: u32) -> u32 {
    let code = (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF;
    let byte = code & 0xFF;
    match code >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte * 0x0101_0101,
        _ => (0x80 | byte & 0x7F).rotate_right(code >> 7),
    }
}

/// Extends the sign of a number of `bits` bits.
fn signed(value: u32, bits: u32) -> u32 {
    let sign = 1 << (bits - 1);
    (value ^ sign).wrapping_sub(sign)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn effect(address: u32, first: u16, second: u16) -> Effect {
        decode(address, first, second).0
    }

    #[test]
    fn val_instructions_as_the_gnu_assembler_encodes_them() {
        // Each line: the assembler's text at this address, and its half-words.
        // bl 0x1000 at 0x2000; b.w 0x2100 at 0x2000; bne.w 0x1ff0 at 0x2000.
        assert_eq!(effect(0x2000, 0xF7FE, 0xFFFE), Effect::GoTo(0x1000));
        assert_eq!(effect(0x2000, 0xF000, 0xB87E), Effect::GoTo(0x2100));
        assert_eq!(effect(0x2000, 0xF47F, 0xAFF6), Effect::GoTo(0x1FF0));
        // beq 0x2010; b 0x1ffe; cbz r0, 0x2008; cbnz r3, 0x2044, all at 0x2000.
        assert_eq!(effect(0x2000, 0xD006, 0), Effect::GoTo(0x2010));
        assert_eq!(effect(0x2000, 0xE7FD, 0), Effect::GoTo(0x1FFE));
        assert_eq!(effect(0x2000, 0xB110, 0), Effect::GoTo(0x2008));
        assert_eq!(effect(0x2000, 0xBB03, 0), Effect::GoTo(0x2044));
        // push {r4, r5, r7, lr}; push.w {r8, r9, r11}; vpush {d8-d10}; sub sp, #24.
        assert_eq!(effect(0, 0xB5B0, 0), Effect::Push(16));
        assert_eq!(effect(0, 0xE92D, 0x0B00), Effect::Push(12));
        assert_eq!(effect(0, 0xED2D, 0x8B06), Effect::Push(24));
        assert_eq!(effect(0, 0xB086, 0), Effect::Push(24));
        // sub.w sp, sp, #1024; subw sp, sp, #1044; str r11, [sp, #-4]!.
        assert_eq!(effect(0, 0xF5AD, 0x6D80), Effect::Push(1024));
        assert_eq!(effect(0, 0xF2AD, 0x4D14), Effect::Push(1044));
        assert_eq!(effect(0, 0xF84D, 0xBD04), Effect::Push(4));
        // strd r0, r1, [sp, #-16]!; sub.w sp, sp, #0xff00ff; sub.w sp, sp, r4.
        assert_eq!(effect(0, 0xE96D, 0x0104), Effect::Push(16));
        assert_eq!(effect(0, 0xF1AD, 0x1DFF), Effect::Push(0xFF_00FF));
        assert_eq!(effect(0, 0xEBAD, 0x0D04), Effect::Unknown);
        // bl far ahead and far back; ldr pc, [sp], #4; ldr.w pc, [r0, r1, lsl #2].
        assert_eq!(effect(0x344A, 0xF123, 0xFA29), Effect::GoTo(0x12_68A0));
        assert_eq!(effect(0x344E, 0xF6DC, 0xFDD3), Effect::GoTo(0xFFED_FFF8));
        assert_eq!(effect(0, 0xF85D, 0xFB04), Effect::None);
        assert_eq!(effect(0, 0xF850, 0xF021), Effect::Indirect);
        // bx lr; blx r3; bx r1; mov pc, r2; mov sp, r7; udf #254; svc 0.
        assert_eq!(effect(0, 0x4770, 0), Effect::None);
        assert_eq!(effect(0, 0x4798, 0), Effect::Indirect);
        assert_eq!(effect(0, 0x4708, 0), Effect::Indirect);
        assert_eq!(effect(0, 0x4697, 0), Effect::Indirect);
        assert_eq!(effect(0, 0x46BD, 0), Effect::Unknown);
        assert_eq!(effect(0, 0xDEFE, 0), Effect::None);
        assert_eq!(effect(0, 0xDF00, 0), Effect::None);
        // vmov.f32 s0, s1; bkpt 0xab: two lengths.
        assert_eq!(decode(0, 0xEEB0, 0x0A60), (Effect::None, 4));
        assert_eq!(decode(0, 0xBEAB, 0), (Effect::None, 2));
    }
}
