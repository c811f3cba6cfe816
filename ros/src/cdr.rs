//! Messages as bytes: OMG's Common Data Representation with the head of four bytes that ROS 2 puts in front.

use hiroz_cdr::{BigEndian, LittleEndian};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Length of the head, bytes.
const HEAD: usize = 4;
/// Head of little-endian CDR.
const LITTLE: [u8; HEAD] = [0, 1, 0, 0];

/// Reads a message; what is behind it is left.
///
/// # Errors
/// What is wrong with it. No length is believed before so much is there.
pub fn read<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let (head, body) = bytes
        .split_first_chunk::<HEAD>()
        .ok_or_else(|| format!("{} bytes are too few for a message", bytes.len()))?;
    let read = match head[..2] {
        [0, 0] => hiroz_cdr::from_bytes::<T, BigEndian>(body),
        [0, 1] => hiroz_cdr::from_bytes::<T, LittleEndian>(body),
        _ => return Err(format!("it is no CDR: it begins with {head:02x?}")),
    };
    read.map(|(message, _)| message).map_err(|e| e.to_string())
}

/// A message as little-endian bytes.
///
/// # Errors
/// If it has more elements than can be counted.
pub fn write<T: Serialize>(message: &T) -> Result<Vec<u8>, String> {
    let body = hiroz_cdr::to_vec::<T, LittleEndian>(message, 256).map_err(|e| e.to_string())?;
    Ok([&LITTLE[..], &body].concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::msg::{LaserScan, StringMsg};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn whatever_comes_is_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = read::<LaserScan>(&bytes);
            let _ = read::<crate::msg::TFMessage>(&[&LITTLE[..], &bytes].concat());
        }
    }

    #[test]
    fn a_length_is_not_believed() {
        let mut bytes = write(&LaserScan::default()).unwrap();
        // The count of ranges, of which there are none, and that of intensities.
        let at = bytes.len() - 8;
        bytes[at..at + 4].copy_from_slice(&100_000_000_u32.to_le_bytes());
        assert!(read::<LaserScan>(&bytes).is_err());
    }

    #[test]
    fn a_text_is_read_from_either_end() {
        let text = StringMsg { data: "Küche".into() };
        let little = write(&text).unwrap();
        assert_eq!(little, [&[0, 1, 0, 0, 7, 0, 0, 0][..], "Küche\0".as_bytes()].concat());
        assert_eq!(read::<StringMsg>(&little), Ok(text.clone()));
        let big = [&[0, 0, 0, 0, 0, 0, 0, 7][..], "Küche\0".as_bytes()].concat();
        assert_eq!(read::<StringMsg>(&big), Ok(text));
        assert_eq!(
            read::<StringMsg>(&[0, 1, 0, 0, 0, 0, 0, 0]),
            Ok(StringMsg::default()),
            "no length, no NUL"
        );
        assert!(read::<StringMsg>(&[0, 1]).is_err() && read::<StringMsg>(b"{\"data\":\"\"}").is_err());
    }
}
