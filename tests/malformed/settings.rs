//! Rows of a server's settings and of its users.

use crate::feed::{Came, Fed};
use crate::table::{Case, case};

/// The rows.
pub fn cases() -> Vec<Case> {
    let mut all = settings();
    all.extend(mappers());
    all.extend(users());
    all
}

fn settings() -> Vec<Case> {
    let deep = format!("site = {}{}", "[".repeat(10_000), "]".repeat(10_000));
    let dotted = format!("{}a = 1", "a.".repeat(10_000));
    let long = format!("site = \"{}\"", "a".repeat(64));
    let rows = [
        ("an unknown key", "site = \"lab\"\nhold_back = 1", Came::NoToml, "line 2"),
        ("an unknown limit", "[limits]\nbeam = 1", Came::NoToml, "unknown field `beam`"),
        ("an unknown table", "[map]\nx = 1", Came::NoToml, "unknown field `map`"),
        ("a key twice", "site = \"a\"\nsite = \"b\"", Came::NoToml, "duplicate key"),
        ("a table twice", "[limits]\n[limits]", Came::NoToml, "duplicate key"),
        ("no value", "site =", Came::NoToml, "line 1"),
        ("no quotes", "site = lab", Came::NoToml, "line 1"),
        ("JSON", "{\"site\": \"lab\"}", Came::NoToml, "line 1"),
        ("a site that is a number", "site = 1", Came::NoToml, "expected a string"),
        ("a wait that is a string", "gap_wait_s = \"10\"", Came::NoToml, "expected f64"),
        ("a queue of less than nothing", "[limits]\nqueue_messages = -1", Came::NoToml, "queue_messages"),
        ("a queue and a half", "[limits]\nqueue_messages = 1.5", Came::NoToml, "queue_messages"),
        (
            "a queue of 2^64",
            "[limits]\nqueue_messages = 18446744073709551616",
            Came::NoToml,
            "queue_messages",
        ),
        ("one endpoint that is no list", "listen = \"tcp/127.0.0.1:7457\"", Came::NoToml, "listen"),
        ("a zero in it", "site = \"a\u{0}\"", Came::NoToml, "line 1"),
        ("10 000 deep", deep.as_str(), Came::NoToml, "recurse"),
        ("10 000 dots", dotted.as_str(), Came::NoToml, "recursion limit"),
        (
            "a certificate without its key",
            "[access.tls]\ncertificate = \"a\"",
            Came::NoToml,
            "missing field `key`",
        ),
        ("a site in capitals", "site = \"Lab\"", Came::Invalid, "site"),
        ("a site of nothing", "site = \"\"", Came::Invalid, "site"),
        ("a site with a star", "site = \"*\"", Came::Invalid, "site"),
        ("a site of 64 characters", long.as_str(), Came::Invalid, "site"),
        ("nowhere to listen", "listen = []", Came::Invalid, "listen"),
        ("Zenoh's TLS", "listen = [\"tls/0.0.0.0:1\"]", Came::Invalid, "listen"),
        ("QUIC without a certificate", "listen = [\"quic/0.0.0.0:1\"]", Came::Invalid, "listen"),
        ("a wait that is no number", "hold_back_s = nan", Came::Invalid, "hold_back_s"),
        ("a wait without end", "gap_wait_s = inf", Came::Invalid, "gap_wait_s"),
        ("a wait before now", "join_wait_s = -0.001", Came::Invalid, "join_wait_s"),
        ("a wait of more than a minute", "gap_wait_s = 60.1", Came::Invalid, "gap_wait_s"),
        ("a wait of 1e300", "hold_back_s = 1e300", Came::Invalid, "hold_back_s"),
        ("graphs all the time", "graph_period_s = 0.0", Came::Invalid, "graph_period_s"),
        ("no window", "gap_window = 0", Came::Invalid, "gap_window"),
        ("no queue", "[limits]\nqueue_messages = 0", Came::Invalid, "limits.queue_messages"),
        ("no bytes in it", "[limits]\nqueue_bytes = 0", Came::Invalid, "limits.queue_bytes"),
        ("no robots", "[limits]\nrobots = 0", Came::Invalid, "limits.robots"),
        ("no maps", "[limits]\nmaps = 0", Came::Invalid, "limits.maps"),
        (
            "a queue of 2^63 - 1",
            "[limits]\nqueue_messages = 9223372036854775807",
            Came::Invalid,
            "limits.queue_messages",
        ),
        ("no payload", "[limits]\npayload_bytes = 0", Came::Invalid, "limits.payload_bytes"),
        ("no lasers", "[limits]\nlasers = 0", Came::Invalid, "limits.lasers"),
        ("metrics of no address", "http = \"everywhere\"", Came::Invalid, "http"),
        // Of so many a semaphore is made when the server starts, which panics.
        (
            "2^63 - 1 short queries",
            "[limits]\nshort_queries = 9223372036854775807",
            Came::Invalid,
            "limits.short_queries",
        ),
        (
            "2^63 - 1 long queries",
            "[limits]\nlong_queries = 9223372036854775807",
            Came::Invalid,
            "limits.long_queries",
        ),
        ("2^63 - 1 commands", "[limits]\ncommands = 9223372036854775807", Came::Invalid, "limits.commands"),
        // Journals and records read no message of more than 64 MiB, and no bincode of more than 16 MiB.
        ("a payload of 10^9", "[limits]\npayload_bytes = 1000000000", Came::Invalid, "limits.payload_bytes"),
        ("nothing", "", Came::Taken, ""),
        ("a comment", "# nothing", Came::Taken, ""),
        (
            "line breaks of another system",
            "site = \"lab\"\r\ngap_window = 2\r\n",
            Came::Taken,
            "gap_window: 2",
        ),
        ("a mark of byte order", "\u{feff}site = \"lab\"", Came::Taken, "lab"),
    ];
    let case = |(name, text, came, told): (&str, &str, Came, &str)| {
        case(format!("settings: {name}"), Fed::Settings(text.into()), came, told)
    };
    let mut all: Vec<Case> = rows.into_iter().map(case).collect();
    let bytes = b"site = \"\xff\"".to_vec();
    all.push(crate::table::case("settings: no UTF-8", Fed::Settings(bytes), Came::NoFile, "UTF-8"));
    all
}

/// Of the filter of new maps.
fn mappers() -> Vec<Case> {
    let rows = [
        ("no particles", "particles = 0", Came::Invalid, "mapper.particles"),
        ("particles of less than nothing", "particles = -1", Came::NoToml, "particles"),
        ("2^32 - 1 particles", "particles = 4294967295", Came::Invalid, "mapper.particles"),
        ("places NaN apart", "place_spacing_m = nan", Came::Invalid, "mapper.place_spacing_m"),
        ("places 0 apart", "place_spacing_m = 0.0", Came::Invalid, "mapper.place_spacing_m"),
        ("places -1 apart", "place_spacing_m = -1.0", Came::Invalid, "mapper.place_spacing_m"),
        ("gamma is NaN", "gamma_per_m2 = nan", Came::Invalid, "mapper.gamma_per_m2"),
        ("gamma is -1", "gamma_per_m2 = -1.0", Came::Invalid, "mapper.gamma_per_m2"),
        ("2^32 particles", "particles = 4294967296", Came::NoToml, "particles"),
        ("a seed of less than nothing", "seed = -1", Came::NoToml, "seed"),
        ("rules of no kind", "rules = \"robot\"", Came::NoToml, "unknown variant"),
        ("rules in capitals", "rules = \"Paper\"", Came::NoToml, "unknown variant"),
        ("language that is 1", "language = 1", Came::NoToml, "language"),
        ("an unknown key", "colour = 1", Came::NoToml, "unknown field `colour`"),
    ];
    let case = |(name, text, came, told): (&str, &str, Came, &str)| {
        case(format!("mapper: {name}"), Fed::Settings(format!("[mapper]\n{text}").into()), came, told)
    };
    rows.into_iter().map(case).collect()
}

fn users() -> Vec<Case> {
    let guide = |more: &str| format!("[users.anna]\nrole = \"guide\"\n{more}");
    let named = |name: &str| format!("[users.\"{name}\"]\nrole = \"guide\"");
    let rows = [
        ("nobody", String::new(), Came::Taken, "local: false"),
        ("a name in capitals", named("Anna"), Came::Invalid, "user"),
        ("a name with a colon", named("anna:word"), Came::Invalid, "user"),
        ("a name with a line break", named("anna\\n"), Came::Invalid, "user"),
        ("a name of nothing", named(""), Came::Invalid, "user"),
        ("a name with a star", named("*"), Came::Invalid, "user"),
        ("a name of 64 characters", named(&"a".repeat(64)), Came::Invalid, "user"),
        ("a name twice", guide("[users.anna]\nrole = \"viewer\""), Came::NoToml, "duplicate key"),
        ("a role of no kind", "[users.anna]\nrole = \"boss\"".into(), Came::NoToml, "line 2"),
        ("a role in capitals", "[users.anna]\nrole = \"Guide\"".into(), Came::NoToml, "unknown variant"),
        ("no role", "[users.anna]\npassword = \"x\"".into(), Came::NoToml, "missing field `role`"),
        ("more than is known", guide("admin = true"), Came::NoToml, "unknown field `admin`"),
        ("another table", "[user.anna]\nrole = \"guide\"".into(), Came::NoToml, "unknown field `user`"),
        ("that this machine may", "local = true".into(), Came::NoToml, "unknown field `local`"),
        ("users that are a list", "users = [\"anna\"]".into(), Came::NoToml, "line 1"),
        ("a robot that is a star", guide("robots = [\"*\"]"), Came::Invalid, "robots"),
        ("a robot that is all", guide("robots = [\"**\"]"), Came::Invalid, "robots"),
        ("a robot with a slash", guide("robots = [\"a/b\"]"), Came::Invalid, "robots"),
        ("a robot of nothing", guide("robots = [\"\"]"), Came::Invalid, "robots"),
        ("a robot that is any", guide("robots = [\"any\"]"), Came::Invalid, "robots"),
        ("a password of nothing", guide("password = \"\""), Came::Invalid, "password"),
        ("a password of spaces", guide("password = \"  \""), Came::Invalid, "password"),
        ("a password with a space behind it", guide("password = \"x \""), Came::Invalid, "password"),
        ("a password of two lines", guide("password = \"x\\neve:y\""), Came::Invalid, "password"),
        ("a password with a return", guide("password = \"x\\ry\""), Came::Invalid, "password"),
        ("a password that is a number", guide("password = 1"), Came::NoToml, "expected a string"),
        (
            "one without a password among others",
            guide("password = \"x\"\n[users.eve]\nrole = \"viewer\""),
            Came::Invalid,
            "password",
        ),
    ];
    let case = |(name, text, came, told): (&str, String, Came, &str)| {
        case(format!("users: {name}"), Fed::Users(text.into()), came, told)
    };
    let mut all: Vec<Case> = rows.into_iter().map(case).collect();
    let bytes = b"[users.\"\xff\"]".to_vec();
    all.push(crate::table::case("users: no UTF-8", Fed::Users(bytes), Came::NoFile, "UTF-8"));
    all
}
