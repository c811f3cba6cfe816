//! `toponym where`, `nearest`, `go`, `what`, `labels`, `rooms`.

use super::{Failure, exit};
use std::fmt::Write as _;
use std::io::Write as _;
use std::time::Duration;
use toponym::told::where_text;
use toponym::{Connection, Planner};
use toponym_proto::answer::{LabelsReply, WhatReply};
use toponym_proto::regions::{Region, RegionsReply};

/// Less likely names of rooms are not told in text.
const CALLED_MIN: f64 = 0.3;

/// Arguments of `where`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym where gym
  toponym where 'elevator lobby' --json
  toponym where Küche --lang de
  toponym where 'where is the kitchen?' --map floor2 --timeout 1

Bearings are from the robot's nose, left is positive. Exit code 1 if it is rather nowhere in the map.")]
pub struct WhereArgs {
    /// A name, or a whole question.
    name: String,
    /// In which language (en, de).
    #[arg(long, value_name = "TAG")]
    lang: Option<String>,
    #[command(flatten)]
    asked: AskedArgs,
}

/// What all questions take; all that `labels` and `rooms` do.
#[derive(Debug, clap::Args)]
pub struct AskedArgs {
    /// Which map.
    #[arg(long, default_value = "main")]
    map: String,
    /// Print the server's answer as it is.
    #[arg(long)]
    json: bool,
    /// How long to wait for it.
    #[arg(long, value_name = "S", default_value = "5", value_parser = super::seconds)]
    timeout: Duration,
}

pub async fn find(to: &Connection, site: &str, args: &WhereArgs) -> Result<u8, Failure> {
    let session = to.open().await?;
    let planner = Planner::new(&session, site, &args.asked.map, args.asked.timeout)?;
    let reply = planner.where_is_in(&args.name, args.lang.as_deref()).await?;
    print(&if args.asked.json { json(&reply)? } else { where_text(&reply) })?;
    Ok(if reply.is_found() { exit::FOUND } else { exit::NOT_KNOWN })
}

pub async fn nearest(to: &Connection, site: &str, args: &WhereArgs) -> Result<u8, Failure> {
    let session = to.open().await?;
    let planner = Planner::new(&session, site, &args.asked.map, args.asked.timeout)?;
    let reply = planner.nearest(&args.name, args.lang.as_deref()).await?;
    print(&if args.asked.json { json(&reply)? } else { where_text(&reply) })?;
    Ok(if reply.is_found() { exit::FOUND } else { exit::NOT_KNOWN })
}

/// Arguments of `go`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym go kitchen
  toponym go 'the bathroom next to the lounge' --map floor2

Whatever drives the robot hears of it: Nav2 as /goal_pose where the server is given --ros, other programs on
toponym/v1/SITE/robot/ROBOT/out/goal. Exit code 1 if it is rather nowhere, or can't be reached: then nothing is sent.")]
pub struct GoArgs {
    /// A name, or what it is next to.
    name: String,
    /// In which language (en, de).
    #[arg(long, value_name = "TAG")]
    lang: Option<String>,
    #[command(flatten)]
    asked: AskedArgs,
}

pub async fn go(to: &Connection, site: &str, args: &GoArgs) -> Result<u8, Failure> {
    let session = to.open().await?;
    let planner = Planner::new(&session, site, &args.asked.map, args.asked.timeout)?;
    let sent = planner.go(&args.name, args.lang.as_deref()).await?;
    print(&if args.asked.json { json(&sent)? } else { format!("{}\n", sent.words) })?;
    Ok(if sent.goal.is_some() { exit::FOUND } else { exit::NOT_KNOWN })
}

/// Arguments of `what`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym what
  toponym what --at 3.5,-2

Exit code 1 if nobody told a name of it.")]
pub struct WhatArgs {
    /// A point of the map, metres; without, where the robot is.
    #[arg(long, value_name = "X,Y", value_parser = point, allow_hyphen_values = true)]
    at: Option<[f64; 2]>,
    #[command(flatten)]
    asked: AskedArgs,
}

fn point(text: &str) -> Result<[f64; 2], String> {
    let both = text.split_once(',').and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    both.ok_or_else(|| "give two numbers, as 3.5,-2".to_owned())
}

pub async fn what(to: &Connection, site: &str, args: &WhatArgs) -> Result<u8, Failure> {
    let session = to.open().await?;
    let planner = Planner::new(&session, site, &args.asked.map, args.asked.timeout)?;
    let reply = planner.what(args.at).await?;
    print(&if args.asked.json { json(&reply)? } else { what_text(&reply) })?;
    Ok(if reply.names.is_empty() { exit::NOT_KNOWN } else { exit::FOUND })
}

pub async fn labels(to: &Connection, site: &str, asked: &AskedArgs) -> Result<u8, Failure> {
    let session = to.open().await?;
    let planner = Planner::new(&session, site, &asked.map, asked.timeout)?;
    let reply = planner.labels().await?;
    print(&if asked.json { json(&reply)? } else { labels_text(&reply) })?;
    Ok(if reply.labels.is_empty() { exit::NOT_KNOWN } else { exit::FOUND })
}

pub async fn rooms(to: &Connection, site: &str, asked: &AskedArgs) -> Result<u8, Failure> {
    let session = to.open().await?;
    let planner = Planner::new(&session, site, &asked.map, asked.timeout)?;
    let reply = planner.regions().await?;
    print(&if asked.json { json(&reply)? } else { rooms_text(&reply) })?;
    Ok(if reply.regions.is_empty() { exit::NOT_KNOWN } else { exit::FOUND })
}

fn json<T: serde::Serialize>(value: &T) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(value).map_err(std::io::Error::from)?;
    Ok(text + "\n")
}

/// Unlike `println!` this survives a reader that hangs up, such as `head`.
fn print(text: &str) -> Result<(), Failure> {
    Ok(std::io::stdout().write_all(text.as_bytes())?)
}

fn what_text(reply: &WhatReply) -> String {
    let names: Vec<String> = reply.names.iter().map(|n| format!("{} ({:.2})", n.shown, n.p)).collect();
    let names =
        if names.is_empty() { "nobody told what this is called".to_owned() } else { names.join(", ") };
    let space = reply.region.zip(reply.kind.as_ref()).map(|(id, kind)| format!(", a {kind} (region {id})"));
    format!("x {:.2} m, y {:.2} m{}: {names}\n", reply.x_m, reply.y_m, space.unwrap_or_default())
}

fn labels_text(reply: &LabelsReply) -> String {
    if reply.labels.is_empty() {
        return format!("map {} was told no names yet\n", reply.map.id);
    }
    let width = reply.labels.iter().map(|l| l.label.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for label in &reply.labels {
        let times = if label.utterances == 1 { "time" } else { "times" };
        let (name, n, region) = (&label.label, label.utterances, label.region);
        let _ = writeln!(text, "{name:width$}  said {n} {times}, most likely place {region}");
    }
    text
}

fn rooms_text(reply: &RegionsReply) -> String {
    if reply.regions.is_empty() {
        return format!("map {} has no rooms yet\n", reply.map.id);
    }
    let called = |r: &Region| {
        let likely = r.names.iter().filter(|n| n.p >= CALLED_MIN);
        let names: Vec<String> = likely.map(|n| format!("{} ({:.2})", n.label, n.p)).collect();
        if names.is_empty() { "no name".to_owned() } else { names.join(", ") }
    };
    let mut text = String::new();
    for r in &reply.regions {
        let to: Vec<String> = r.doorways.iter().map(|d| d.to.to_string()).collect();
        let to = if to.is_empty() { String::new() } else { format!(", leads to {}", to.join(", ")) };
        let _ = writeln!(text, "{:<5} {:<8} {:6.1} m²  {}{to}", r.id, r.kind, r.area_m2, called(r));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_proto::answer::{LabelEntry, MapIdentity};
    use toponym_proto::regions::{Doorway, RegionName};

    #[test]
    fn rooms_are_told_by_what_they_are_called_and_where_they_lead() {
        let name = |label: &str, p| RegionName { label: label.into(), p };
        let room = |id, names, to| Region {
            id,
            kind: "room".into(),
            names,
            area_m2: 20.04,
            polygon_m: vec![],
            holes_m: vec![],
            doorways: vec![Doorway { to, x_m: 0.0, y_m: 0.0, width_m: 0.9 }],
            places: vec![id],
        };
        let regions = vec![room(0, vec![name("gym", 0.9), name("lab", 0.1)], 7), room(7, vec![], 0)];
        let reply = RegionsReply {
            v: 1,
            query: "regions".into(),
            map: MapIdentity::default(),
            regions,
            areas: vec![],
        };
        let text = rooms_text(&reply);
        let rows = [
            "0     room       20.0 m²  gym (0.90), leads to 7",
            "7     room       20.0 m²  no name, leads to 0",
        ];
        assert_eq!(text.lines().collect::<Vec<_>>(), rows);
    }

    #[test]
    fn labels_are_a_table() {
        let label = |label: &str, utterances| LabelEntry {
            label: label.into(),
            shown: label.into(),
            utterances,
            region: 3,
        };
        let mut reply = LabelsReply {
            v: 1,
            query: "labels".into(),
            map: MapIdentity { id: "main".into(), ..MapIdentity::default() },
            labels: vec![label("gym", 1), label("kitchen", 2)],
        };
        assert_eq!(
            labels_text(&reply),
            "gym      said 1 time, most likely place 3\nkitchen  said 2 times, most likely place 3\n"
        );
        reply.labels.clear();
        assert!(labels_text(&reply).contains("no names yet"));
    }
}
