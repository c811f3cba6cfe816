//! `toponym say -`: sentences as a recogniser writes them, line by line.

use super::{Failure, exit};
use serde::Deserialize;
use std::io::BufRead as _;
use std::path::Path;
use std::process::Command;
use std::time::Duration;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::mpsc::{Receiver, channel};
use tokio::time::{Instant, sleep_until};
use toponym::guide::{is_final, sentence};
use toponym::{Connection, Guide};
use toponym_proto::Say;
use toponym_proto::answer::{Heard, HeardStatus};
use toponym_proto::stream::Hearing;

/// Lines that wait to be said; who writes more waits.
const LINES: usize = 64;

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
    let session = to.open().await?;
    let guide = Guide::connect(&session, site, said.robot.as_deref()).await?;
    if let Some(folder) = spool {
        let left = guide.keep_in(folder).await?;
        if left > 0 {
            eprintln!("{left} of earlier sentences are said again");
        }
    }
    let (mut lines, mut feedback, mut code) = (lines(), guide.feedback(), exit::FOUND);
    let (mut own, mut until) = (Vec::new(), None);
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
                    let say = Say {
                        robot: said.robot.clone(),
                        speaker: said.speaker.clone(),
                        lang: say.lang.clone().or_else(|| said.lang.clone()),
                        ..say
                    };
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
                        tell(&heard, speak);
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
            return Ok(code);
        }
    }
}

fn tell(heard: &Heard, speak: Option<&str>) {
    let why = heard.error.as_ref().map(|problem| problem.message.clone());
    let words = heard.question.clone().or(why).unwrap_or_else(|| heard.words.clone());
    println!("{words}");
    let mut command = speak.unwrap_or_default().split_whitespace();
    let Some(program) = command.next() else { return };
    let (arguments, program) = (command.map(str::to_owned).collect::<Vec<_>>(), program.to_owned());
    // Beside what is said meanwhile.
    std::thread::spawn(move || {
        if let Err(e) = Command::new(&program).args(arguments).arg(words).status() {
            eprintln!("{program}: {e}");
        }
    });
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
}
