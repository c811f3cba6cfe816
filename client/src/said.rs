//! What a guide keeps on disk until it is known what became of it: the phone may go out before the robot is found again.
//!
//! A sentence is a file, `{ulid}.say`, so that names sort as they were said: JSON, `{"at_s": time since 1970, "say":
//! sentence}`, on disk before it is sent.

use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use toponym_proto::Say;
use tracing::warn;

#[derive(Deserialize, Serialize)]
struct Kept {
    at_s: f64,
    say: Say,
}

/// A guide's folder.
#[derive(Debug)]
pub struct Said {
    folder: PathBuf,
    files: HashMap<String, PathBuf>,
}

impl Said {
    /// Makes the folder if there is none, and finds what is left there: sentences, and how long ago they were said, oldest
    /// first. What can't be read is left alone, and told.
    ///
    /// # Errors
    /// The medium's.
    pub fn open(folder: &Path) -> io::Result<(Self, Vec<(Say, Duration)>)> {
        fs::create_dir_all(folder)?;
        let entries = fs::read_dir(folder)?.map(|entry| entry.map(|e| e.path()));
        let mut paths = entries.collect::<io::Result<Vec<_>>>()?;
        paths.retain(|path| path.extension().is_some_and(|e| e == "say"));
        paths.sort();
        let mut said = Self { folder: folder.into(), files: HashMap::new() };
        let mut left = Vec::new();
        for path in paths {
            match serde_json::from_slice::<Kept>(&fs::read(&path)?) {
                Ok(kept) => {
                    let at = UNIX_EPOCH + Duration::try_from_secs_f64(kept.at_s).unwrap_or_default();
                    said.files.insert(kept.say.id.clone(), path);
                    left.push((kept.say, at.elapsed().unwrap_or_default()));
                }
                Err(e) => warn!(file = %path.display(), "no sentence, left alone: {e}"),
            }
        }
        Ok((said, left))
    }

    /// Keeps a sentence that is said now: on disk when this returns.
    ///
    /// # Errors
    /// The medium's.
    pub fn keep(&mut self, say: &Say) -> io::Result<()> {
        if self.files.contains_key(&say.id) {
            return Ok(());
        }
        let at_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        let path = self.folder.join(format!("{}.say", ulid::Ulid::generate()));
        let new = path.with_extension("new");
        let mut file = File::create(&new)?;
        file.write_all(&serde_json::to_vec(&Kept { at_s, say: say.clone() })?)?;
        file.sync_all()?;
        fs::rename(&new, &path)?;
        File::open(&self.folder)?.sync_all()?;
        self.files.insert(say.id.clone(), path);
        Ok(())
    }

    /// What became of a sentence is known, or nobody asks any more.
    pub fn forget(&mut self, id: &str) {
        if let Some(path) = self.files.remove(id)
            && let Err(e) = fs::remove_file(&path)
        {
            warn!(file = %path.display(), "stays, and will be said again: {e}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_are_found_again_in_order_until_they_are_heard() {
        let folder = std::env::temp_dir().join(format!("toponym-said-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        let say = |id: &str| Say { id: id.into(), text: "this is the gym".into(), ..Say::default() };
        let (mut said, left) = Said::open(&folder).unwrap();
        assert!(left.is_empty());
        for id in ["c", "a/../b", "b"] {
            said.keep(&say(id)).unwrap();
        }
        said.keep(&say("c")).unwrap();
        said.forget("b");
        drop(said);
        fs::write(folder.join("torn.say"), b"{").unwrap();
        let (mut said, left) = Said::open(&folder).unwrap();
        let ids: Vec<&str> = left.iter().map(|(say, _)| say.id.as_str()).collect();
        assert_eq!(ids, ["c", "a/../b"]);
        for id in ["c", "a/../b"] {
            said.forget(id);
        }
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "what is no sentence is left alone");
        fs::remove_dir_all(folder).unwrap();
    }
}
