//! The policy: users, their roles and passwords.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use toponym_proto::Invalid;
use toponym_proto::keys::{ANY_ROBOT, check_id};

/// What a user is to the server.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Streams as its robots, and knows what became of it.
    Robot,
    /// Talks to robots, hears what became of it, asks, and mends what was said.
    Guide,
    /// Asks where things are, and follows robots and maps.
    Planner,
    /// Looks at maps, robots and how the server does.
    Viewer,
    /// What a viewer may, and hears, mends, saves and deletes.
    Operator,
    /// All that the others may: for a Zenoh router that checks its own clients.
    Trusted,
}

impl Role {
    /// All there are.
    pub const ALL: [Self; 6] =
        [Self::Robot, Self::Guide, Self::Planner, Self::Viewer, Self::Operator, Self::Trusted];
}

/// One user.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct User {
    /// What they may.
    pub role: Role,
    /// The robots as which (robots) or to which (guides) they may talk; empty: the one of their name (robots), all (guides).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub robots: Vec<String>,
    /// By which they are known; none: by a certificate with their name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub password: Option<String>,
}

/// A policy can't be used.
#[derive(Debug, thiserror::Error)]
pub enum PolicyError {
    /// The file can't be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It isn't TOML, or says something that doesn't exist; the text shows the line.
    #[error("{}: {source}", path.display())]
    Parse {
        /// Which file.
        path: PathBuf,
        /// What and where.
        source: Box<toml::de::Error>,
    },
    /// What it says can't be.
    #[error("{}: {invalid}", path.display())]
    Invalid {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        invalid: Invalid,
    },
}

/// Who may do what.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Policy {
    /// Whether whoever connects from this machine may do all that a client can: as long as there is no policy.
    #[serde(skip)]
    pub local: bool,
    /// The users by name.
    #[serde(default)]
    pub users: BTreeMap<String, User>,
}

impl Policy {
    /// Without a file: this machine may do everything, nobody else anything.
    pub fn of_this_machine() -> Self {
        Self { local: true, users: BTreeMap::new() }
    }

    /// Reads a policy; without a file it is [`Policy::of_this_machine`].
    pub fn read(path: &Path) -> Result<Self, PolicyError> {
        let text = match fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Self::of_this_machine()),
            Err(source) => return Err(PolicyError::File { path: path.into(), source }),
        };
        let policy: Self = toml::from_str(&text)
            .map_err(|source| PolicyError::Parse { path: path.into(), source: Box::new(source) })?;
        policy.check().map_err(|invalid| PolicyError::Invalid { path: path.into(), invalid })?;
        Ok(policy)
    }

    /// Writes a policy for nobody else's eyes, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), PolicyError> {
        let failed = |source| PolicyError::File { path: path.into(), source };
        let invalid = |invalid| PolicyError::Invalid { path: path.into(), invalid };
        self.check().map_err(invalid)?;
        let body = toml::to_string(self).map_err(|e| invalid(Invalid::new("policy", e.to_string())))?;
        let text = format!(
            "# Who may do what: `toponym-server user --help`. Passwords are in the clear, as Zenoh's challenge needs them.\n\n{body}"
        );
        write_secret(path, text.as_bytes()).map_err(failed)
    }

    fn check(&self) -> Result<(), Invalid> {
        for (name, user) in &self.users {
            check_id("user", name)?;
            for robot in &user.robots {
                check_id("robots", robot)?;
                if robot == ANY_ROBOT {
                    return Err(Invalid::new(
                        "robots",
                        format!("\"{ANY_ROBOT}\" is no robot's id: it is reserved"),
                    ));
                }
            }
            if user
                .password
                .as_ref()
                .is_some_and(|p| p.trim() != p || p.is_empty() || p.contains(['\n', '\r']))
            {
                let message = format!("of {name} is empty, or has a space around it or a line break in it");
                return Err(Invalid::new("password", message));
            }
        }
        let without = self.users.iter().find(|(_, user)| user.password.is_none());
        if let Some((name, _)) = without
            && self.by_password()
        {
            let message = format!(
                "{name} has none, but others do: either all are known by passwords, or all by certificates"
            );
            return Err(Invalid::new("password", message));
        }
        Ok(())
    }

    /// Whether users are known by passwords, not by certificates.
    pub fn by_password(&self) -> bool {
        self.users.values().any(|user| user.password.is_some())
    }

    /// Names and passwords as Zenoh reads them.
    pub fn dictionary(&self) -> String {
        self.users.iter().fold(String::new(), |mut text, (name, user)| {
            if let Some(password) = &user.password {
                let _ = writeln!(text, "{name}:{password}");
            }
            text
        })
    }
}

/// Writes a file that only its owner may read, whole or not at all. Its owner is the folder's, where one may say so: a
/// server that runs as a user of its own can read what root wrote for it.
pub fn write_secret(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".new");
    let new = path.with_file_name(name);
    match fs::remove_file(&new) {
        Err(e) if e.kind() != ErrorKind::NotFound => return Err(e),
        _ => {}
    }
    let mut options = fs::OpenOptions::new();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.write(true).create_new(true).open(&new)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    give_to_owner_of(parent(&new), &new)?;
    fs::rename(&new, path)
}

/// Makes a folder, if there is none, of the owner of the one that it is in.
pub fn make_folder(path: &Path) -> std::io::Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    make_folder(parent(path))?;
    fs::create_dir(path)?;
    give_to_owner_of(parent(path), path)
}

fn parent(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(unix)]
fn give_to_owner_of(folder: &Path, path: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::{MetadataExt as _, chown};
    let owner = fs::metadata(folder)?;
    // Only root may; for everybody else it is theirs already.
    let _ = chown(path, Some(owner.uid()), Some(owner.gid()));
    Ok(())
}

#[cfg(not(unix))]
fn give_to_owner_of(_: &Path, _: &Path) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Policy, String> {
        let policy: Policy = toml::from_str(text).map_err(|e| e.to_string())?;
        policy.check().map_err(|e| e.to_string())?;
        Ok(policy)
    }

    #[test]
    fn a_policy_is_read_as_it_is_written() {
        let user = User { role: Role::Guide, robots: vec!["r07".into()], password: Some("word".into()) };
        let policy = Policy { local: false, users: [("anna".to_owned(), user)].into() };
        assert_eq!(read(&toml::to_string(&policy).unwrap()).unwrap(), policy);
        assert_eq!(policy.dictionary(), "anna:word\n");
    }

    #[test]
    fn an_empty_policy_lets_nobody_in() {
        assert_eq!(read("").unwrap(), Policy::default());
        assert!(!Policy::default().local);
    }

    #[test]
    fn what_can_not_be_is_told() {
        for (text, told) in [
            ("[users.Anna]\nrole = \"guide\"", "user"),
            ("[users.anna]\nrole = \"boss\"", "line 2"),
            ("[users.r]\nrole = \"robot\"\nrobots = [\"*\"]", "robots"),
            ("[users.a]\nrole = \"guide\"\npassword = \"\"", "password"),
            ("[users.a]\nrole = \"guide\"\npassword = \"x\\ny\"", "password"),
            ("[users.a]\nrole = \"guide\"\npassword = \"x\"\n[users.b]\nrole = \"viewer\"", "b has none"),
            ("[user.a]\nrole = \"guide\"", "user"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(told), "{text}: {error}");
        }
    }
}
