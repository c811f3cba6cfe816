//! Acts in writing, for reports and for scores.
//!
//! ```text
//! analysis = "none" ["~" REASON] | act {"&" act}
//! REASON   = "command_out_of_scope" | "idiom" | "chatter"
//! act      = content ["@" FRAME] ["~hedge"] ["~asr_repair"]
//! content  = "label(" phrase "," phrase ")" [("&same(" | "&other(") phrase "," phrase ")"]
//!          | "loc(" phrase "," relation {"," phrase} ")"
//!          | "alias(" phrase "," phrase ")"             what it is, what else it is called
//!          | "attr(" phrase "," VALUE ")"
//!          | "neg(" content ")"
//!          | "cor(" ("any" | content) "," content ")"   what is taken back, what holds
//!          | ("same(" | "other(") phrase "," phrase ")"
//!          | "ask(" QUESTION "," (phrase | content) ")"
//!          | "gen(" phrase "," RELATION "," phrase "," QUANTITY ")"
//!          | "route(" step {";" step} ")" ["->" content]
//! phrase   = head ["?asr"] ["{" feature {"," feature} "}"] {"[" relation {" " phrase} "]"}
//! head     = NAME | "place" | "it" | "here" | "there" | "agent" | "speaker" | "path" | "prev_place"
//!          | "start" | "visited" | "x" | "*"
//! relation = RELATION ["{" modifier {"," modifier} "}"]
//! feature  = "name=" TEXT | "poss=" (TEXT | "speaker") | QUALITY | "ord=" (N | "last" | "next") | "count=" N
//!          | "nearest" | "plural" | "this" | "other" | "rel=" ["-"] N | "for=" TEXT
//! modifier = "just" | "dist=" N ("m" | "ft" | "yd" | "steps") | "count=" N
//! FRAME    = "ego_hearer" | "ego_speaker" | "ego_path" | "intrinsic" | "absolute"
//! QUESTION = "where" | "what" | "why" | "route" | "how_far" | "whether"
//! QUANTITY = "all" | "usually" | "sometimes" | "never"
//! RELATION = as `Relation::notation` writes it
//! step     = relations and turns in the order said: "down hallway until at elevator{plural}"
//! NAME     = the canonical name of the kind, "_" for spaces; names of people keep their capitals
//! ```
//!
//! `x` is what is asked for, `*` any place, `path` the way one is going, `agent` who is spoken to.

use crate::language::act::{
    About, Act, Content, Features, Frame, Head, Locate, Modifiers, Ordinal, Owner, Phrase, Quantity,
    Question, Reason, Restriction, Sameness, Unit,
};
use crate::language::lexicon::numbers::numbers_in_digits;

/// The acts in writing; `none` if there is none.
pub(super) fn notation(acts: &[Act]) -> String {
    if acts.is_empty() {
        return "none".to_owned();
    }
    acts.iter().map(act_notation).collect::<Vec<_>>().join("&")
}

fn act_notation(act: &Act) -> String {
    let mut text = content_notation(&act.content);
    if let Content::Locate(locate) = &act.content {
        text.push_str(frame_notation(locate.frame));
        if locate.repaired {
            text.push_str("~asr_repair");
        }
    }
    if act.certainty < 1.0 {
        text.push_str("~hedge");
    }
    text
}

pub(super) fn content_notation(content: &Content) -> String {
    match content {
        Content::Label { at, what, sameness } => {
            let (at, what) = (phrase_notation(at), phrase_notation(what));
            match sameness {
                Sameness::Same => format!("label({at},{what})&same({at},{what})"),
                Sameness::Other => format!("label({at},{what})&other({at},{what})"),
                Sameness::Open => format!("label({at},{what})"),
            }
        }
        Content::Locate(locate) => locate_notation(locate),
        Content::Alias { what, also } => {
            format!("alias({},{})", phrase_notation(what), phrase_notation(also))
        }
        Content::Attribute { what, value } => format!("attr({},{})", phrase_notation(what), joined(value)),
        Content::Negate(inner) => format!("neg({})", content_notation(inner)),
        Content::Correct { was, is } => {
            let was = was.as_ref().map_or_else(|| "any".to_owned(), |w| content_notation(w));
            format!("cor({was},{})", content_notation(is))
        }
        Content::Same { what, like, same } => {
            let act = if *same { "same" } else { "other" };
            format!("{act}({},{})", phrase_notation(what), phrase_notation(like))
        }
        Content::Ask { kind, about } => {
            let about = match about {
                About::Phrase(phrase) => phrase_notation(phrase),
                About::Content(content) => content_notation(content),
            };
            format!("ask({},{about})", question_notation(*kind))
        }
        Content::Generic { figure, relation, landmark, quantity } => format!(
            "gen({},{},{},{})",
            phrase_notation(figure),
            relation.notation(),
            phrase_notation(landmark),
            quantity_notation(*quantity)
        ),
        Content::Route { steps, then } => {
            let then = then.as_ref().map_or_else(String::new, |t| format!("->{}", content_notation(t)));
            format!("route({}){then}", steps.join(";"))
        }
        Content::Ignored(reason) => format!("none~{}", reason_notation(*reason)),
    }
}

fn locate_notation(locate: &Locate) -> String {
    let mut figure = phrase_notation(&locate.figure);
    if locate.repaired {
        figure.push_str("?asr");
    }
    let relation = format!("{}{}", locate.relation.notation(), modifiers_notation(&locate.modifiers));
    let landmarks: Vec<String> = locate.landmarks.iter().map(phrase_notation).collect();
    format!("loc({figure},{relation},{})", landmarks.join(","))
}

pub(super) fn relation_notation(r: &Restriction) -> String {
    let landmarks: Vec<String> = r.landmarks.iter().map(phrase_notation).collect();
    format!("{}{} {}", r.relation.notation(), modifiers_notation(&r.modifiers), landmarks.join(" "))
}

pub(super) fn phrase_notation(phrase: &Phrase) -> String {
    let head = match &phrase.head {
        Head::Named(name) => joined(&numbers_in_digits(name.as_str())),
        Head::Place => "place".to_owned(),
        Head::It => "it".to_owned(),
        Head::Here => "here".to_owned(),
        Head::There => "there".to_owned(),
        Head::Agent => "agent".to_owned(),
        Head::Speaker => "speaker".to_owned(),
        Head::Path => "path".to_owned(),
        Head::Previous => "prev_place".to_owned(),
        Head::Start => "start".to_owned(),
        Head::Unknown => "x".to_owned(),
        Head::Any => "*".to_owned(),
        Head::Visited => "visited".to_owned(),
    };
    let mut text = format!("{head}{}", braced(&features(&phrase.features)));
    for r in &phrase.within {
        text.extend(["[", &relation_notation(r), "]"]);
    }
    text
}

fn features(f: &Features) -> Vec<String> {
    let mut all = Vec::new();
    all.extend(f.name.as_ref().map(|n| format!("name={}", joined(n))));
    all.extend(f.owner.as_ref().map(|o| match o {
        Owner::Named(name) => format!("poss={}", joined(name)),
        Owner::Speaker => "poss=speaker".to_owned(),
    }));
    all.extend(f.qualities.iter().map(|q| joined(q)));
    all.extend(f.ordinal.map(|o| match o {
        Ordinal::Nth(n) => format!("ord={n}"),
        Ordinal::Last => "ord=last".to_owned(),
        Ordinal::Next => "ord=next".to_owned(),
    }));
    all.extend(f.count.map(|n| format!("count={n}")));
    for (is, word) in [(f.nearest, "nearest"), (f.plural, "plural"), (f.this, "this"), (f.other, "other")] {
        all.extend(is.then(|| word.to_owned()));
    }
    all.extend(f.level.map(|n| format!("rel={n}")));
    all.extend(f.purpose.as_ref().map(|p| format!("for={}", joined(p))));
    all
}

fn modifiers_notation(m: &Modifiers) -> String {
    let mut all = Vec::new();
    all.extend(m.just.then(|| "just".to_owned()));
    all.extend(m.distance.map(|d| {
        let unit = match d.unit {
            Unit::Metre => "m",
            Unit::Foot => "ft",
            Unit::Yard => "yd",
            Unit::Step => "steps",
        };
        format!("dist={}{unit}", d.value)
    }));
    all.extend(m.count.map(|n| format!("count={n}")));
    braced(&all)
}

fn braced(all: &[String]) -> String {
    if all.is_empty() { String::new() } else { format!("{{{}}}", all.join(",")) }
}

fn joined(text: &str) -> String {
    text.replace(' ', "_")
}

fn frame_notation(frame: Option<Frame>) -> &'static str {
    match frame {
        None => "",
        Some(Frame::Hearer) => "@ego_hearer",
        Some(Frame::Speaker) => "@ego_speaker",
        Some(Frame::Path) => "@ego_path",
        Some(Frame::Intrinsic) => "@intrinsic",
        Some(Frame::Absolute) => "@absolute",
    }
}

fn question_notation(kind: Question) -> &'static str {
    match kind {
        Question::Where => "where",
        Question::What => "what",
        Question::Why => "why",
        Question::Route => "route",
        Question::HowFar => "how_far",
        Question::Whether => "whether",
    }
}

fn quantity_notation(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::All => "all",
        Quantity::Usually => "usually",
        Quantity::Sometimes => "sometimes",
        Quantity::Never => "never",
    }
}

fn reason_notation(reason: Reason) -> &'static str {
    match reason {
        Reason::Command => "command_out_of_scope",
        Reason::Idiom => "idiom",
        Reason::Chatter => "chatter",
    }
}
