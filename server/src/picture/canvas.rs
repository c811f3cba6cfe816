//! An RGB picture to draw on, and its PNG.

use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::iso_8859_1::FONT_9X18_BOLD;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::{Circle, Line, PrimitiveStyle, Rectangle};
use embedded_graphics::text::{Baseline, Text};
use std::convert::Infallible;
use std::io::Write;

/// Size of a letter, pixels.
pub const LETTER: Size = FONT_9X18_BOLD.character_size;

/// A picture; what falls outside is not drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Canvas {
    size: Size,
    rgb: Vec<u8>,
}

impl Canvas {
    /// A picture in one colour.
    pub fn new(size: Size, background: Rgb888) -> Self {
        let pixel = [background.r(), background.g(), background.b()];
        Self { size, rgb: pixel.repeat(size.width as usize * size.height as usize) }
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, area: Rectangle, colour: Rgb888) {
        let Ok(()) = self.fill_solid(&area, colour);
    }

    /// Lays another on it, corner on corner.
    pub fn lay(&mut self, other: &Self) {
        let (own, width) = (self.size.width as usize * 3, other.size.width.min(self.size.width) as usize * 3);
        let rows = other.rgb.chunks_exact(other.size.width.max(1) as usize * 3);
        for (to, from) in self.rgb.chunks_exact_mut(own.max(1)).zip(rows) {
            to[..width].copy_from_slice(&from[..width]);
        }
    }

    /// Draws a line, one or more pixels wide.
    pub fn line(&mut self, a: Point, b: Point, colour: Rgb888, width: u32) {
        let Ok(()) = Line::new(a, b).into_styled(PrimitiveStyle::with_stroke(colour, width)).draw(self);
    }

    /// Draws a disc.
    pub fn disc(&mut self, middle: Point, diameter: u32, colour: Rgb888) {
        let style = PrimitiveStyle::with_fill(colour);
        let Ok(()) = Circle::with_center(middle, diameter).into_styled(style).draw(self);
    }

    /// Writes a line of text, top left corner at `at`, on a halo in another colour.
    pub fn text(&mut self, text: &str, at: Point, colour: Rgb888, halo: Rgb888) {
        let offsets = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
        for (x, y) in offsets {
            self.letters(text, at + Point::new(x, y), halo);
        }
        self.letters(text, at, colour);
    }

    fn letters(&mut self, text: &str, at: Point, colour: Rgb888) {
        let style = MonoTextStyle::new(&FONT_9X18_BOLD, colour);
        let Ok(_) = Text::with_baseline(text, at, style, Baseline::Top).draw(self);
    }

    /// Colour of a pixel; none outside.
    pub fn pixel(&self, at: Point) -> Option<Rgb888> {
        let index = self.index(at)?;
        let rgb = self.rgb.get(index..index + 3)?;
        Some(Rgb888::new(rgb[0], rgb[1], rgb[2]))
    }

    /// Writes the picture as PNG.
    pub fn write_png(&self, out: impl Write) -> Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::new(out, self.size.width, self.size.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()
    }

    fn index(&self, at: Point) -> Option<usize> {
        let (x, y) = (u32::try_from(at.x).ok()?, u32::try_from(at.y).ok()?);
        let inside = x < self.size.width && y < self.size.height;
        inside.then(|| (y as usize * self.size.width as usize + x as usize) * 3)
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        self.size
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(at, colour) in pixels {
            if let Some(index) = self.index(at)
                && let Some(rgb) = self.rgb.get_mut(index..index + 3)
            {
                rgb.copy_from_slice(&[colour.r(), colour.g(), colour.b()]);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_png_is_the_picture() {
        let mut canvas = Canvas::new(Size::new(5, 3), Rgb888::WHITE);
        canvas.line(Point::new(0, 1), Point::new(9, 1), Rgb888::RED, 1);
        let mut bytes = Vec::new();
        canvas.write_png(&mut bytes).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut rgb).unwrap();
        assert_eq!((info.width, info.height), (5, 3));
        assert_eq!(rgb, [[255; 15], [255, 0, 0].repeat(5).try_into().unwrap(), [255; 15]].concat());
    }
}
