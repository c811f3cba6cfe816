//! # toponym
//!
//! Client library of the toponym mapping server: three roles over Zenoh, and readers of
//! recorded logs.
//!
//! - [`Robot`] streams odometry and scans and knows what the server has taken in;
//! - [`Guide`] says what places are called and hears what became of it;
//! - [`Planner`] asks where places are;
//! - [`log`] reads recorded robots.
//!
//! ```no_run
//! # async fn f() -> Result<(), toponym::ClientError> {
//! use std::time::Duration;
//! let session = toponym::open(&toponym::endpoint(None)).await?;
//! let planner = toponym::Planner::new(&session, "default", "main", Duration::from_secs(5))?;
//! for candidate in planner.where_is("gym").await?.candidates {
//!     println!("{:.2} at {:.1}, {:.1}", candidate.probability, candidate.x_m, candidate.y_m);
//! }
//! # Ok(())
//! # }
//! ```

pub mod guide;
pub mod log;
pub mod planner;
pub mod replay;
pub mod robot;
pub mod said;
pub mod session;
pub mod spool;
pub mod told;

#[cfg(test)]
mod network_tests;

pub use guide::Guide;
pub use planner::Planner;
pub use replay::Replay;
pub use robot::{Form, Robot, RobotConfig};
pub use session::{ClientError, Connection, endpoint, open};
pub use zenoh::Session;
