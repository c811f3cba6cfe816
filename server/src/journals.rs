//! `journal`: looks at maps' journals, and mends what can be mended.

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use toponym_journal::recover::rescue;
use toponym_journal::{Entry, Event, Folder, Journal, Opened, checkpoint, segment};
use toponym_proto::Message;
use toponym_proto::keys::check_id;

use crate::fold::Fold;
use crate::store::{Store, free_name};

/// Look at the journals of maps, and mend them
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
FOLDER is the data folder, or that of one map in it.

  toponym-server journal verify toponym-data         is all as it was written?
  toponym-server journal dump toponym-data/main      what came after the last checkpoint, a JSON object a line
  toponym-server journal recover toponym-data/main   begin anew with what can be read of a damaged map

Exit code 0 if all is well, 1 if something is damaged. `recover` keeps the damaged folder beside the new one, and wants
the server stopped.")]
pub struct JournalArgs {
    #[command(subcommand)]
    command: JournalCommand,
}

#[derive(Subcommand, Clone, Debug)]
enum JournalCommand {
    /// Read all of it, change nothing, and tell what is wrong
    Verify {
        /// The data folder, or a map's in it
        folder: PathBuf,
    },
    /// Print what came after the last checkpoint
    Dump {
        /// A map's folder
        folder: PathBuf,
    },
    /// Begin a map's journal anew with what can be read of it
    Recover {
        /// A map's folder
        folder: PathBuf,
    },
}

/// Runs the command.
pub fn run(args: &JournalArgs) -> Result<()> {
    match &args.command {
        JournalCommand::Verify { folder } => verify(folder),
        JournalCommand::Dump { folder } => dump(folder),
        JournalCommand::Recover { folder } => recover(folder),
    }
}

/// The folders of maps in a folder, or itself.
fn maps(folder: &Path) -> Result<Vec<PathBuf>> {
    let read = |path: &Path| std::fs::read_dir(path).with_context(|| path.display().to_string());
    let is_map = |path: &Path| -> Result<bool> {
        let mut names = read(path)?.filter_map(|e| e.ok()?.file_name().into_string().ok());
        Ok(names.any(|name| checkpoint::index_of(&name).is_some() || segment::first_of(&name).is_some()))
    };
    if is_map(folder)? {
        return Ok(vec![folder.into()]);
    }
    let mut found = Vec::new();
    for entry in read(folder)? {
        let path = entry?.path();
        // Damaged folders that were kept are no maps any more.
        let id = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.is_dir() && check_id("map", id).is_ok() && is_map(&path)? {
            found.push(path);
        }
    }
    if found.is_empty() {
        bail!("{}: there is no map's journal here", folder.display());
    }
    found.sort();
    Ok(found)
}

fn verify(folder: &Path) -> Result<()> {
    let mut damaged = 0;
    for map in maps(folder)? {
        match look(&map) {
            Ok(words) => println!("{}: {words}", map.display()),
            Err(why) => {
                println!("{}: DAMAGED: {why:#}", map.display());
                damaged += 1;
            }
        }
    }
    if damaged > 0 {
        bail!("{damaged} damaged; `journal recover FOLDER` begins anew with what can be read");
    }
    Ok(())
}

/// What is in a map's folder, in words.
fn look(map: &Path) -> Result<String> {
    let Opened { journal, checkpoint, tail, mended } = Journal::open(Folder(map.into()))?;
    let fold = Fold::load(&checkpoint.map).context("its checkpoint is whole, but not for this build")?;
    let mut words = format!(
        "good. Map {} of robot {}, written by build {}: {} entries, {} of them after the last checkpoint; the \
         robot's boot and seq are {}",
        checkpoint.identity.uuid,
        fold.card.robot,
        checkpoint.identity.build,
        journal.durable(),
        tail.len(),
        match tail.iter().filter_map(|(_, e)| e.watermark()).max().max(fold.card.watermark) {
            Some((boot, seq)) => format!("{boot} and {seq}"),
            None => "not known yet".into(),
        }
    );
    for what in mended {
        words.push_str("\n  mended at the next start: ");
        words.push_str(&what);
    }
    Ok(words)
}

fn dump(folder: &Path) -> Result<()> {
    let opened = Journal::open(Folder(folder.into())).with_context(|| folder.display().to_string())?;
    let mut out = BufWriter::new(std::io::stdout().lock());
    for (index, entry) in &opened.tail {
        let written = writeln!(out, "{}", line(*index, entry)?);
        match written {
            Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => return Ok(()),
            done => done?,
        }
    }
    Ok(out.flush()?)
}

fn line(index: u64, entry: &Entry) -> Result<serde_json::Value> {
    let at_s = entry.at_ns as f64 * 1e-9;
    Ok(match &entry.event {
        Event::Message(message) => {
            serde_json::json!({"index": index, "at_s": at_s, "message": serde_json::to_value(message)?})
        }
        Event::Say { boot, say } => {
            let say = serde_json::to_value(Message::Say(say.clone()))?;
            serde_json::json!({"index": index, "at_s": at_s, "boot": boot, "message": say})
        }
        Event::Gap { boot, to } => {
            serde_json::json!({"index": index, "at_s": at_s, "gap": {"boot": boot, "to": to}})
        }
        Event::Tick => serde_json::json!({"index": index, "at_s": at_s, "tick": true}),
        Event::Glossary(lines) => serde_json::json!({"index": index, "at_s": at_s, "lexicon": lines}),
        Event::Hold(ns) => serde_json::json!({"index": index, "at_s": at_s, "hold_s": *ns as f64 * 1e-9}),
    })
}

fn recover(folder: &Path) -> Result<()> {
    let parent = match folder.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    // Held as long as this works: no server may write here.
    let _store = Store::open(parent)?;
    if let Ok(words) = look(folder) {
        println!("{}: {words}\nnothing to recover", folder.display());
        return Ok(());
    }
    let name = folder.file_name().context("give a map's folder")?.to_string_lossy().into_owned();
    let rescued = rescue(&Folder(folder.into())).with_context(|| folder.display().to_string())?;
    let new = parent.join(format!("{name}.recovered"));
    std::fs::create_dir(&new).with_context(|| new.display().to_string())?;
    rescued.write(Folder(new.clone()))?;
    let kept = free_name(&parent.join(format!("{name}.damaged")));
    std::fs::rename(folder, &kept)?;
    std::fs::rename(&new, folder)?;
    toponym_journal::disk::sync_folder(parent)?;
    for loss in &rescued.losses {
        println!("damaged: {loss}");
    }
    println!(
        "{}: begins anew with the checkpoint after entry {} and the {} entries that follow it; what came later is \
         lost. The damaged files are in {}",
        folder.display(),
        rescued.checkpoint.index,
        rescued.tail.len(),
        kept.display()
    );
    Ok(())
}
