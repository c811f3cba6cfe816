//! What a picture is made of, and the forms in which it is written.

use super::canvas::Canvas;
use anyhow::{Context, Result, bail};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use std::path::Path;
use svg::node::element::{Circle, Image, Polyline, Rectangle, Text, Title};

/// Of the letters in SVG: they are as wide as the canvas's.
const FONT: &str = "font: bold 15px 'DejaVu Sans Mono', Menlo, Consolas, monospace; white-space: pre; \
                    paint-order: stroke; stroke: #fff; stroke-width: 3px; stroke-linejoin: round";

/// Marks in the order in which they cover each other; pixels, from the upper left corner.
#[derive(Clone, Debug)]
pub struct Sketch {
    /// Width and height.
    pub size: Size,
    /// What is drawn.
    pub marks: Vec<Mark>,
}

/// A part of a picture.
#[derive(Clone, Debug)]
pub enum Mark {
    /// Cells of a grid, each some pixels wide.
    Cells(Canvas),
    /// Through points.
    Line { points: Vec<Point>, colour: Rgb888, width: u32 },
    /// Filled.
    Disc { middle: Point, diameter: u32, colour: Rgb888 },
    /// On a white halo.
    Text { text: String, top_left: Point, colour: Rgb888 },
}

impl Sketch {
    /// As pixels.
    pub fn canvas(&self) -> Canvas {
        let mut canvas = Canvas::new(self.size, Rgb888::WHITE);
        for mark in &self.marks {
            match mark {
                Mark::Cells(cells) => canvas.lay(cells),
                Mark::Line { points, colour, width } => {
                    for pair in points.windows(2) {
                        canvas.line(pair[0], pair[1], *colour, *width);
                    }
                }
                Mark::Disc { middle, diameter, colour } => canvas.disc(*middle, *diameter, *colour),
                Mark::Text { text, top_left, colour } => {
                    canvas.text(text, *top_left, *colour, Rgb888::WHITE);
                }
            }
        }
        canvas
    }

    /// As SVG: sharp at any size, its words can be searched.
    pub fn svg(&self, title: &str) -> Result<String> {
        let (width, height) = (self.size.width, self.size.height);
        let paper = Rectangle::new().set("width", width).set("height", height).set("fill", "#fff");
        let mut document = svg::Document::new()
            .set("viewBox", (0, 0, width, height))
            .set("width", width)
            .set("height", height)
            .add(Title::new(title))
            .add(paper);
        for mark in &self.marks {
            document = match mark {
                Mark::Cells(cells) => {
                    let mut png = Vec::new();
                    cells.write_png(&mut png)?;
                    let image = Image::new()
                        .set("width", cells.size().width)
                        .set("height", cells.size().height)
                        .set("style", "image-rendering: pixelated")
                        .set("href", format!("data:image/png;base64,{}", STANDARD.encode(png)));
                    document.add(image)
                }
                Mark::Line { points, colour, width } => {
                    let points: Vec<String> = points.iter().map(|p| format!("{},{}", p.x, p.y)).collect();
                    let line = Polyline::new()
                        .set("points", points.join(" "))
                        .set("fill", "none")
                        .set("stroke", hex(*colour))
                        .set("stroke-width", *width);
                    document.add(line)
                }
                Mark::Disc { middle, diameter, colour } => {
                    let disc = Circle::new()
                        .set("cx", middle.x)
                        .set("cy", middle.y)
                        .set("r", f64::from(*diameter) / 2.0)
                        .set("fill", hex(*colour));
                    document.add(disc)
                }
                Mark::Text { text, top_left, colour } => {
                    let text = Text::new(text.as_str())
                        .set("x", top_left.x)
                        .set("y", top_left.y + 14)
                        .set("style", FONT)
                        .set("fill", hex(*colour));
                    document.add(text)
                }
            };
        }
        Ok(document.to_string())
    }

    /// Into a file, by the end of its name.
    pub fn write(&self, file: &Path, title: &str) -> Result<()> {
        let bytes = match form(file)? {
            Form::Svg => self.svg(title)?.into_bytes(),
            Form::Png => {
                let mut png = Vec::new();
                self.canvas().write_png(&mut png)?;
                png
            }
        };
        std::fs::write(file, bytes).with_context(|| file.display().to_string())
    }
}

/// Forms of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    Png,
    Svg,
}

/// The form that a file's name asks for.
///
/// # Errors
/// If it ends neither so nor so.
pub fn form(file: &Path) -> Result<Form> {
    let end = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match end.as_str() {
        "png" => Ok(Form::Png),
        "svg" => Ok(Form::Svg),
        _ => bail!("{}: give a name that ends in .png or .svg", file.display()),
    }
}

fn hex(colour: Rgb888) -> String {
    format!("#{:02x}{:02x}{:02x}", colour.r(), colour.g(), colour.b())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sketch() -> Sketch {
        let mut cells = Canvas::new(Size::new(40, 30), Rgb888::WHITE);
        cells.disc(Point::new(5, 5), 3, Rgb888::BLUE);
        let line =
            Mark::Line { points: vec![Point::new(0, 20), Point::new(39, 20)], colour: Rgb888::RED, width: 1 };
        let text = Mark::Text { text: "R&D <lab>".into(), top_left: Point::new(1, 1), colour: Rgb888::BLACK };
        Sketch { size: Size::new(60, 30), marks: vec![Mark::Cells(cells), line, text] }
    }

    #[test]
    fn pixels_are_what_the_marks_are() {
        let canvas = sketch().canvas();
        assert_eq!((canvas.size(), canvas.pixel(Point::new(30, 20))), (Size::new(60, 30), Some(Rgb888::RED)));
    }

    #[test]
    fn the_svg_is_xml_whatever_a_name_is() {
        let text = sketch().svg("a < b").unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let of = |tag: &str| document.descendants().find(|n| n.has_tag_name(tag)).unwrap();
        assert_eq!(of("text").text().map(str::trim), Some("R&D <lab>"));
        assert_eq!(of("title").text().map(str::trim), Some("a < b"));
        assert_eq!(of("polyline").attribute("points"), Some("0,20 39,20"));
        assert!(of("image").attribute("href").unwrap().starts_with("data:image/png;base64,"));
    }

    #[test]
    fn the_form_is_in_the_name() {
        let of = |name: &str| form(Path::new(name));
        assert_eq!((of("a.SVG").unwrap(), of("b/c.png").unwrap()), (Form::Svg, Form::Png));
        assert!(of("a.jpg").is_err() && of("svg").is_err());
    }
}
