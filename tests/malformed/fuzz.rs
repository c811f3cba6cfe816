//! Targets: messages, selectors, settings, users and sentences. Those of files are in `fuzz_files` and `fuzz_journal`.

use crate::feed::with_file;
use crate::mutate::{Mutator, fuzz, pick};
use crate::seeds::{LASER, ROBOT, keys, mends, messages};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::sync::Arc;
use toponym_core::language::{self, Glossary, Name, Parse, Speech};
use toponym_proto::codec::{ENCODING_BINCODE, ENCODING_JSON, place_of};
use toponym_proto::keys::Input;
use toponym_proto::{Limits, Message, selector};
use toponym_server::access::{Policy, Role, User, rules};
use toponym_server::config::ServerConfig;

/// What JSON messages are made of.
const JSON: &str = r#"{ } [ ] , : " \ \u0000 \ud800 null true false NaN Infinity -0 1e300 1e400 1e-400 -1 0.1 00
    70368744177664 70368744177665 9007199254740991 9223372036854775808 18446744073709551616 4294967296
    "robot": "boot": "seq": "stamp": "sec": "nanosec": "clock": "log" "sim" "x_m": "ranges_m": "lasers": "ignored_rad":
    "text": "id": "began": "alternatives": "p": "any" "R07" "" ü 厨 "#;

/// Where messages of a seed's kind come.
fn input_of(message: &Message) -> Input {
    match message {
        Message::Setup(_) => Input::Setup,
        Message::Odom(_) => Input::Odom,
        Message::Scan(_) => Input::Scan { laser: LASER.into() },
        Message::End(_) => Input::End,
        Message::Say(_) | Message::Mend(_) => Input::Say,
    }
}

/// What was taken is valid, and is written and read again as the same, in both forms.
pub fn is_sound(message: &Message, limits: &Limits) {
    message.validate(limits).unwrap();
    let bytes = message.to_bincode().unwrap();
    let again = Message::from_bincode(&bytes, limits).unwrap();
    // Bytes, for NaN is not itself.
    assert_eq!(again.to_bincode().unwrap(), bytes);
    if matches!(message, Message::Mend(_)) {
        return;
    }
    let json = message.to_json().unwrap();
    if json.len() <= limits.payload_bytes {
        let again = Message::decode(&input_of(message), ENCODING_JSON, &json, limits).unwrap();
        let [a, b] = [message, &again].map(|m| serde_json::to_value(m).unwrap());
        assert!(is_close(&a, &b), "{a} is read again as {b}");
    }
}

/// Whether all is the same but for the last place of doubles, which JSON readers may get wrong.
fn is_close(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) if a.is_f64() && b.is_f64() => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            (a - b).abs() <= 4.0 * f64::EPSILON * a.abs() || (a - b).abs() < f64::MIN_POSITIVE
        }
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_close(a, b))
        }
        (Value::Object(a), Value::Object(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|((k, a), (l, b))| k == l && is_close(a, b))
        }
        _ => a == b,
    }
}

#[test]
fn fuzz_bincode_messages() {
    let seeds = messages().iter().chain(&mends()).map(|m| m.to_bincode().unwrap()).collect();
    let limits = Limits::default();
    let mutator = Mutator { seeds, tokens: vec![ROBOT.into(), b"any".to_vec()] };
    fuzz(
        "bincode",
        1,
        |random| mutator.input(random),
        |bytes, _| {
            let place = place_of(ENCODING_BINCODE, bytes);
            let Ok(message) = Message::from_bincode(bytes, &limits) else { return false };
            // One form has one way to be written.
            assert_eq!(message.to_bincode().unwrap(), bytes);
            assert!(message.header().is_none_or(|h| place == Some((h.boot, h.seq))));
            is_sound(&message, &limits);
            let read = Message::decode(&input_of(&message), ENCODING_BINCODE, bytes, &limits);
            assert_eq!(read.is_ok(), !matches!(message, Message::Mend(_)));
            true
        },
    );
}

#[test]
fn fuzz_json_messages() {
    let seeds: Vec<Vec<u8>> = messages().iter().map(|m| m.to_json().unwrap()).collect();
    let inputs: Vec<Input> = messages().iter().map(input_of).collect();
    let limits = Limits::default();
    let mutator = Mutator { seeds, ..Mutator::of_texts(&[], JSON) };
    fuzz(
        "json",
        1,
        |random| mutator.input(random),
        |bytes, _| {
            let mut taken = false;
            for encoding in ["", ENCODING_JSON] {
                let place = place_of(encoding, bytes);
                for input in &inputs {
                    let Ok(message) = Message::decode(input, encoding, bytes, &limits) else { continue };
                    let is_object = bytes.iter().find(|b| !b.is_ascii_whitespace()) == Some(&b'{');
                    // A list in the place of an object is taken, too; where its seq stands is not looked for.
                    assert!(!is_object || message.header().is_none_or(|h| place == Some((h.boot, h.seq))));
                    is_sound(&message, &limits);
                    taken = true;
                }
            }
            taken
        },
    );
}

#[test]
fn fuzz_keys() {
    let seeds: Vec<String> = vec![
        keys().setup(ROBOT),
        keys().scan(ROBOT, LASER),
        keys().say(None),
        keys().inputs(ROBOT),
        keys().ask("main", toponym_proto::keys::Ask::Where),
    ];
    let seeds: Vec<&str> = seeds.iter().map(String::as_str).collect();
    let mutator = Mutator::of_texts(&seeds, "/ // * ** $* in/ scan/ say any robot ä 0 @adv/ toponym/v1/lab/");
    fuzz(
        "keys",
        1,
        |random| mutator.input(random),
        |bytes, _| {
            let key = String::from_utf8_lossy(bytes);
            let Ok((robot, input)) = keys().input(&key) else { return false };
            let again = match input {
                Input::Setup => keys().setup(&robot),
                Input::Odom => keys().odom(&robot),
                Input::Scan { laser } => keys().scan(&robot, &laser),
                Input::End => keys().end(&robot),
                Input::Say => keys().say(Some(&robot)),
            };
            assert_eq!(again, key);
            true
        },
    );
}

#[test]
fn fuzz_selectors() {
    let seeds = [
        "name=lecture%20hall;robot=r07",
        "text=where%20is%20the%20gym",
        "resolution_m=0.1\0{\"map\": \"main\", \"id\": 7, \"all\": true}",
        "\0{\"name\": \"caf\\u00e9\"}",
    ];
    let mutator = Mutator::of_texts(
        &seeds,
        "% %2 %20 %C3 %A9 %00 %zz ; = == name= ;name=b \0 { } \"name\": null 厨 + &",
    );
    fuzz(
        "selectors",
        1,
        |random| mutator.input(random),
        |bytes, _| {
            let mut parts = bytes.splitn(2, |b| *b == 0);
            let text = String::from_utf8_lossy(parts.next().unwrap_or_default()).into_owned();
            let Ok(arguments) = selector::decode(&text, parts.next().unwrap_or_default()) else {
                return false;
            };
            let written = selector::encode(arguments.iter().map(|(k, v)| (k.as_str(), v.as_str())));
            assert!(written.is_ascii());
            // Written with all its escapes it may be too long.
            let again = selector::decode(&written, b"");
            assert!(again.is_ok_and(|again| again == arguments) || written.len() > 8192);
            true
        },
    );
}

#[test]
fn fuzz_settings() {
    let whole = toml::to_string(&ServerConfig::default()).unwrap();
    let some = "site = \"lab\" # comment\nlisten = [\"quic/0.0.0.0:7457\",\n  'tcp/[::1]:1']\nhttp = \"127.0.0.1:7458\"\n\
        [access.tls]\ncertificate = \"a.pem\"\nkey = \"k.pem\"\n[mapper]\nrules = \"paper\"\n";
    let mutator = Mutator::of_texts(
        &[&whole, some],
        "[ ] [[ ]] = . , \" \"\"\" ' ''' # \n \r { } nan inf -inf -1 0 1e400 0x7fffffffffffffff 0b1 1_0 9223372036854775808 \
         true 1979-05-27 site limits. [limits] [mapper] [access.tls] a.b \\u0000 \\ ä",
    );
    fuzz(
        "settings",
        1,
        |random| mutator.input(random),
        |bytes, _| {
            let Ok(config) = toml::from_str::<ServerConfig>(&String::from_utf8_lossy(bytes)) else {
                return false;
            };
            if config.check().is_err() {
                return false;
            }
            let written = toml::to_string(&config).unwrap();
            let again: ServerConfig = toml::from_str(&written).unwrap();
            again.check().unwrap();
            // Written once more, for NaN is not itself.
            assert_eq!(toml::to_string(&again).unwrap(), written);
            true
        },
    );
}

#[test]
fn fuzz_users() {
    let user = |role, robots: &[&str], password: &str| {
        let robots = robots.iter().map(ToString::to_string).collect();
        User { role, robots, password: Some(password.into()) }
    };
    let users = [
        ("r07".to_owned(), user(Role::Robot, &[], "one")),
        ("anna".to_owned(), user(Role::Guide, &["r07", "r08"], "two : ü")),
        ("desk".to_owned(), user(Role::Operator, &[], "three")),
    ];
    let whole = toml::to_string(&Policy { local: false, users: users.into() }).unwrap();
    let by_certificate = "[users.anna]\nrole = \"guide\"\n[users.\"r_1\"]\nrole = 'robot'\n";
    let mutator = Mutator::of_texts(
        &[&whole, by_certificate],
        "[ ] = . \" ' # \n \\n \\r \\t \\u0085 [users.eve] role = \"viewer\" \"trusted\" robots = [] [\"*\"] password = \"\" * : ä",
    );
    fuzz(
        "users",
        1,
        |random| mutator.input(random),
        |bytes, _| {
            let Ok(policy) = with_file(bytes, |path| Policy::read(path)) else { return false };
            let written = toml::to_string(&policy).unwrap();
            assert_eq!(with_file(written.as_bytes(), |path| Policy::read(path)).unwrap(), policy);
            // A line for each password, and no line that a password wrote.
            let dictionary = policy.dictionary();
            let read: Vec<(&str, &str)> =
                dictionary.lines().filter_map(|line| line.split_once(':')).collect();
            let meant =
                policy.users.iter().filter_map(|(name, u)| Some((name.as_str(), u.password.as_deref()?)));
            assert_eq!(read, meant.collect::<Vec<_>>());
            rules(&keys(), &policy);
            true
        },
    );
}

/// What guides say, and words that turn it into something else.
const SAID: [&str; 12] = [
    "this is the gym",
    "We're in Anna's office, not the R&D lab.",
    "the kitchen is about twenty meters down the hall on your left",
    "No, sorry, this is lecture hall 123 on the second floor",
    "where is the nearest elevator?",
    "go down the hallway until you reach the elevators, then the gym is on the right",
    "we are back where we started",
    "the office between the lounge and the Café Müller is called the fishbowl",
    "is there a bathroom near here?",
    "and the gym too",
    "offices are usually next to a lounge",
    "this isn't the kitchen any more, we call it 厨房",
];
const WORDS: &str = "the a is are not no and , . ? ! ' 's n't this that here it we in on at between near next to of left right \
    kitchen gym office hallway elevators floor room called another other same back two 2nd 99 1000000 third last meters feet \
    twenty hundred and-a-half who where what how far through past until I think maybe my Nick's Dr. R&D 厨房 é \u{301} \u{200d} 🏋 \
    — … \u{0} \n \" ( ) [ ] ; : & % A1 3.14 ¾ ٣ ǆ İ";

/// A parse weighs at most one, and is kept and read again as the same.
fn parse_is_sound(parse: &Parse, hearings: usize) {
    let sum: f64 = parse.analyses.iter().map(|a| a.weight).sum();
    assert!(
        sum <= 1.0 + 1e-9 && parse.analyses.iter().all(|a| a.weight > 0.0 && a.hearing < hearings),
        "{parse:?}"
    );
    let kept = serde_json::to_value(parse).unwrap();
    let again: Parse = serde_json::from_value(kept.clone()).unwrap();
    assert_eq!(serde_json::to_value(&again).unwrap(), kept);
    for act in parse.analyses.iter().flat_map(|a| &a.acts) {
        assert!(act.certainty > 0.0 && act.certainty <= 1.0, "{act:?}");
        assert!(!language::written(&act.content).is_empty());
        for name in language::names_in(&act.content) {
            assert_eq!(Name::new(name.as_str()).as_ref(), Some(&name), "a name has one spelling");
        }
    }
    assert!(!language::words(parse.acts(), |_| false).is_empty());
}

#[test]
fn fuzz_sentences() {
    let said = language::parse("the library is down the hall");
    let mutator = Mutator::of_texts(&SAID, WORDS);
    fuzz(
        "sentences",
        10,
        |random| mutator.input(random),
        |bytes, random| {
            let mut text = String::from_utf8_lossy(bytes).into_owned();
            // Words by themselves: few that touch are any.
            for _ in 0..random.random_range(0..4) {
                let words: Vec<&str> = WORDS.split_whitespace().collect();
                let at = text
                    .char_indices()
                    .map(|(at, _)| at)
                    .filter(|at| text[*at..].starts_with(' '))
                    .collect::<Vec<_>>();
                if !at.is_empty() {
                    text.insert_str(*pick(&at, random), &format!(" {}", pick(&words, random)));
                }
            }
            let text: String = text.chars().take(Limits::default().text_chars).collect();
            hear(&text, &said, random)
        },
    );
}

/// All that the server asks of a sentence.
fn hear(text: &str, said_before: &Parse, random: &mut ChaCha8Rng) -> bool {
    let alternatives = [((*pick(&SAID, random)).to_owned(), 0.25)];
    let site = Glossary::read("the hall = canteen\nname: Room to Grow; Not Here\n-s = rooms").unwrap();
    let tag = *pick(&[None, Some("de")], random);
    let speech = Speech::new(tag, Arc::new(site)).unwrap();
    let parse = speech.parse_hearings(text, &alternatives);
    parse_is_sound(&parse, 2);
    let names: Vec<Name> = parse.acts().iter().flat_map(|act| language::names_in(&act.content)).collect();
    for name in &names {
        let _ = speech.spelling(text, name);
    }
    if let (Some(best), Some(name)) = (parse.best(), names.first()) {
        language::renamed(best, name, &Name::new("gym").unwrap());
    }
    let mut resolved = parse.clone();
    language::resolve_it(&mut resolved, language::topic(said_before));
    parse_is_sound(&resolved, 2);
    let guess = speech.guess(text).map(|guess| Parse { analyses: vec![guess] });
    let before = speech.as_before(text, said_before);
    for parse in guess.iter().chain(&before) {
        parse_is_sound(parse, 1);
    }
    let _ = (speech.parse_query(text), speech.reply(text));
    !parse.acts().is_empty()
}
