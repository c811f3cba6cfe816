//! What people call the spaces of a drawing, which bear abbreviations and are often Swedish.

/// What a space is for a tour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Use {
    /// Worth a visit.
    Room,
    /// Leads from room to room.
    Corridor,
    /// Nothing for a wheeled robot: stairs, lifts, shafts.
    Shaft,
}

/// Parts of categories in capitals, and what is meant; the first that fits counts.
const NAMES: [(&str, &str, Use); 61] = [
    ("LAB", "laboratory", Use::Room),
    ("KORRID", "hallway", Use::Corridor),
    ("KORRIO", "hallway", Use::Corridor),
    ("CORRIDOR", "hallway", Use::Corridor),
    ("PASSAGE", "hallway", Use::Corridor),
    ("KULVERT", "hallway", Use::Corridor),
    ("HISSHALL", "elevator lobby", Use::Room),
    ("HISS", "elevator", Use::Shaft),
    ("ELEVATOR", "elevator", Use::Shaft),
    ("TRAPP", "staircase", Use::Shaft),
    ("STAIR", "staircase", Use::Shaft),
    ("OUTGR", "", Use::Shaft),
    ("KRYP", "", Use::Shaft),
    ("SCHAKT", "", Use::Shaft),
    ("TOALETT", "bathroom", Use::Room),
    ("WC", "bathroom", Use::Room),
    ("OMKL", "changing room", Use::Room),
    ("DUSCH", "shower room", Use::Room),
    ("SAMMANTR", "meeting room", Use::Room),
    ("KONFERENS", "meeting room", Use::Room),
    ("KONF.", "meeting room", Use::Room),
    ("STYRELSE", "meeting room", Use::Room),
    ("KONTOR", "office", Use::Room),
    ("CHEF", "office", Use::Room),
    ("GRUPPRUM", "group room", Use::Room),
    ("LÄROSAL", "classroom", Use::Room),
    ("LEKTIONSSAL", "classroom", Use::Room),
    ("ÖVNINGSSAL", "classroom", Use::Room),
    ("SEMINARIE", "seminar room", Use::Room),
    ("HÖRSAL", "lecture hall", Use::Room),
    ("FÖRELÄS", "lecture hall", Use::Room),
    ("RITSAL", "drawing room", Use::Room),
    ("DATASAL", "computer room", Use::Room),
    ("DATAUND", "computer room", Use::Room),
    ("TERMINALSAL", "computer room", Use::Room),
    ("DATA", "server room", Use::Room),
    ("SERVER", "server room", Use::Room),
    ("BIBL", "library", Use::Room),
    ("LÄSESAL", "reading room", Use::Room),
    ("LÄSRUM", "reading room", Use::Room),
    ("LÄSPL", "reading room", Use::Room),
    ("PENTRY", "kitchen", Use::Room),
    ("KÖK", "kitchen", Use::Room),
    ("LUNCH", "lunch room", Use::Room),
    ("PAUS", "lounge", Use::Room),
    ("UPPEHÅLL", "lounge", Use::Room),
    ("PERSONAL", "lounge", Use::Room),
    ("VILRUM", "rest room", Use::Room),
    ("KOPIER", "copy room", Use::Room),
    ("VERKST", "workshop", Use::Room),
    ("FÖRRÅD", "storage room", Use::Room),
    ("FRD", "storage room", Use::Room),
    ("LAGER", "storage room", Use::Room),
    ("STÄD", "cleaning room", Use::Room),
    ("ARKIV", "archive", Use::Room),
    ("POST", "mail room", Use::Room),
    ("ENTRE", "lobby", Use::Room),
    ("FOAJE", "lobby", Use::Room),
    ("FLÄKT", "machine room", Use::Room),
    ("KAPPRUM", "cloakroom", Use::Room),
    ("GYM", "gym", Use::Room),
];

/// The name of a space and what it is; `doors` decide about one without a category. An unknown
/// category is a name in small letters; abbreviations and numbers are no names: empty.
pub(crate) fn name_of(category: &str, doors: usize) -> (String, Use) {
    /// With more doors than this a space without a category leads from room to room.
    const ROOM_DOORS: usize = 4;
    let capitals = category.to_uppercase();
    if let Some((_, name, purpose)) = NAMES.iter().find(|(part, ..)| capitals.contains(part)) {
        return ((*name).to_owned(), *purpose);
    }
    if capitals.is_empty() && doors > ROOM_DOORS {
        return ("hallway".into(), Use::Corridor);
    }
    let is_name = capitals.chars().count() > 3 && capitals.chars().all(|c| c.is_alphabetic() || c == ' ');
    (if is_name { capitals.to_lowercase() } else { String::new() }, Use::Room)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn categories_become_names() {
        for (category, doors, name, purpose) in [
            ("KONTOR 2P", 1, "office", Use::Room),
            ("Toalett", 1, "bathroom", Use::Room),
            ("KORRIDOR B", 9, "hallway", Use::Corridor),
            ("TRAPPHUS", 2, "staircase", Use::Shaft),
            ("HISSHALL", 2, "elevator lobby", Use::Room),
            ("GYM", 1, "gym", Use::Room),
            ("Snickeri", 1, "snickeri", Use::Room),
            ("H5", 1, "", Use::Room),
            ("", 1, "", Use::Room),
            ("", 5, "hallway", Use::Corridor),
        ] {
            assert_eq!(
                name_of(category, doors),
                (name.to_owned(), purpose),
                "{category:?} with {doors} doors"
            );
        }
    }
}
