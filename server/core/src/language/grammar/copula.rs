//! Verbs of being, with what they carry: denial, doubt, time, frequency.

use crate::language::act::Quantity;
use crate::language::grammar::cursor::Cursor;

/// How sure words of doubt are: what people take them to mean in surveys of verbal probabilities (after
/// Kent, "Words of Estimative Probability", 1964: probable 0.75, chances about even 0.5).
pub(crate) const LIKELY: f64 = 0.75;
pub(crate) const EVEN: f64 = 0.5;

/// "Is probably not".
#[derive(Clone, Copy, Debug, PartialEq)]
// Each is one word that may or may not stand there.
#[allow(clippy::struct_excessive_bools)]
pub(crate) struct Copula {
    pub(crate) negated: bool,
    /// Probability that the speaker gives the statement.
    pub(crate) certainty: f64,
    /// "Was".
    pub(crate) past: bool,
    /// "Will be".
    pub(crate) future: bool,
    /// "Used to be", "is no longer".
    pub(crate) former: bool,
    /// "Actually": against what was said before.
    pub(crate) corrects: bool,
    /// "Usually".
    pub(crate) quantity: Option<Quantity>,
    /// "Again", "still", "back".
    pub(crate) again: bool,
}

pub(crate) const PLAIN: Copula = Copula {
    negated: false,
    certainty: 1.0,
    past: false,
    future: false,
    former: false,
    corrects: false,
    quantity: None,
    again: false,
};

impl Cursor<'_> {
    /// Reads a verb of being and its adverbs.
    pub(crate) fn copula(&mut self) -> Option<Copula> {
        let start = *self;
        let mut c = PLAIN;
        self.adverbs(&mut c);
        let verb = self.eat_any(
            "can not be|could not be|is going to be|are going to be|used to be|has always been|will not be|will probably be|will be|would be|\
             should not be|should be|shall be|must be|has to be|have to be|might not be|might be|may not be|may be|\
             could be|can be found|can be reached|is reached|are reached|can be|is located|are located|is situated|are situated|seems to be|seem to be|\
             appears to be|looks to be|looks like|sits|lies|stands|comes|come|is|are|am|was|were",
        );
        let Some(verb) = verb else {
            *self = start;
            return None;
        };
        c.negated = verb.contains(" not ");
        c.past = matches!(verb, "was" | "were");
        c.future = verb.starts_with("will") || verb.contains("going to");
        c.former = verb == "used to be";
        c.certainty *= match verb {
            "might not be" | "might be" | "may not be" | "may be" | "could be" | "can be" => EVEN,
            "should be" | "should not be" | "must be" | "seems to be" | "seem to be" | "appears to be"
            | "looks to be" | "can not be" | "could not be" | "looks like" | "would be"
            | "will probably be" => LIKELY,
            _ => 1.0,
        };
        self.adverbs(&mut c);
        Some(c)
    }

    fn adverbs(&mut self, c: &mut Copula) {
        loop {
            if self.sees("not far|not too far|all the way") {
                return;
            }
            if self.eat_any("no longer|not anymore").is_some() {
                c.former = true;
            } else if self.eat_any("not|n't").is_some() {
                c.negated = true;
            } else if self.eat_any("most likely|probably|likely|presumably|supposedly|i think|i believe|i guess").is_some()
            {
                c.certainty *= LIKELY;
            } else if self.eat_any("maybe|perhaps|possibly").is_some() {
                c.certainty *= EVEN;
            } else if self.eat_any("actually|really|in fact|rather").is_some() {
                c.corrects = true;
            } else if let Some(q) = self.quantity_adverb() {
                c.quantity = Some(q);
            } else if self.eat_any("again|still|once again|once more").is_some() {
                c.again = true;
            } else if self
                .eat_any("now|also|definitely|certainly|clearly|obviously|simply|indeed|currently|of course|both|all")
                .is_none()
            {
                return;
            }
        }
    }

    /// "Usually", "never".
    pub(crate) fn quantity_adverb(&mut self) -> Option<Quantity> {
        let word = self.eat_any(
            "almost always|nearly always|always|usually|often|typically|generally|normally|mostly|commonly|\
             frequently|tend to be|sometimes|occasionally|almost never|never|rarely|hardly ever|seldom",
        )?;
        Some(match word {
            "always" => Quantity::All,
            "sometimes" | "occasionally" => Quantity::Sometimes,
            "never" | "almost never" | "rarely" | "hardly ever" | "seldom" => Quantity::Never,
            _ => Quantity::Usually,
        })
    }

    /// Reads words of doubt before a clause: how sure they leave it, and whether they deny it ("I don't
    /// think …"); none if there is none.
    pub(crate) fn hedge(&mut self) -> Option<(f64, bool)> {
        if self
            .eat_any(
                "i do not think that|i do not think|i do not believe|i doubt that|i doubt|we do not think",
            )
            .is_some()
        {
            return Some((LIKELY, true));
        }
        let likely = self.eat_any(
            "i am pretty sure that|i am pretty sure|i am fairly sure|i am quite sure|i am fairly certain|\
             i am almost sure|i think that|i think|we think|i believe that|i believe|i guess|i suppose|i assume|\
             i would say|i would guess|probably|most likely|it looks like|looks like|it seems like|it seems that|\
             it seems|it appears that|apparently|presumably|if i remember correctly|if i remember right|\
             if i recall correctly|if i am not mistaken|as far as i know|as far as i remember|i have a feeling|i reckon",
        );
        if likely.is_some() {
            self.skip(",|that");
            return Some((LIKELY, false));
        }
        let even = self.eat_any(
            "maybe|perhaps|possibly|it might be that|it could be that|i am not sure but|i am not sure , but|\
             i am not sure if|i am not certain but|not sure but|i am not sure|i am not entirely sure but|could be that|\
             there is a chance that",
        );
        even?;
        self.skip(",|that|but");
        Some((EVEN, false))
    }

    /// Reads words of doubt after a clause.
    pub(crate) fn late_hedge(&mut self) -> Option<f64> {
        let start = *self;
        self.eat(",");
        if self
            .eat_any(
                "i think|i believe|i guess|i suppose|probably|if i remember correctly|if i remember right|most likely|\
                 if i am not mistaken|as far as i know|i would say|i am pretty sure|if i recall correctly|i reckon|i assume",
            )
            .is_some()
        {
            return Some(LIKELY);
        }
        if self
            .eat_any(
                "maybe|perhaps|possibly|but i am not sure|i am not sure|or so i think|but i might be wrong",
            )
            .is_some()
        {
            return Some(EVEN);
        }
        *self = start;
        None
    }
}
