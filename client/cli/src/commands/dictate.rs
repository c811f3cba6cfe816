//! `toponym say -`: sentences as a recogniser writes them, line by line.

use super::{Failure, exit};
use serde::Deserialize;
use std::io::BufRead as _;
use std::path::Path;
use std::process::Command;
use std::sync::mpsc::{self, Sender};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::mpsc::{Receiver, channel};
use tokio::time::{Instant, sleep, sleep_until};
use toponym::guide::{is_final, sentence};
use toponym::said::Said;
use toponym::{ClientError, Connection, Guide, Session};
use toponym_proto::Say;
use toponym_proto::answer::{Heard, HeardStatus};
use toponym_proto::stream::Hearing;

/// Lines that wait to be said; who writes more waits.
const LINES: usize = 64;
/// Between two attempts to reach the server.
const AGAIN: Duration = Duration::from_secs(2);

/// A line of a recogniser in JSON: ours, or Vosk's.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Line {
    text: Option<String>,
    alternatives: Vec<Guess>,
    /// What it seems to be so far: the next line replaces it.
    partial: Option<serde_json::Value>,
    /// How long ago it began, seconds.
    ago_s: Option<f64>,
    lang: Option<String>,
    id: Option<String>,
}

/// What it may have been.
#[derive(Debug, Deserialize)]
struct Guess {
    text: String,
    /// Its probability.
    #[serde(alias = "confidence", default)]
    p: f64,
}

/// What a line says; none if that is nothing, or not yet.
///
/// # Errors
/// If it is JSON that says nothing.
fn read(line: &str) -> Result<Option<Say>, String> {
    let line = line.trim();
    if line.is_empty() {
        return Ok(None);
    }
    if !line.starts_with('{') {
        return Ok(Some(sentence(line)));
    }
    let read: Line = serde_json::from_str(line).map_err(|e| format!("{line}: {e}"))?;
    if read.partial.as_ref().is_some_and(|partial| *partial != serde_json::Value::Bool(false)) {
        return Ok(None);
    }
    let mut guesses = read.alternatives.into_iter();
    let text = read.text.or_else(|| guesses.next().map(|best| best.text));
    let Some(text) = text.map(|text| text.trim().to_owned()) else {
        return Err(format!("{line}: has no text"));
    };
    // What a recogniser ends a silence with.
    if text.is_empty() {
        return Ok(None);
    }
    let others = guesses.filter(|guess| guess.text != text && (0.0..=1.0).contains(&guess.p));
    let alternatives = others.map(|Guess { text, p }| Hearing { text, p }).collect();
    let said = sentence(&text);
    let id = read.id.unwrap_or_else(|| said.id.clone());
    Ok(Some(Say { id, alternatives, lang: read.lang, ago_s: read.ago_s, ..said }))
}

/// The lines of the standard input, as they come.
fn lines() -> Receiver<String> {
    let (sender, receiver) = channel(LINES);
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().split(b'\n').map_while(Result::ok) {
            if sender.blocking_send(String::from_utf8_lossy(&line).into_owned()).is_err() {
                break;
            }
        }
    });
    receiver
}

/// Says what comes in, and tells what becomes of it; `speak`: a command that is given each answer.
pub async fn dictate(
    to: &Connection,
    site: &str,
    said: &Say,
    spool: Option<&Path>,
    speak: Option<&str>,
    timeout: Duration,
) -> Result<u8, Failure> {
    let (mut lines, mut own, mut speaker) = (lines(), Vec::new(), speak.map(Speaker::new));
    let Some(session) = connected(to, said, spool, &mut lines, &mut own).await? else {
        return Ok(exit::TIMEOUT);
    };
    let guide = Guide::connect(&session, site, said.robot.as_deref()).await?;
    let (mut feedback, mut code, mut until) = (guide.feedback(), exit::FOUND, None);
    if let Some(folder) = spool {
        let earlier = guide.keep_in(folder).await?.saturating_sub(own.len());
        if earlier > 0 {
            eprintln!("{earlier} of earlier sentences are said again");
        }
    }
    loop {
        let ends = async {
            match until {
                Some(until) => sleep_until(until).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            line = lines.recv(), if until.is_none() => match line.map(|line| read(&line)) {
                Some(Ok(Some(say))) => {
                    let say = by(said, say);
                    match guide.publish(&say).await {
                        Ok(()) => own.push(say.id),
                        Err(e) => {
                            eprintln!("{:?}: {e}", say.text);
                            code = exit::NOT_KNOWN;
                        }
                    }
                }
                Some(Ok(None)) => {}
                Some(Err(why)) => {
                    eprintln!("{why}");
                    code = exit::NOT_KNOWN;
                }
                None => until = Some(Instant::now() + timeout),
            },
            heard = feedback.recv() => match heard {
                Ok(heard) if own.contains(&heard.id) => {
                    if is_final(&heard) {
                        own.retain(|id| *id != heard.id);
                        let words = words(&heard);
                        println!("{words}");
                        if let Some(speaker) = &speaker {
                            speaker.say(words);
                        }
                        if !matches!(heard.status, HeardStatus::Understood) {
                            code = exit::NOT_KNOWN;
                        }
                    }
                }
                Ok(_) | Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return Ok(exit::TIMEOUT),
            },
            () = ends => {
                eprintln!("nothing is heard yet of {} sentences{}", own.len(), if spool.is_some() { ": they are kept" } else { "" });
                return Ok(exit::TIMEOUT);
            }
        }
        if until.is_some() && own.is_empty() {
            if let Some(speaker) = speaker.take() {
                speaker.end();
            }
            return Ok(code);
        }
    }
}

/// A session. What is said before there is one is kept, where there is a folder to keep it in, and `own` gets its ids;
/// none if it ends before.
async fn connected(
    to: &Connection,
    said: &Say,
    spool: Option<&Path>,
    lines: &mut Receiver<String>,
    own: &mut Vec<String>,
) -> Result<Option<Session>, Failure> {
    let Some(folder) = spool else { return Ok(Some(to.open().await?)) };
    let (mut kept, _) = Said::open(folder).map_err(ClientError::Spool)?;
    let connects = async {
        loop {
            match to.open().await {
                Ok(session) => return session,
                Err(e) => eprintln!("{e}; what is said meanwhile is kept in {}", folder.display()),
            }
            sleep(AGAIN).await;
        }
    };
    tokio::pin!(connects);
    loop {
        let line = tokio::select! {
            session = &mut connects => return Ok(Some(session)),
            line = lines.recv() => line,
        };
        let Some(line) = line else {
            eprintln!(
                "{} sentences are kept in {}: the next `say --spool` says them",
                own.len(),
                folder.display()
            );
            return Ok(None);
        };
        match read(&line) {
            Ok(Some(say)) => {
                let say = by(said, say);
                kept.keep(&say).map_err(ClientError::Spool)?;
                own.push(say.id);
            }
            Ok(None) => {}
            Err(why) => eprintln!("{why}"),
        }
    }
}

/// A sentence by who says all of them.
fn by(said: &Say, say: Say) -> Say {
    let lang = say.lang.or_else(|| said.lang.clone());
    Say { robot: said.robot.clone(), speaker: said.speaker.clone(), lang, ..say }
}

fn words(heard: &Heard) -> String {
    let why = heard.error.as_ref().map(|problem| problem.message.clone());
    heard.question.clone().or(why).unwrap_or_else(|| heard.words.clone())
}

/// Has a command say answers aloud, one after the other, beside what is said meanwhile.
struct Speaker {
    answers: Sender<String>,
    speaks: JoinHandle<()>,
}

impl Speaker {
    fn new(command: &str) -> Self {
        let (answers, said) = mpsc::channel::<String>();
        let words: Vec<String> = command.split_whitespace().map(str::to_owned).collect();
        let speaks = std::thread::spawn(move || {
            let Some((program, arguments)) = words.split_first() else { return };
            for answer in said {
                if let Err(e) = Command::new(program).args(arguments).arg(answer).status() {
                    eprintln!("{program}: {e}");
                }
            }
        });
        Self { answers, speaks }
    }

    fn say(&self, answer: String) {
        // Where it has ended there was no command.
        let _ = self.answers.send(answer);
    }

    /// Waits until all is said.
    fn end(self) {
        drop(self.answers);
        let _ = self.speaks.join();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_recogniser_can_be_read() {
        let text = |line: &str| read(line).map(|say| say.map(|say| say.text));
        assert_eq!(text("this is the gym\n"), Ok(Some("this is the gym".into())));
        assert_eq!(text(r#"{"text": "this is the gym"}"#), Ok(Some("this is the gym".into())));
        for nothing in
            ["", r#"{"partial": "this is"}"#, r#"{"partial": true, "text": "this"}"#, r#"{"text": " "}"#]
        {
            assert_eq!(text(nothing), Ok(None), "{nothing}");
        }
        assert!(text("{\"words\": 3}").is_err() && text("{").is_err());
        let vosk = r#"{"alternatives": [{"text": "the gym", "confidence": 0.7}, {"text": "the gin", "confidence": 0.2},
            {"text": "the him", "confidence": 212.5}]}"#;
        let said = read(vosk).unwrap().unwrap();
        assert_eq!((said.text.as_str(), said.alternatives.len()), ("the gym", 1), "that is no probability");
        let ours = r#"{"text": "die Küche", "lang": "de", "ago_s": 1.5, "id": "01J00000000000000000000000", "partial": false}"#;
        let said = read(ours).unwrap().unwrap();
        assert_eq!((said.lang.as_deref(), said.ago_s, said.id.len()), (Some("de"), Some(1.5), 26));
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn what_is_said_before_the_server_is_there_is_kept_in_order() {
        let folder = std::env::temp_dir().join(format!("toponym-dictated-{}", std::process::id()));
        let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let nobody = Connection::to(&format!("tcp/127.0.0.1:{port}"));
        let (sender, mut lines) = channel(LINES);
        for line in ["this is the gym", "", r#"{"partial": "this"}"#, "{", "this is the kitchen"] {
            sender.send(line.to_owned()).await.unwrap();
        }
        drop(sender);
        let said = Say { speaker: Some("anna".into()), ..Say::default() };
        let mut own = Vec::new();
        let session = connected(&nobody, &said, Some(&folder), &mut lines, &mut own).await.unwrap();
        assert!(session.is_none());
        let (_, left) = Said::open(&folder).unwrap();
        let texts: Vec<&str> = left.iter().map(|(say, _)| say.text.as_str()).collect();
        assert_eq!(texts, ["this is the gym", "this is the kitchen"]);
        assert_eq!(own, left.iter().map(|(say, _)| say.id.clone()).collect::<Vec<_>>());
        assert!(left.iter().all(|(say, _)| say.speaker.as_deref() == Some("anna")));
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn answers_are_said_one_after_the_other() {
        let folder = std::env::temp_dir().join(format!("toponym-spoken-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (script, told) = (folder.join("speak"), folder.join("told"));
        std::fs::write(&script, format!("for w in $1; do echo $w >> {}; done", told.display())).unwrap();
        let speaker = Speaker::new(&format!("sh {}", script.display()));
        speaker.say("a b c".into());
        speaker.say("d e f".into());
        speaker.end();
        assert_eq!(std::fs::read_to_string(told).unwrap(), "a\nb\nc\nd\ne\nf\n");
        std::fs::remove_dir_all(folder).unwrap();
    }
}
