//! Lengths and counts: "about twenty meters", "a couple of".

use crate::language::grammar::cursor::Cursor;
use crate::language::lexicon::numbers::quantity;
use crate::language::measure::{Distance, Unit};

impl Cursor<'_> {
    /// "About twenty meters".
    pub(crate) fn distance(&mut self) -> Option<Distance> {
        let start = *self;
        self.skip("less than|more than|no more than|not more than|at most|at least|up to|a good|over|under|close to|about|approximately|around|roughly|maybe|like|nearly|almost|some|probably|another|only|just|perhaps");
        let found = self.number().and_then(|(value, words)| {
            self.advance(words);
            let unit = match self
                .eat_any("meters|metres|meter|metre|m|feet|foot|ft|yards|yard|yd|steps|step|paces|pace")?
            {
                "meters" | "metres" | "meter" | "metre" | "m" => Unit::Metre,
                "feet" | "foot" | "ft" => Unit::Foot,
                "yards" | "yard" | "yd" => Unit::Yard,
                _ => Unit::Step,
            };
            Some(Distance { value, unit })
        });
        if found.is_none() {
            *self = start;
        }
        found
    }

    /// The number here and how many words it takes.
    pub(crate) fn number(&self) -> Option<(f64, usize)> {
        let lead = match (self.peek(0), self.peek(1), self.peek(2)) {
            ("a", "couple", "of") => return Some((2.0, 3)),
            ("a", "couple", _) => return Some((2.0, 2)),
            // "A few" is three in most ears.
            ("a", "few", _) => return Some((3.0, 2)),
            ("a", "hundred", _) => return Some((100.0, 2)),
            ("a", "dozen", _) => return Some((12.0, 2)),
            ("a", ..) => return Some((1.0, 1)),
            _ => 0,
        };
        // A number has at most this many words: "one hundred and twenty five".
        let words: Vec<String> = (0..5).map(|i| self.peek(lead + i).to_owned()).collect();
        quantity(&words, 0).map(|(n, end)| (n, end + lead))
    }

    pub(crate) fn advance(&mut self, words: usize) {
        for _ in 0..words {
            self.step();
        }
    }
}
