//! A folder in memory. Zeros at the end of a file are left out: to a journal they mean what nothing means, and so the
//! megabytes that a segment reserves need not be read again for each input.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::rc::Rc;
use toponym_journal::{Disk, DiskFile};

type Content = Rc<RefCell<Vec<u8>>>;

/// The folder; a clone is the same one.
#[derive(Clone, Debug, Default)]
pub struct Medium {
    files: Rc<RefCell<BTreeMap<String, Content>>>,
}

/// A file of it.
#[derive(Debug)]
pub struct MediumFile(Content);

impl Medium {
    /// A folder with these files.
    pub fn with(files: impl IntoIterator<Item = (String, Vec<u8>)>) -> Self {
        let files = files.into_iter().map(|(name, bytes)| (name, Rc::new(RefCell::new(bytes)))).collect();
        Self { files: Rc::new(RefCell::new(files)) }
    }

    /// Its files.
    pub fn files(&self) -> BTreeMap<String, Vec<u8>> {
        self.files.borrow().iter().map(|(name, content)| (name.clone(), content.borrow().clone())).collect()
    }
}

impl Disk for Medium {
    type File = MediumFile;

    fn list(&self) -> io::Result<Vec<String>> {
        Ok(self.files.borrow().keys().cloned().collect())
    }

    fn read(&self, name: &str) -> io::Result<Vec<u8>> {
        let files = self.files.borrow();
        Ok(files.get(name).ok_or(io::ErrorKind::NotFound)?.borrow().clone())
    }

    fn create(&self, name: &str, _bytes: u64) -> io::Result<MediumFile> {
        let content = Content::default();
        self.files.borrow_mut().insert(name.into(), content.clone());
        Ok(MediumFile(content))
    }

    fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        let mut files = self.files.borrow_mut();
        let content = files.remove(from).ok_or(io::ErrorKind::NotFound)?;
        files.insert(to.into(), content);
        Ok(())
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        self.files.borrow_mut().remove(name).map(drop).ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn sync_names(&self) -> io::Result<()> {
        Ok(())
    }
}

impl DiskFile for MediumFile {
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        let mut content = self.0.borrow_mut();
        let end = offset as usize + bytes.len();
        if content.len() < end {
            content.resize(end, 0);
        }
        content[offset as usize..end].copy_from_slice(bytes);
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}
