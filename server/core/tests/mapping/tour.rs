//! A robot led about by somebody who talks to it.

use crate::where_is;
use crate::world::{drive, events, laser, say};
use toponym_core::effects::{Effect, Heard};
use toponym_core::event::{Event, Utterance};
use toponym_core::{Config, Mapper};

pub const SECOND_NS: i64 = 1_000_000_000;

/// A robot on its way, and who talks to it.
pub struct Tour {
    pub mapper: Mapper,
    rest: std::collections::VecDeque<Event>,
    /// The clock of robot and guide.
    pub now_ns: i64,
    said: u64,
}

impl Tour {
    pub fn begin() -> Self {
        let rest = events(&drive(1), &laser(), &[]).into();
        let mut tour = Self { mapper: Mapper::new(Config::default()), rest, now_ns: 0, said: 0 };
        tour.go(4.0);
        tour
    }

    /// Drives on for so many seconds.
    pub fn go(&mut self, seconds: f64) {
        let until_ns = self.now_ns + (seconds * SECOND_NS as f64) as i64;
        let later = |event: &Event| matches!(event, Event::Scan(s) if s.stamp_ns > until_ns);
        let due = self.rest.iter().position(later).unwrap_or(self.rest.len());
        for event in self.rest.drain(..due) {
            self.mapper.step(event);
        }
        self.now_ns = until_ns;
    }

    pub fn send(&mut self, u: Utterance) -> Heard {
        let effects = self.mapper.step(Event::Utterance(u));
        let heard = effects.into_iter().find_map(|e| match e {
            Effect::Heard(heard) => Some(heard),
            _ => None,
        });
        heard.expect("what became of it")
    }

    fn utterance(&mut self, text: &str) -> Utterance {
        self.said += 1;
        say(&format!("s{}", self.said), text, self.now_ns)
    }

    pub fn say(&mut self, text: &str) -> Heard {
        let u = self.utterance(text);
        self.send(u)
    }

    pub fn answer(&mut self, to: &Heard, text: &str) -> Heard {
        let mut u = self.utterance(text);
        u.answers = Some(to.id.clone());
        self.send(u)
    }

    pub fn p(&self, name: &str) -> f64 {
        let found = where_is(&self.mapper, name);
        if found.via == "exact" { found.candidates.first().map_or(0.0, |c| c.p_is) } else { 0.0 }
    }
}
