//! Answer of `ask/grid`: the occupancy of a map as a picture whose pixels are its numbers.
//!
//! An indexed PNG holds a cell in about a tenth of a byte where JSON takes two to four, any browser shows it, and any
//! decoder that leaves indices alone reads the numbers back.

use crate::Invalid;
use crate::answer::MapIdentity;
use crate::stream::Pose;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use png::{BitDepth, ColorType, Compression, Transformations};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::io::Cursor;

/// Index of what is unknown; those below are percentages of occupancy.
const UNKNOWN: u8 = 101;
/// Cells that a picture may have at most.
const CELLS_MAX: usize = 16_000_000;
/// Under this keyword a PNG of its own carries the rest of the answer.
pub const PNG_TEXT: &str = "toponym";

/// Answer of `ask/grid`: occupancy of the best graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridReply {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// `grid`.
    pub query: String,
    /// Of which map.
    pub map: MapIdentity,
    /// Edge of a cell.
    pub resolution_m: f64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pose of the lower left corner in the map.
    pub map_from_grid: Pose,
    /// The cells as an indexed PNG, in JSON as Base64: index 0 free … 100 occupied, 101 unknown (and transparent); its
    /// first row has the highest y.
    #[serde(serialize_with = "as_base64", deserialize_with = "of_base64")]
    pub png: Vec<u8>,
}

impl GridReply {
    /// −1 unknown, 0 free … 100 occupied; row by row from the lowest y, `width · height` of them.
    ///
    /// # Errors
    /// If it is no such picture.
    pub fn cells(&self) -> Result<Vec<i8>, Invalid> {
        decode(&self.png, self.width, self.height).map_err(|why| Invalid::new("png", why))
    }

    /// The picture alone, with the rest of the answer as JSON in its text chunk `toponym`.
    ///
    /// # Errors
    /// If it has no such cells.
    pub fn picture(&self) -> Result<Vec<u8>, Invalid> {
        let rest = Self { png: Vec::new(), ..self.clone() };
        let text = serde_json::to_string(&rest).map_err(|e| Invalid::new("png", e.to_string()))?;
        encode(self.width, self.height, &self.cells()?, Some(&text))
    }
}

/// Cells as an indexed PNG.
///
/// # Errors
/// If there are none, or not `width · height`.
pub fn png_of(width: usize, height: usize, cells: &[i8]) -> Result<Vec<u8>, Invalid> {
    if cells.is_empty() { Ok(Vec::new()) } else { encode(width, height, cells, None) }
}

fn encode(width: usize, height: usize, cells: &[i8], text: Option<&str>) -> Result<Vec<u8>, Invalid> {
    let wrong = |why: String| Invalid::new("png", why);
    if cells.len() != width * height {
        return Err(wrong(format!("{} cells are not {width} by {height}", cells.len())));
    }
    let index = |cell: &i8| if *cell < 0 { UNKNOWN } else { (*cell as u8).min(100) };
    let rows = cells.chunks_exact(width.max(1)).rev();
    let pixels: Vec<u8> = rows.flat_map(|row| row.iter().map(index)).collect();
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, width as u32, height as u32);
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Balanced);
    // As ROS draws maps: free nearly white, unknown a light grey, occupied black.
    let grey = |index: u8| if index == UNKNOWN { 205 } else { 254 - (u32::from(index) * 254 / 100) as u8 };
    encoder.set_palette((0..=UNKNOWN).flat_map(|k| [grey(k); 3]).collect::<Vec<u8>>());
    encoder.set_trns((0..=UNKNOWN).map(|k| if k == UNKNOWN { 0 } else { 255 }).collect::<Vec<u8>>());
    if let Some(text) = text {
        encoder
            .add_itxt_chunk(PNG_TEXT.into(), text.into())
            .map_err(|e| Invalid::new("png", e.to_string()))?;
    }
    let mut writer = encoder.write_header().map_err(|e| wrong(e.to_string()))?;
    writer.write_image_data(&pixels).map_err(|e| wrong(e.to_string()))?;
    writer.finish().map_err(|e| wrong(e.to_string()))?;
    Ok(png)
}

fn decode(png: &[u8], width: usize, height: usize) -> Result<Vec<i8>, String> {
    if width.saturating_mul(height) > CELLS_MAX {
        return Err(format!("{width} by {height} cells are more than {CELLS_MAX}"));
    }
    if png.is_empty() && width * height == 0 {
        return Ok(Vec::new());
    }
    let mut decoder = png::Decoder::new(Cursor::new(png));
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(|e| e.to_string())?;
    let info = reader.info();
    if (info.width as usize, info.height as usize) != (width, height) {
        return Err(format!("it is {} by {}, not {width} by {height}", info.width, info.height));
    }
    if (info.color_type, info.bit_depth) != (ColorType::Indexed, BitDepth::Eight) {
        return Err("its pixels are no indices of 8 bits".into());
    }
    let mut pixels = vec![0; width * height];
    reader.next_frame(&mut pixels).map_err(|e| e.to_string())?;
    let cell = |&index: &u8| if index >= UNKNOWN { -1 } else { index as i8 };
    Ok(pixels.chunks_exact(width.max(1)).rev().flat_map(|row| row.iter().map(cell)).collect())
}

fn as_base64<S: Serializer>(bytes: &[u8], to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(&STANDARD.encode(bytes))
}

fn of_base64<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<u8>, D::Error> {
    STANDARD.decode(String::deserialize(from)?).map_err(de::Error::custom)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn reply(width: usize, height: usize, png: Vec<u8>) -> GridReply {
        GridReply {
            v: 1,
            query: "grid".into(),
            map: MapIdentity::default(),
            resolution_m: 0.05,
            width,
            height,
            map_from_grid: Pose::default(),
            png,
        }
    }

    proptest! {
        #[test]
        fn numbers_come_back(width in 1_usize..30, height in 1_usize..30, seed in any::<u64>()) {
            let number = |k: u64| (seed.wrapping_mul(k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) % 102;
            let cells: Vec<i8> = (0..(width * height) as u64).map(|k| number(k) as i8 - 1).collect();
            let grid = reply(width, height, png_of(width, height, &cells).unwrap());
            let json = serde_json::to_string(&grid).unwrap();
            prop_assert_eq!(serde_json::from_str::<GridReply>(&json).unwrap().cells().unwrap(), cells.clone());
            let picture = reply(width, height, grid.picture().unwrap());
            prop_assert_eq!(picture.cells().unwrap(), cells);
        }
    }

    #[test]
    fn a_picture_tells_where_it_lies() {
        let grid = reply(2, 1, png_of(2, 1, &[0, -1]).unwrap());
        let png = grid.picture().unwrap();
        let reader = png::Decoder::new(Cursor::new(png)).read_info().unwrap();
        let text = &reader.info().utf8_text[0];
        let told: GridReply = serde_json::from_str(&text.get_text().unwrap()).unwrap();
        assert_eq!((text.keyword.as_str(), told), (PNG_TEXT, reply(2, 1, Vec::new())));
    }

    #[test]
    fn an_empty_map_has_no_picture_and_a_wrong_one_is_refused() {
        assert!(reply(0, 0, png_of(0, 0, &[]).unwrap()).cells().unwrap().is_empty());
        let png = png_of(2, 1, &[0, -1]).unwrap();
        for (width, height) in [(1, 2), (0, 0), (1_000_000, 1_000_000), (usize::MAX, 2)] {
            assert!(reply(width, height, png.clone()).cells().is_err(), "{width} {height}");
        }
        for end in 0..png.len() {
            // Nothing panics, whatever was cut off.
            let _ = reply(2, 1, png[..end].to_vec()).cells();
        }
        assert!(reply(1, 1, b"GIF89a".to_vec()).cells().is_err());
        assert!(png_of(2, 2, &[0]).is_err());
    }
}
