//! `toponym say`.

use super::dictate::dictate;
use super::{Failure, exit};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Duration;
use toponym::guide::sentence;
use toponym::said::Said;
use toponym::{ClientError, Connection, Guide, Planner};
use toponym_proto::Say;
use toponym_proto::answer::{GraphReply, Heard, HeardStatus};

/// Arguments of `say`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym say 'this is the gym'
  toponym say 'the library is down the hall' --robot r07 --speaker anna
  toponym say 'the lab is past the stairs' --explain
  toponym say 'where is the gym?'
  toponym say 'scratch that'
  toponym say 'das ist die Küche' --lang de
  toponym say 'this is the gym' --spool ~/said     nothing is lost if the server is away
  recogniser | toponym say - --speak espeak-ng     a sentence a line: text, or JSON with alternatives

It speaks of the place where the robot is now. Exit code 1 if it was not understood, or if the robot asks something
back: say yes or no, at once or with --answers and the sentence's id.")]
pub struct SayArgs {
    /// The sentence; `-`: one a line from the standard input, as text or as JSON, {"text": …, "alternatives": [{"text": …,
    /// "p": …}], "ago_s": …}; lines with "partial" are left out.
    text: String,
    /// To which robot; may be left out where there is exactly one.
    #[arg(long)]
    robot: Option<String>,
    /// Who says it.
    #[arg(long)]
    speaker: Option<String>,
    /// In which language (en, de).
    #[arg(long, value_name = "TAG")]
    lang: Option<String>,
    /// Id of the sentence that the robot asked something of: this is the answer.
    #[arg(long, value_name = "ID")]
    answers: Option<String>,
    /// Tell how the sentence was read and where it was put.
    #[arg(long)]
    explain: bool,
    /// The map for --explain.
    #[arg(long, default_value = "main")]
    map: String,
    /// Folder to keep the sentence in until it is in the map; what an earlier `say` left there is said again first.
    #[arg(long, value_name = "DIR")]
    spool: Option<PathBuf>,
    /// A command that is given each answer as its last argument, to say it aloud; with `-`.
    #[arg(long, value_name = "COMMAND")]
    speak: Option<String>,
    /// How long to wait for the robot's answer.
    #[arg(long, value_name = "S", default_value = "10", value_parser = super::seconds)]
    timeout: Duration,
}

pub async fn say(to: &Connection, site: &str, args: &SayArgs) -> Result<u8, Failure> {
    let say = Say {
        robot: args.robot.clone(),
        speaker: args.speaker.clone(),
        lang: args.lang.clone(),
        answers: args.answers.clone(),
        ..sentence(&args.text)
    };
    if args.text == "-" {
        return dictate(to, site, &say, args.spool.as_deref(), args.speak.as_deref(), args.timeout).await;
    }
    let opened = to.open().await;
    if opened.is_err()
        && let Some(folder) = &args.spool
    {
        let (mut said, _) = Said::open(folder).map_err(ClientError::Spool)?;
        said.keep(&say).map_err(ClientError::Spool)?;
        eprintln!("kept in {}: the next `say --spool` says it", folder.display());
    }
    let session = opened?;
    let guide = Guide::connect(&session, site, args.robot.as_deref()).await?;
    if let Some(folder) = &args.spool {
        let left = guide.keep_in(folder).await?;
        if left > 0 {
            eprintln!("{left} of earlier sentences are said again");
        }
    }
    let heard = guide.send(&say, args.timeout).await?;
    println!("{}", heard.words);
    if let (waiting @ 1.., Some(folder)) = (guide.unheard(), &args.spool) {
        eprintln!("{waiting} earlier sentences stay in {}: nothing is heard of them yet", folder.display());
    }
    if heard.status == HeardStatus::Asked {
        println!("Answer with: toponym say yes --answers {}   (or no)", heard.id);
    }
    if args.explain {
        let planner = Planner::new(&session, site, &args.map, args.timeout)?;
        print!("{}", explained(&heard, &planner.graph().await?));
    }
    Ok(match heard.status {
        HeardStatus::Understood => exit::FOUND,
        HeardStatus::Asked | HeardStatus::NotUnderstood => exit::NOT_KNOWN,
        // Not yet: `send` waits for more.
        HeardStatus::Read => exit::TIMEOUT,
        HeardStatus::Refused => exit::REFUSED,
    })
}

/// Less is not shown.
const SHOWN_MIN: f64 = 0.005;

/// How a sentence was read and where it was put, with its id to take it back by.
fn explained(heard: &Heard, graph: &GraphReply) -> String {
    let mut text = format!("sentence  {}\nread as   {}\n", heard.id, heard.parse);
    for grounded in heard.grounded.iter().filter(|g| g.p >= SHOWN_MIN) {
        let place = graph.places.iter().find(|p| p.id == grounded.place);
        let at = place.map_or(String::new(), |p| format!(" (x {:.2} m, y {:.2} m)", p.x_m, p.y_m));
        let _ = writeln!(text, "put at    place {}{at}: {:.2}", grounded.place, grounded.p);
    }
    let elsewhere = 1.0 - heard.grounded.iter().map(|g| g.p).sum::<f64>();
    if !heard.grounded.is_empty() && elsewhere >= SHOWN_MIN {
        let _ = writeln!(text, "          elsewhere or not seen yet: {elsewhere:.2}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_proto::answer::{Grounded, Place};

    #[test]
    fn a_sentence_is_explained() {
        let heard = Heard {
            id: "01J".into(),
            status: HeardStatus::Understood,
            durable: true,
            parse: "loc(lab,past,stairs)".into(),
            grounded: vec![Grounded { place: 7, p: 0.6 }],
            words: String::new(),
            question: None,
            error: None,
        };
        let place = Place { id: 7, x_m: 1.0, y_m: -2.0, ..Place::default() };
        let graph = GraphReply { places: vec![place], ..GraphReply::default() };
        assert_eq!(
            explained(&heard, &graph),
            "sentence  01J\nread as   loc(lab,past,stairs)\nput at    place 7 (x 1.00 m, y -2.00 m): 0.60\n\
             \x20         elsewhere or not seen yet: 0.40\n"
        );
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_sentence_that_nobody_hears_is_kept() {
        let folder = std::env::temp_dir().join(format!("toponym-kept-{}", std::process::id()));
        let args = SayArgs {
            lang: None,
            text: "this is the gym".into(),
            robot: None,
            speaker: None,
            answers: None,
            explain: false,
            map: "main".into(),
            spool: Some(folder.clone()),
            speak: None,
            timeout: Duration::from_secs(1),
        };
        // Nothing listens on a port that was free a moment ago.
        let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let nobody = Connection::to(&format!("tcp/127.0.0.1:{port}"));
        assert!(say(&nobody, "default", &args).await.is_err());
        let (_, left) = Said::open(&folder).unwrap();
        assert_eq!(left[0].0.text, "this is the gym");
        std::fs::remove_dir_all(folder).unwrap();
    }
}
