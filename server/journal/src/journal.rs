//! The journal of one map: open, append, commit.

use crate::checkpoint::{self, Checkpoint};
use crate::segment::{self, FRAMES_AT, Segment, Writer};
use crate::{Disk, Entry, Identity, JournalError};
use toponym_proto::frame;

/// Length of a segment: some minutes of a robot's scans.
const SEGMENT_BYTES: usize = 4 << 20;
/// Checkpoints that are kept: should the newest turn out damaged, the one before it and the journal
/// since make the same map.
const CHECKPOINTS_KEPT: usize = 2;

/// A journal that is written to.
pub struct Journal<D: Disk> {
    disk: D,
    identity: Identity,
    /// The segment at whose end entries are added; none at first and after a failure.
    segment: Option<Writer<D::File>>,
    segment_bytes: usize,
    /// Frames that are not durable yet.
    buffer: Vec<u8>,
    /// Number of the next entry.
    next: u64,
    durable: u64,
}

/// A journal as it was found.
pub struct Opened<D: Disk> {
    /// Ready to go on.
    pub journal: Journal<D>,
    /// The map to begin with.
    pub checkpoint: Checkpoint,
    /// What it took in after that, with numbers.
    pub tail: Vec<(u64, Entry)>,
    /// What was mended, for people.
    pub mended: Vec<String>,
}

impl<D: Disk> Journal<D> {
    /// Begins a journal with a map that has taken in nothing yet, or whose history is elsewhere.
    pub fn create(disk: D, identity: Identity, map: Vec<u8>) -> Result<Self, JournalError> {
        Checkpoint { identity: identity.clone(), index: 0, map }.write(&disk)?;
        let segment = Some(Writer::create(&disk, &identity, 1, SEGMENT_BYTES)?);
        let segment_bytes = SEGMENT_BYTES;
        Ok(Self { disk, identity, segment, segment_bytes, buffer: Vec::new(), next: 1, durable: 0 })
    }

    /// Reads what there is. Nothing is written before the first commit.
    ///
    /// # Errors
    /// If anything that was durable is damaged; the folder is as it was.
    pub fn open(disk: D) -> Result<Opened<D>, JournalError> {
        let names = disk.list().map_err(JournalError::io("journal"))?;
        let mut mended = Vec::new();
        let checkpoint = newest_checkpoint(&disk, &names, &mut mended)?;
        let (tail, last) = tail(&disk, &names, &checkpoint, &mut mended)?;
        let identity = checkpoint.identity.clone();
        let journal = Self {
            disk,
            identity,
            segment: None,
            segment_bytes: SEGMENT_BYTES,
            buffer: Vec::new(),
            next: last + 1,
            durable: last,
        };
        Ok(Opened { journal, checkpoint, tail, mended })
    }

    /// Adds an entry, and tells its number; it is durable after the next [`Journal::commit`].
    pub fn append(&mut self, entry: &[u8]) -> u64 {
        let index = self.next;
        frame::append(&mut self.buffer, self.identity.salt(), index, entry);
        self.next += 1;
        index
    }

    /// Makes all that was appended durable, and tells the number of the last.
    ///
    /// # Errors
    /// If the medium fails; what was appended is kept, and goes to a new segment at the next try.
    pub fn commit(&mut self) -> Result<u64, JournalError> {
        if self.buffer.is_empty() {
            return Ok(self.durable);
        }
        let mut segment = match self.segment.take() {
            Some(segment) if segment.has_room(self.buffer.len()) => segment,
            _ => {
                let size = self.segment_bytes.max(FRAMES_AT + self.buffer.len());
                Writer::create(&self.disk, &self.identity, self.durable + 1, size)?
            }
        };
        let last = self.next - 1;
        segment.commit(&self.buffer, last).map_err(JournalError::io(&segment.name))?;
        self.segment = Some(segment);
        self.buffer.clear();
        self.durable = last;
        Ok(last)
    }

    /// Segments of another length from the next on.
    #[must_use]
    pub fn with_segments_of(self, segment_bytes: usize) -> Self {
        Self { segment_bytes, segment: None, ..self }
    }

    /// Number of the last durable entry.
    pub fn durable(&self) -> u64 {
        self.durable
    }

    /// Bytes that wait for the next commit.
    pub fn uncommitted(&self) -> usize {
        self.buffer.len()
    }

    /// Whose it is, as its next segment will say; a newer build or other settings may change it.
    pub fn identity_mut(&mut self) -> &mut Identity {
        &mut self.identity
    }
}

/// Removes checkpoints but the newest two, and the segments before those.
pub fn prune<D: Disk>(disk: &D) -> Result<(), JournalError> {
    let names = disk.list().map_err(JournalError::io("journal"))?;
    let mut checkpoints: Vec<u64> = names.iter().filter_map(|n| checkpoint::index_of(n)).collect();
    checkpoints.sort_unstable_by(|a, b| b.cmp(a));
    let (kept, old) = checkpoints.split_at(checkpoints.len().min(CHECKPOINTS_KEPT));
    let begin = kept.last().map_or(0, |index| index + 1);
    let mut firsts: Vec<u64> = names.iter().filter_map(|n| segment::first_of(n)).collect();
    firsts.sort_unstable();
    // The last is being written to.
    let ended = firsts.iter().zip(firsts.iter().skip(1)).filter(|(_, next)| **next <= begin);
    let ended = ended.map(|(first, _)| segment::name(*first));
    for name in ended.chain(old.iter().map(|index| checkpoint::name(*index))) {
        disk.remove(&name).map_err(JournalError::io(&name))?;
    }
    Ok(())
}

/// The newest checkpoint, or the one before if that is damaged.
fn newest_checkpoint<D: Disk>(
    disk: &D,
    names: &[String],
    mended: &mut Vec<String>,
) -> Result<Checkpoint, JournalError> {
    let mut found: Vec<(u64, &String)> =
        names.iter().filter_map(|n| Some((checkpoint::index_of(n)?, n))).collect();
    found.sort_unstable_by(|a, b| b.cmp(a));
    let mut first_error = None;
    for (_, name) in found {
        let bytes = disk.read(name).map_err(JournalError::io(name))?;
        match Checkpoint::read(name, &bytes) {
            Ok(checkpoint) => {
                if let Some(error) = first_error {
                    mended.push(format!("{error}: the checkpoint before it and the journal since are used"));
                }
                return Ok(checkpoint);
            }
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    Err(first_error.unwrap_or_else(|| JournalError::damaged("checkpoint", 0, "there is none")))
}

/// The entries after a checkpoint, and the number of the last entry there is.
fn tail<D: Disk>(
    disk: &D,
    names: &[String],
    checkpoint: &Checkpoint,
    mended: &mut Vec<String>,
) -> Result<(Vec<(u64, Entry)>, u64), JournalError> {
    let mut firsts: Vec<u64> = names.iter().filter_map(|n| segment::first_of(n)).collect();
    firsts.sort_unstable();
    if firsts.is_empty() && checkpoint.index == 0 {
        // It was stopped while it began.
        return Ok((Vec::new(), 0));
    }
    let needed = firsts.iter().rposition(|first| *first <= checkpoint.index + 1);
    let Some(firsts) = needed.and_then(|k| firsts.get(k..)) else {
        let why = format!("the entries after {} are missing", checkpoint.index);
        return Err(JournalError::damaged("journal", 0, why));
    };
    let (mut entries, mut last) = (Vec::new(), 0);
    for (k, first) in firsts.iter().enumerate() {
        let name = segment::name(*first);
        let bytes = disk.read(&name).map_err(JournalError::io(&name))?;
        let segment = segment::read(&name, &bytes)?;
        let count = whole_entries(&segment, firsts.get(k + 1).copied(), checkpoint, mended)?;
        for (index, range) in (*first..).zip(segment.entries.iter().take(count)) {
            if index > checkpoint.index {
                let payload = bytes.get(range.clone()).unwrap_or_default();
                let entry = Entry::from_bytes(payload)
                    .map_err(|e| JournalError::damaged(&name, range.start, e.to_string()))?;
                entries.push((index, entry));
            }
        }
        last = first + count as u64 - 1;
    }
    if last < checkpoint.index {
        let why = format!("it ends with entry {last}, but the checkpoint has {}", checkpoint.index);
        return Err(JournalError::damaged("journal", 0, why));
    }
    Ok((entries, last))
}

/// How many of a segment's entries count. `next`: first entry of the segment after it.
fn whole_entries(
    segment: &Segment,
    next: Option<u64>,
    checkpoint: &Checkpoint,
    mended: &mut Vec<String>,
) -> Result<usize, JournalError> {
    if segment.identity.uuid != checkpoint.identity.uuid {
        return Err(JournalError::damaged(&segment.name, 0, "it is another map's"));
    }
    let there = segment.first + segment.entries.len() as u64;
    // A segment begins when all before it is durable.
    let least = next.unwrap_or(segment.durable + 1);
    if there < least {
        let (offset, why) =
            segment.broken.clone().unwrap_or_else(|| (segment.end, "nothing stands here".to_owned()));
        let lost = if there + 1 < least { format!("{there} to {}", least - 1) } else { there.to_string() };
        let why = format!("{why}, where entry {lost} was durable");
        return Err(JournalError::damaged(&segment.name, offset, why));
    }
    if segment.slots_lost > 0 {
        // A stop while a mark is written leaves the entries that it was to tell of, whole and with nothing behind them. If
        // it is otherwise, the mark was lost later, and may have told of more than is left.
        if next.is_none() && (segment.broken.is_some() || there == segment.durable + 1) {
            let why =
                "one of two marks of what is durable is damaged: more may have been durable than is left";
            return Err(JournalError::damaged(&segment.name, segment::SLOTS_AT[0], why));
        }
        mended.push(format!(
            "{}: one of two marks of what is durable is lost; if the medium lost more, entries from {there} on are missing",
            segment.name
        ));
    }
    if let (Some((offset, why)), None) = (&segment.broken, next) {
        mended.push(format!(
            "{}: torn at byte {offset} ({why}): cut there, nothing acknowledged",
            segment.name
        ));
    }
    Ok(next.map_or(segment.entries.len(), |next| (next - segment.first) as usize))
}
