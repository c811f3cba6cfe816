//! The seam for other languages: German is a folder.

use crate::language::glossary::Glossary;
use crate::language::speech::Speech;
use std::sync::Arc;

/// Sentences, and what they say.
const SAID: &[(&str, &str)] = &[
    ("Das ist die Küche.", "label(here,kitchen)"),
    ("Hier ist das Labor", "label(here,lab)"),
    ("Das hier ist die Bibliothek", "label(here,library)"),
    ("Wir sind jetzt in der Werkstatt", "label(here,workshop)"),
    ("Wir stehen im Aufenthaltsraum", "label(here,lounge)"),
    ("Das ist Annas Büro", "label(here,annas_office)"),
    ("Dieser Raum ist das Archiv", "label(here,archive)"),
    ("Das ist das Chemielabor", "label(here,chemie_lab)"),
    ("Hier haben wir den Serverraum", "label(here,server_room)"),
    ("Das war die Kantine", "label(prev_place,canteen)"),
    ("Das ist der Hörsaal drei", "label(here,lecture_hall_3)"),
    ("Die Küche ist den Flur runter", "loc(kitchen,down,hallway)"),
    ("Das Büro ist den Gang entlang", "loc(office,along,hallway)"),
    ("Die Küche ist neben dem Büro", "loc(kitchen,next_to,office)"),
    ("Das Labor liegt gegenüber der Bibliothek", "loc(lab,across_from,library)"),
    ("Die Toilette ist hinter der Treppe", "loc(bathroom,behind,stairs)"),
    ("Der Aufzug ist vor dem Empfang", "loc(elevator,in_front_of,reception)"),
    ("Das Archiv ist zwischen der Küche und dem Labor", "loc(archive,between,kitchen,lab)"),
    ("Der Besprechungsraum ist am Ende des Flurs", "loc(meeting_room,at_end_of,hallway)"),
    ("Am Ende des Gangs ist die Bibliothek", "loc(library,at_end_of,hallway)"),
    ("Links neben der Küche ist das Büro", "loc(office,left_of,kitchen)"),
    ("Die Garderobe ist rechts vom Eingang", "loc(cloakroom,right_of,entrance)"),
    ("Das Wartezimmer ist in der Nähe vom Empfang", "loc(waiting_room,near,reception)"),
    ("Die Werkstatt ist unter der Kantine", "loc(workshop,below,canteen)"),
    ("Das Lehrerzimmer ist direkt neben der Aula", "loc(staff_room,next_to{just},assembly_hall)"),
    ("Nebenan ist das Lager", "loc(storage,next_to,here)"),
    ("Die Küche ist um die Ecke", "loc(kitchen,around,corner)"),
    ("Der Kopierraum ist da drüben", "loc(copy_room,at,there)"),
    ("Die Toilette ist die Treppe runter", "loc(bathroom,level_down,here)"),
    ("Hinter uns liegt die Garderobe", "loc(cloakroom,behind,here)"),
    ("Das Labor ist im dritten Stock", "loc(lab,on_level,floor{ord=3})"),
    ("Die Turnhalle ist an der Küche vorbei", "loc(gym,past,kitchen)"),
    ("Das Klo ist gleich um die Ecke", "loc(bathroom,around,corner)"),
    ("Der Hörsaal ist am anderen Ende", "loc(lecture_hall,at_end_of,path)@ego_path"),
    ("Der Aufzug ist geradeaus", "loc(elevator,ahead_of,agent)@ego_hearer"),
    ("Wo ist die Küche?", "ask(where,kitchen)"),
    ("Wo ist das Büro?", "ask(where,office)"),
    ("Wo finde ich die Toilette?", "ask(where,bathroom)"),
    ("Wie komme ich zur Bibliothek?", "ask(route,library)"),
    ("Wie weit ist es bis zum Aufzug?", "ask(how_far,elevator)"),
    ("Gibt es hier eine Cafeteria?", "ask(where,cafeteria)"),
    ("Ist das die Küche?", "ask(whether,label(here,kitchen))"),
    ("Wo bin ich?", "ask(where,here)"),
    ("Weißt du, wo das Labor ist?", "ask(where,lab)"),
    ("Küche", "label(here,kitchen)"),
    ("Das ist nicht die Küche", "neg(label(here,kitchen))"),
    ("Nein, das ist das Büro", "cor(any,label(here,office))"),
    ("Das ist nicht die Küche, sondern das Labor", "cor(label(here,kitchen),label(here,lab))"),
    ("Das ist wieder die Küche", "label(here,kitchen)&same(here,kitchen)"),
    ("Die Mensa wird auch Bertha genannt", "alias(canteen,bertha)"),
    ("Ich habe Hunger", ""),
    ("Guten Morgen zusammen", ""),
    ("Gestern war ich im Kino", ""),
    ("Pass auf die Stufe auf", ""),
    ("Komm bitte mit", ""),
    ("Das Wetter ist schön", ""),
    ("Ich wünschte, wir hätten eine Küche", ""),
    ("Meine Schwester arbeitet bei Bosch", ""),
    ("Danke schön", ""),
    ("Um fünf treffen wir uns im Hof", ""),
];

#[test]
fn german_is_a_folder() {
    Glossary::read(include_str!("../../../lexicon/german/glossary.txt")).unwrap();
    let german = Speech::new(Some("de-AT"), Arc::default()).unwrap();
    let mut wrong = Vec::new();
    for (text, says) in SAID {
        let parse = german.parse(text);
        let told = if parse.acts().iter().any(|a| a.content.asserts()) || !says.is_empty() {
            parse.notation()
        } else {
            ""
        };
        if told != *says {
            wrong.push(format!("{text}: {told:?} instead of {says:?}, read as {:?}", german.english(text)));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), SAID.len(), wrong.join("\n"));
}

#[test]
fn a_language_that_nobody_here_knows_is_not_guessed_at() {
    assert!(Speech::new(Some("fr"), Arc::default()).is_none());
    for tag in [None, Some("en"), Some("en-GB"), Some("DE"), Some("und")] {
        assert!(Speech::knows(tag), "{tag:?}");
    }
    assert_eq!(Speech::known(), "English or German");
}
