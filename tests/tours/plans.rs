//! Tours of real floor plans: nothing is ambiguous there, and nothing may get worse.

use crate::simulated;
use crate::tour::Tour;
use anyhow::{Context, Result, bail};
use std::path::{Path as File, PathBuf};
use std::process::Command;
use toponym_sim::tours::{Language, planned};
use toponym_sim::{FloorPlan, SimError};

/// The tour's name.
pub const NAME: &str = "plans";

fn archive(shared: &File) -> PathBuf {
    shared.join("data/floorplans/kth.tar.gz")
}

/// Why the tour can't be taken here; none if it can.
pub fn missing(shared: Option<&File>) -> Option<String> {
    let Some(shared) = shared else {
        return Some("it needs --shared DIR with DIR/data/floorplans/kth.tar.gz".into());
    };
    if !archive(shared).is_file() {
        return Some(format!("there is no {}", archive(shared).display()));
    }
    let tar = Command::new("tar").arg("--version").output();
    (!tar.is_ok_and(|o| o.status.success())).then(|| "it needs tar".into())
}

/// Plays a tour of the plan that is the seed's; where that has no scale or no two rooms in reach, of the next one.
pub fn tour(shared: &File, seed: u64, languages: &[Language]) -> Result<Tour> {
    let archive = archive(shared);
    let listed = tar(&["-tzf"], &archive, None)?;
    let mut plans: Vec<&str> =
        listed.lines().filter(|l| File::new(l).extension().is_some_and(|e| e == "xml")).collect();
    plans.sort_unstable();
    for k in 0..plans.len() {
        let name = plans[(seed as usize + k) % plans.len()];
        let Ok(plan) = FloorPlan::parse(&tar(&["-xOzf"], &archive, Some(name))?, File::new(name)) else {
            continue;
        };
        match planned(&plan, seed) {
            Ok(tour) => return simulated::played(&tour, languages),
            Err(SimError::TooSmall(_)) => {}
            Err(why) => bail!("{name}: {why}"),
        }
    }
    bail!("{}: no plan can be toured", archive.display())
}

fn tar(how: &[&str], archive: &File, member: Option<&str>) -> Result<String> {
    let out = Command::new("tar").args(how).arg(archive).args(member).output().context("tar")?;
    if !out.status.success() {
        bail!("tar {}: {}", archive.display(), String::from_utf8_lossy(&out.stderr));
    }
    Ok(String::from_utf8_lossy(&out.stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_its_data_it_says_what_it_needs() {
        assert!(missing(None).unwrap().contains("--shared"));
        assert!(missing(Some(File::new("no/such"))).unwrap().contains("no/such/data/floorplans/kth.tar.gz"));
    }
}
