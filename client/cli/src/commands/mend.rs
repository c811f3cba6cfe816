//! `toponym undo`, `rename`, `forget` and `initial-pose`: an operator mends what was said, and what the robot believes.

use super::{Failure, exit};
use std::time::Duration;
use toponym::{ClientError, Connection, Planner};
use toponym_proto::answer::ErrorCode;
use toponym_proto::{Mend, Pose};

/// Arguments of `undo`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym undo                              the newest sentence that stands
  toponym undo 01JD2E4T9Q0000000000000000   the sentence with this id: `toponym where NAME --json` lists
                                            those that an answer rests on

Exit code 1 if there is no such sentence.")]
pub struct UndoArgs {
    /// The sentence's id.
    id: Option<String>,
    #[command(flatten)]
    at: At,
}

/// Arguments of `rename`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  toponym rename 'jim' 'gym'

Whoever says or asks the wrong name means the right one from now on. Exit code 1 if nobody named it.")]
pub struct RenameArgs {
    /// The name as it is.
    from: String,
    /// The name as it should be.
    to: String,
    #[command(flatten)]
    at: At,
}

/// Arguments of `forget`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  toponym forget 'printer room'

It may be taught again. Exit code 1 if nobody named it.")]
pub struct ForgetArgs {
    /// The name.
    name: String,
    #[command(flatten)]
    at: At,
}

/// Arguments of `initial-pose`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym initial-pose 3.2,-1,90
  toponym initial-pose 3.2,-1,90 --within 2,30

For a robot that was switched on anywhere, or doubts where it is. It is evidence, not the truth: scans may speak against it, and
`toponym undo` takes it back.")]
pub struct InitialPoseArgs {
    /// Metres, metres and degrees, in the map.
    #[arg(value_name = "X,Y,HEADING", value_parser = three, allow_hyphen_values = true)]
    pose: [f64; 3],
    /// How sure that is: standard deviations, metres and degrees.
    #[arg(long, value_name = "M,DEGREES", value_parser = two, default_value = "0.5,15")]
    within: [f64; 2],
    #[command(flatten)]
    at: At,
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let all: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    all.ok()
        .and_then(|all| all.try_into().ok())
        .ok_or_else(|| format!("give {N} numbers, with commas between"))
}

fn three(text: &str) -> Result<[f64; 3], String> {
    numbers(text)
}

fn two(text: &str) -> Result<[f64; 2], String> {
    numbers(text)
}

pub async fn initial_pose(to: &Connection, site: &str, args: &InitialPoseArgs) -> Result<u8, Failure> {
    let ([x_m, y_m, degrees], [sigma_m, sigma_degrees]) = (args.pose, args.within);
    let told = Mend::Pose {
        id: toponym::guide::sentence("").id,
        map_from_body: Pose { x_m, y_m, yaw_rad: degrees.to_radians() },
        sigma_m,
        sigma_rad: sigma_degrees.to_radians(),
    };
    mend(to, site, &args.at, &told).await
}

/// Arguments of `delete`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  toponym delete attic

The server keeps the map's folder, under another name: rename it back, with the server stopped, to have it again. The robot
that mapped it has to present itself again. Exit code 5 if there is no such map.")]
pub struct DeleteArgs {
    /// The map.
    map: String,
    /// How long to wait for the answer.
    #[arg(long, value_name = "S", default_value = "60", value_parser = super::seconds)]
    timeout: Duration,
}

pub async fn delete(to: &Connection, site: &str, args: &DeleteArgs) -> Result<u8, Failure> {
    let session = to.open().await?;
    Planner::new(&session, site, &args.map, args.timeout)?.delete().await?;
    println!("map {} is deleted; the server keeps its folder aside", args.map);
    Ok(exit::FOUND)
}

/// Which map, and how patiently.
#[derive(Debug, clap::Args)]
pub struct At {
    /// Which map.
    #[arg(long, default_value = "main")]
    pub map: String,
    /// How long to wait for the answer.
    #[arg(long, value_name = "S", default_value = "10", value_parser = super::seconds)]
    pub timeout: Duration,
}

pub async fn undo(to: &Connection, site: &str, args: &UndoArgs) -> Result<u8, Failure> {
    mend(to, site, &args.at, &Mend::Undo { id: args.id.clone() }).await
}

pub async fn rename(to: &Connection, site: &str, args: &RenameArgs) -> Result<u8, Failure> {
    mend(to, site, &args.at, &Mend::Rename { from: args.from.clone(), to: args.to.clone() }).await
}

pub async fn forget(to: &Connection, site: &str, args: &ForgetArgs) -> Result<u8, Failure> {
    mend(to, site, &args.at, &Mend::Forget { name: args.name.clone() }).await
}

async fn mend(to: &Connection, site: &str, at: &At, mend: &Mend) -> Result<u8, Failure> {
    let session = to.open().await?;
    mended(&Planner::new(&session, site, &at.map, at.timeout)?, mend).await
}

/// Tells what was done, or why there is nothing to do.
pub async fn mended(planner: &Planner, mend: &Mend) -> Result<u8, Failure> {
    match planner.mend(mend).await {
        Ok(mended) => {
            println!("{}", mended.words);
            Ok(exit::FOUND)
        }
        Err(ClientError::Refused(problem)) if problem.code == ErrorCode::NothingToMend => {
            println!("{}", problem.message);
            Ok(exit::NOT_KNOWN)
        }
        Err(e) => Err(e.into()),
    }
}
