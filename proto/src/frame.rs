//! Frames: what journals, checkpoints and records are made of.
//!
//! ```text
//! length u32 │ crc u32 │ index u64 │ payload        little-endian
//! ```
//! The checksum is CRC-32 (IEEE) over length, index and payload, begun with a salt: the map's.
//! A length of zero with nothing but zeros behind it is where writing stopped.

/// Bytes in front of a payload.
pub const HEAD: usize = 16;

/// Adds a frame.
pub fn append(out: &mut Vec<u8>, salt: u32, index: u64, payload: &[u8]) {
    let length = payload.len() as u32;
    out.extend(length.to_le_bytes());
    out.extend(checksum(salt, length, index, payload).to_le_bytes());
    out.extend(index.to_le_bytes());
    out.extend(payload);
}

fn checksum(salt: u32, length: u32, index: u64, payload: &[u8]) -> u32 {
    let mut crc = crc32fast::Hasher::new_with_initial(salt);
    crc.update(&length.to_le_bytes());
    crc.update(&index.to_le_bytes());
    crc.update(payload);
    crc.finalize()
}

/// What stands at a place of a file.
#[derive(Debug, PartialEq, Eq)]
pub enum Found<'a> {
    /// A whole frame.
    Frame {
        /// Its number.
        index: u64,
        /// What is in it.
        payload: &'a [u8],
        /// Where the next begins.
        end: usize,
    },
    /// Nothing was written from here on.
    Blank,
    /// Something that is no frame.
    Broken(&'static str),
}

/// Reads what stands at byte `at`.
pub fn read(bytes: &[u8], at: usize, salt: u32) -> Found<'_> {
    let rest = bytes.get(at..).unwrap_or_default();
    let (Some(length), Some(crc), Some(index)) = (u32_at(rest, 0), u32_at(rest, 4), u64_at(rest, 8)) else {
        return blank_or(rest, "breaks off inside the head of a frame");
    };
    if length == 0 {
        return blank_or(rest, "a frame of length 0");
    }
    let end = HEAD + length as usize;
    let Some(payload) = rest.get(HEAD..end) else {
        return Found::Broken("a frame reaches beyond the end of the file");
    };
    if checksum(salt, length, index, payload) != crc {
        return Found::Broken("a frame's checksum is another");
    }
    Found::Frame { index, payload, end: at + end }
}

fn blank_or<'a>(rest: &[u8], why: &'static str) -> Found<'a> {
    if rest.iter().all(|b| *b == 0) { Found::Blank } else { Found::Broken(why) }
}

/// The four bytes at `at`, little-endian.
pub fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

/// The eight bytes at `at`, little-endian.
pub fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_read_as_it_was_written() {
        let mut bytes = Vec::new();
        append(&mut bytes, 7, 41, b"hall");
        append(&mut bytes, 7, 42, b"gym");
        bytes.resize(bytes.len() + 64, 0);
        let Found::Frame { index: 41, payload: b"hall", end } = read(&bytes, 0, 7) else { panic!() };
        let Found::Frame { index: 42, payload: b"gym", end } = read(&bytes, end, 7) else { panic!() };
        assert_eq!(read(&bytes, end, 7), Found::Blank);
        assert!(matches!(read(&bytes, 0, 8), Found::Broken(_)), "another map's");
    }

    #[test]
    fn every_bit_counts() {
        let mut bytes = Vec::new();
        append(&mut bytes, 7, 41, b"this is the gym");
        for bit in 0..8 * bytes.len() {
            let mut turned = bytes.clone();
            turned[bit / 8] ^= 1 << (bit % 8);
            assert!(matches!(read(&turned, 0, 7), Found::Broken(_)), "bit {bit}");
        }
    }
}
