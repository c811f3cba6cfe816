//! Key expressions: where everything is on the network. The tree is split so that access rules
//! are prefixes.

use crate::stream::Message;
use crate::validate::Invalid;
pub use crate::validate::{ANY_ROBOT, check_id, check_link};

/// TCP port the server listens on by default.
pub const DEFAULT_PORT: u16 = 7457;
/// Where a client finds the server by default.
pub const DEFAULT_ENDPOINT: &str = "tcp/127.0.0.1:7457";
/// Site name by default.
pub const DEFAULT_SITE: &str = "default";

/// What a map can be asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask {
    /// Where is it?
    Where,
    /// What is this?
    What,
    /// Where is the nearest of its kind?
    Nearest,
    /// All names.
    Labels,
    /// Places and edges.
    Graph,
    /// Occupancy.
    Grid,
    /// Rooms.
    Regions,
}

impl Ask {
    /// All there are.
    pub const ALL: [Self; 7] =
        [Self::Where, Self::What, Self::Nearest, Self::Labels, Self::Graph, Self::Grid, Self::Regions];

    /// Last chunk of the key.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Where => "where",
            Self::What => "what",
            Self::Nearest => "nearest",
            Self::Labels => "labels",
            Self::Graph => "graph",
            Self::Grid => "grid",
            Self::Regions => "regions",
        }
    }
}

/// What a key of a robot carries to the server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// `in/setup`.
    Setup,
    /// `in/odom`.
    Odom,
    /// `in/scan/{laser}`.
    Scan {
        /// Laser id.
        laser: String,
    },
    /// `in/end`.
    End,
    /// `say`.
    Say,
}

/// Builds and reads the keys of one site.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Keys {
    prefix: String,
}

impl Keys {
    /// Keys of a site.
    pub fn new(site: &str) -> Result<Self, Invalid> {
        check_id("site", site)?;
        Ok(Self { prefix: format!("toponym/v1/{site}") })
    }

    /// Keys of all sites, to ask all servers.
    pub fn of_any_site() -> Self {
        Self { prefix: "toponym/v1/*".into() }
    }

    fn robot(&self, robot: &str, rest: &str) -> String {
        format!("{}/robot/{robot}/{rest}", self.prefix)
    }

    /// A robot's [`crate::Setup`].
    pub fn setup(&self, robot: &str) -> String {
        self.robot(robot, "in/setup")
    }
    /// A robot's [`crate::Odom`].
    pub fn odom(&self, robot: &str) -> String {
        self.robot(robot, "in/odom")
    }
    /// A robot's [`crate::Scan`]s of one laser.
    pub fn scan(&self, robot: &str, laser: &str) -> String {
        self.robot(robot, &format!("in/scan/{laser}"))
    }
    /// A robot's [`crate::End`].
    pub fn end(&self, robot: &str) -> String {
        self.robot(robot, "in/end")
    }
    /// Sentences to a robot; `None`: to the only one.
    pub fn say(&self, robot: Option<&str>) -> String {
        self.robot(robot.unwrap_or(ANY_ROBOT), "say")
    }
    /// A robot's [`crate::answer::PoseOut`].
    pub fn pose(&self, robot: &str) -> String {
        self.robot(robot, "out/pose")
    }
    /// [`crate::answer::Heard`] of the sentences to a robot (`*`: to all).
    pub fn heard(&self, robot: &str) -> String {
        self.robot(robot, "out/heard")
    }
    /// Where a robot is sent, [`crate::answer::Sent`].
    pub fn goal(&self, robot: &str) -> String {
        self.robot(robot, "out/goal")
    }
    /// A robot's [`crate::answer::Ack`].
    pub fn ack(&self, robot: &str) -> String {
        self.robot(robot, "out/ack")
    }
    /// A robot's [`crate::answer::RobotState`].
    pub fn state(&self, robot: &str) -> String {
        self.robot(robot, "out/state")
    }
    /// Selects all of a robot's streams (`*`: of all robots).
    pub fn inputs(&self, robot: &str) -> String {
        self.robot(robot, "in/**")
    }
    /// Selects all that the server publishes about a robot.
    pub fn outputs(&self, robot: &str) -> String {
        self.robot(robot, "out/**")
    }
    /// Selects all questions to a map.
    pub fn asks(&self, map: &str) -> String {
        format!("{}/map/{map}/ask/*", self.prefix)
    }
    /// Selects all that the server publishes about a map.
    pub fn map_outputs(&self, map: &str) -> String {
        format!("{}/map/{map}/out/**", self.prefix)
    }
    /// A question to a map.
    pub fn ask(&self, map: &str, ask: Ask) -> String {
        format!("{}/map/{map}/ask/{}", self.prefix, ask.as_str())
    }
    /// A map's newest [`crate::answer::GraphReply`].
    pub fn graph(&self, map: &str) -> String {
        format!("{}/map/{map}/out/graph", self.prefix)
    }
    /// A map's newest [`crate::answer::Jump`] of coordinates.
    pub fn jump(&self, map: &str) -> String {
        format!("{}/map/{map}/out/jump", self.prefix)
    }
    /// A query that changes something, such as `save`.
    pub fn command(&self, name: &str) -> String {
        format!("{}/do/{name}", self.prefix)
    }
    /// [`crate::answer::Info`] about the server.
    pub fn info(&self) -> String {
        format!("{}/info", self.prefix)
    }
    /// [`crate::answer::Clocks`]: what time it is, here and for each robot.
    pub fn time(&self) -> String {
        format!("{}/time", self.prefix)
    }
    /// Liveliness token of a server.
    pub fn alive(&self, server: &str) -> String {
        format!("{}/alive/{server}", self.prefix)
    }

    /// Selects all robots' streams.
    pub fn all_inputs(&self) -> String {
        self.inputs("*")
    }

    /// Selects everything that can be asked, and more.
    pub fn everything(&self) -> String {
        format!("{}/**", self.prefix)
    }

    /// What follows `toponym/v1/{site}/`, as chunks.
    pub fn chunks<'a>(&self, key: &'a str) -> Option<Vec<&'a str>> {
        Some(key.strip_prefix(&self.prefix)?.strip_prefix('/')?.split('/').collect())
    }

    /// Robot and kind of a key on which robots and guides publish.
    pub fn input(&self, key: &str) -> Result<(String, Input), Invalid> {
        let unknown = || Invalid::new("key", format!("{key} is not one that is listened to"));
        let (robot, input) = match self.chunks(key).ok_or_else(unknown)?.as_slice() {
            ["robot", robot, "in", "setup"] => (*robot, Input::Setup),
            ["robot", robot, "in", "odom"] => (*robot, Input::Odom),
            ["robot", robot, "in", "end"] => (*robot, Input::End),
            ["robot", robot, "in", "scan", laser] => {
                check_id("laser", laser)?;
                (*robot, Input::Scan { laser: (*laser).into() })
            }
            ["robot", robot, "say"] => (*robot, Input::Say),
            _ => return Err(unknown()),
        };
        check_id("robot", robot)?;
        if robot == ANY_ROBOT && input != Input::Say {
            return Err(Invalid::new("robot", format!("\"{ANY_ROBOT}\" is no robot's id: it is reserved")));
        }
        Ok((robot.into(), input))
    }
}

/// Checks that a message says the same as the key it came on.
pub fn check_key(robot: &str, input: &Input, message: &Message) -> Result<(), Invalid> {
    let said = match message {
        Message::Say(say) => say.robot.as_deref(),
        other => other.header().map(|h| h.robot.as_str()),
    };
    if let Some(said) = said
        && said != robot
        && robot != ANY_ROBOT
    {
        return Err(Invalid::new("robot", format!("is {said:?}, but the key's robot is {robot:?}")));
    }
    match (input, message) {
        (Input::Scan { laser }, Message::Scan(scan)) if *laser != scan.laser => {
            Err(Invalid::new("laser", format!("is {:?}, but the key's laser is {laser:?}", scan.laser)))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids() {
        for good in ["r07", "0", "a_b-c", &"x".repeat(63)] {
            assert!(check_id("robot", good).is_ok(), "{good}");
        }
        for bad in ["", "R07", "-a", "a/b", "a*", "ä", "a b", &"x".repeat(64)] {
            assert!(check_id("robot", bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn keys_are_read_as_they_are_built() {
        let keys = Keys::new("lab").unwrap();
        let scan = Input::Scan { laser: "front".into() };
        for (key, want) in [
            (keys.setup("r07"), Input::Setup),
            (keys.odom("r07"), Input::Odom),
            (keys.scan("r07", "front"), scan),
            (keys.end("r07"), Input::End),
            (keys.say(Some("r07")), Input::Say),
        ] {
            assert!(key.starts_with("toponym/v1/lab/robot/r07/"));
            assert_eq!(keys.input(&key).unwrap(), ("r07".into(), want));
        }
        assert_eq!(keys.input(&keys.say(None)).unwrap(), (ANY_ROBOT.into(), Input::Say));
        assert!(keys.input(&keys.setup(ANY_ROBOT)).is_err());
        assert!(keys.input("toponym/v1/lab/robot/r07/in/scan/A").is_err());
        assert!(keys.input("toponym/v1/other/robot/r07/in/odom").is_err());
    }

    #[test]
    fn a_message_must_agree_with_its_key() {
        let say = Message::Say(crate::Say { robot: Some("r07".into()), ..Default::default() });
        assert!(check_key("r07", &Input::Say, &say).is_ok());
        assert!(check_key(ANY_ROBOT, &Input::Say, &say).is_ok());
        assert_eq!(check_key("r08", &Input::Say, &say).unwrap_err().field, "robot");
    }
}
