//! The planner's role: asks where things are, and mends what was said. Questions change nothing.

use crate::session::{ClientError, ask};
use std::time::Duration;
use toponym_proto::answer::{
    Done, GraphReply, GridReply, Info, LabelsReply, Mended, Sent, WhatReply, WhereReply,
};
use toponym_proto::keys::{Ask, Keys, check_id};
use toponym_proto::regions::RegionsReply;
use toponym_proto::selector;
use toponym_proto::{Mend, Pose};
use zenoh::Session;

/// Asks one map of one site.
#[derive(Clone, Debug)]
pub struct Planner {
    session: Session,
    keys: Keys,
    map: String,
    timeout: Duration,
}

impl Planner {
    /// For a map of a site; each question waits up to `timeout`.
    ///
    /// # Errors
    /// If site or map are no ids.
    pub fn new(session: &Session, site: &str, map: &str, timeout: Duration) -> Result<Self, ClientError> {
        check_id("map", map)?;
        Ok(Self { session: session.clone(), keys: Keys::new(site)?, map: map.into(), timeout })
    }

    /// Where is what people call so? A bare name ("gym") or a whole question ("where is the
    /// gym"). An unknown name is an answer without candidates, no error.
    pub async fn where_is(&self, name: &str) -> Result<WhereReply, ClientError> {
        self.where_is_in(name, None).await
    }

    /// The same in another language, by its tag (BCP 47).
    ///
    /// # Errors
    /// If the server does not know it.
    pub async fn where_is_in(&self, name: &str, lang: Option<&str>) -> Result<WhereReply, ClientError> {
        let arguments = selector::encode([("name", name)].into_iter().chain(lang.map(|lang| ("lang", lang))));
        ask(&self.session, &self.keys.ask(&self.map, Ask::Where), &arguments, self.timeout).await
    }

    /// Where is the nearest of what people call so, or of that kind ("restroom"), by the way there from the robot?
    ///
    /// # Errors
    /// If the robot does not know where it is, the server does not know the language, or no answer comes in time.
    pub async fn nearest(&self, name: &str, lang: Option<&str>) -> Result<WhereReply, ClientError> {
        let arguments = selector::encode([("name", name)].into_iter().chain(lang.map(|lang| ("lang", lang))));
        ask(&self.session, &self.keys.ask(&self.map, Ask::Nearest), &arguments, self.timeout).await
    }

    /// What is at a point of the map, metres; none: where the robot is?
    ///
    /// # Errors
    /// If the robot is asked for and does not know where it is, or no answer comes in time.
    pub async fn what(&self, at_m: Option<[f64; 2]>) -> Result<WhatReply, ClientError> {
        let at_m = at_m.map(|at_m| at_m.map(|m| m.to_string()));
        let point = at_m.iter().flat_map(|[x, y]| [("x_m", x.as_str()), ("y_m", y.as_str())]);
        let arguments = selector::encode(point);
        ask(&self.session, &self.keys.ask(&self.map, Ask::What), &arguments, self.timeout).await
    }

    /// All names taught so far.
    pub async fn labels(&self) -> Result<LabelsReply, ClientError> {
        ask(&self.session, &self.keys.ask(&self.map, Ask::Labels), "", self.timeout).await
    }

    /// Places and edges of the posterior's graphs.
    pub async fn graph(&self) -> Result<GraphReply, ClientError> {
        ask(&self.session, &self.keys.ask(&self.map, Ask::Graph), "", self.timeout).await
    }

    /// Occupancy of the best graph, in cells of `resolution_m`.
    pub async fn grid(&self, resolution_m: f64) -> Result<GridReply, ClientError> {
        let resolution_m = resolution_m.to_string();
        let arguments = selector::encode([("resolution_m", resolution_m.as_str())]);
        ask(&self.session, &self.keys.ask(&self.map, Ask::Grid), &arguments, self.timeout).await
    }

    /// Rooms of the best graph: outlines, doorways, names.
    ///
    /// # Errors
    /// If there is no such map, or no answer in time.
    pub async fn regions(&self) -> Result<RegionsReply, ClientError> {
        ask(&self.session, &self.keys.ask(&self.map, Ask::Regions), "", self.timeout).await
    }

    /// Sends the map's robot to where something is, through whatever drives it and hears [`Keys::goal`]. Nothing is sent, and
    /// no goal is told, where that is rather nowhere or can't be reached; refused where the robot is lost.
    pub async fn go(&self, name: &str, lang: Option<&str>) -> Result<Sent, ClientError> {
        let arguments = [Some(("map", self.map.as_str())), Some(("name", name)), lang.map(|l| ("lang", l))];
        let arguments = selector::encode(arguments.into_iter().flatten());
        ask(&self.session, &self.keys.command("go"), &arguments, self.timeout).await
    }

    /// Deletes the map; the server keeps its folder aside. Its robot has to present itself again.
    pub async fn delete(&self) -> Result<Done, ClientError> {
        let arguments = selector::encode([("map", self.map.as_str())]);
        ask(&self.session, &self.keys.command("delete"), &arguments, self.timeout).await
    }

    /// Saves the map. The answer comes after everything that was acknowledged before has gone
    /// through the filter.
    pub async fn save(&self) -> Result<Done, ClientError> {
        let arguments = selector::encode([("map", self.map.as_str())]);
        ask(&self.session, &self.keys.command("save"), &arguments, self.timeout).await
    }

    /// Mends what was said: takes a sentence back, as if it had never been said; gives a name its right
    /// spelling; forgets a name; takes in where somebody sees the robot, or an area. Refused where there is nothing of the kind.
    pub async fn mend(&self, mend: &Mend) -> Result<Mended, ClientError> {
        let (command, mut arguments) = match mend {
            Mend::Undo { id } => ("undo", id.iter().map(|id| ("id", id.clone())).collect()),
            Mend::Rename { from, to } => ("rename", vec![("from", from.clone()), ("to", to.clone())]),
            Mend::Forget { name } => ("forget", vec![("name", name.clone())]),
            Mend::Pose { id, map_from_body: Pose { x_m, y_m, yaw_rad }, sigma_m, sigma_rad } => {
                let numbers = [
                    ("x_m", x_m),
                    ("y_m", y_m),
                    ("yaw_rad", yaw_rad),
                    ("sigma_m", sigma_m),
                    ("sigma_rad", sigma_rad),
                ];
                let numbers = numbers.into_iter().map(|(name, value)| (name, value.to_string()));
                ("initial_pose", numbers.chain([("id", id.clone())]).collect())
            }
            Mend::Area { id, polygon_m, name, instead, forbidden } => {
                let corners: Vec<String> = polygon_m.iter().flatten().map(ToString::to_string).collect();
                let flags = [("instead", *instead), ("forbidden", *forbidden)];
                let told = [("id", id.clone()), ("polygon_m", corners.join(","))].into_iter();
                let told = told.chain(name.iter().map(|name| ("name", name.clone())));
                ("area", told.chain(flags.map(|(flag, set)| (flag, set.to_string()))).collect())
            }
        };
        arguments.push(("map", self.map.clone()));
        let arguments = selector::encode(arguments.iter().map(|(name, value)| (*name, value.as_str())));
        ask(&self.session, &self.keys.command(command), &arguments, self.timeout).await
    }

    /// The server's maps and robots.
    pub async fn info(&self) -> Result<Info, ClientError> {
        ask(&self.session, &self.keys.info(), "", self.timeout).await
    }
}
