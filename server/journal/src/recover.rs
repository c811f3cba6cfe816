//! What is left of a damaged journal, for an operator who has no backup.

use crate::segment;
use crate::{Checkpoint, Disk, Entry, Journal, JournalError, checkpoint};

/// What could be saved.
#[derive(Debug)]
pub struct Rescued {
    /// The map to begin with.
    pub checkpoint: Checkpoint,
    /// What it took in after that, up to the first damage.
    pub tail: Vec<(u64, Entry)>,
    /// What is wrong, for people.
    pub losses: Vec<String>,
}

/// Reads as much as still follows, without a gap, from the best checkpoint that can be read.
///
/// # Errors
/// If no checkpoint can be read: there is no map to begin with.
pub fn rescue<D: Disk>(disk: &D) -> Result<Rescued, JournalError> {
    let names = disk.list().map_err(JournalError::io("journal"))?;
    let mut losses = Vec::new();
    let mut best: Option<(Checkpoint, Vec<(u64, Entry)>)> = None;
    let mut error = JournalError::damaged("checkpoint", 0, "there is none");
    for name in names.iter().filter(|n| checkpoint::index_of(n).is_some()) {
        let read = disk.read(name).map_err(JournalError::io(name));
        match read.and_then(|bytes| Checkpoint::read(name, &bytes)) {
            Ok(checkpoint) => {
                let tail = readable_tail(disk, &names, &checkpoint, &mut losses);
                let reach = |c: &Checkpoint, t: &[(u64, Entry)]| c.index + t.len() as u64;
                if best.as_ref().is_none_or(|(c, t)| reach(c, t) < reach(&checkpoint, &tail)) {
                    best = Some((checkpoint, tail));
                }
            }
            Err(e) => {
                losses.push(e.to_string());
                error = e;
            }
        }
    }
    losses.sort();
    losses.dedup();
    let (checkpoint, tail) = best.ok_or(error)?;
    Ok(Rescued { checkpoint, tail, losses })
}

/// The entries that follow a checkpoint without a gap.
fn readable_tail<D: Disk>(
    disk: &D,
    names: &[String],
    checkpoint: &Checkpoint,
    losses: &mut Vec<String>,
) -> Vec<(u64, Entry)> {
    let mut firsts: Vec<u64> = names.iter().filter_map(|n| segment::first_of(n)).collect();
    firsts.sort_unstable();
    let mut tail: Vec<(u64, Entry)> = Vec::new();
    for first in firsts {
        let name = segment::name(first);
        let read = disk.read(&name).map_err(JournalError::io(&name));
        let segment = read.and_then(|bytes| Ok((segment::read(&name, &bytes)?, bytes)));
        let (segment, bytes) = match segment {
            Ok(read) => read,
            Err(e) => {
                losses.push(e.to_string());
                continue;
            }
        };
        if let Some((offset, why)) = &segment.broken {
            losses.push(JournalError::damaged(&name, *offset, why.clone()).to_string());
        }
        for (index, range) in (first..).zip(segment.entries) {
            let next = checkpoint.index + 1 + tail.len() as u64;
            match Entry::from_bytes(bytes.get(range.clone()).unwrap_or_default()) {
                Ok(entry) if index == next => tail.push((index, entry)),
                Ok(_) => {}
                Err(e) => {
                    losses.push(JournalError::damaged(&name, range.start, e.to_string()).to_string());
                    break;
                }
            }
        }
    }
    tail
}

impl Rescued {
    /// Writes what was saved as a new journal into an empty folder.
    pub fn write<D: Disk>(&self, disk: D) -> Result<(), JournalError> {
        let Checkpoint { identity, map, .. } = self.checkpoint.clone();
        let mut journal = Journal::create(disk, identity, map)?;
        for (index, entry) in &self.tail {
            let bytes = entry
                .to_bytes()
                .map_err(|e| JournalError::damaged("journal", 0, format!("entry {index}: {e}")))?;
            journal.append(&bytes);
            if journal.uncommitted() > 1 << 20 {
                journal.commit()?;
            }
        }
        journal.commit().map(drop)
    }
}
