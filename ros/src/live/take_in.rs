//! What a robot sends, to the server: as any robot and guide would send it.

use super::feed::{Fed, Feed};
use super::session::{Arrived, Ear};
use super::{Shared, found};
use crate::cdr;
use crate::frames::{self, Moving};
use crate::msg::TFMessage;
use crate::plan::{Source, kind};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;
use toponym::guide::sentence;
use toponym::log::Options;
use toponym::robot::{Robot, RobotConfig};
use toponym::{ClientError, Guide};
use toponym_proto::{Clock, Message, Say};
use tracing::{info, warn};

/// Stamps that differ so little from this machine's time are of the same kind of clock.
const UNIX_NS: i64 = 86_400_000_000_000;

/// Until the session ends.
pub async fn take_in(shared: Arc<Shared>, mut ear: Ear) -> Result<(), String> {
    let ros = &shared.robot;
    let mut options = Options::default();
    (options.robot, options.map) = (ros.robot.clone(), ros.map.clone());
    let mut feed = Feed::new(options, &ros.topics);
    let guide =
        Guide::connect(&shared.own, &shared.site, Some(&ros.robot)).await.map_err(|e| e.to_string())?;
    let (mut robot, mut out): (Option<Robot>, Vec<Fed>) = (None, Vec::new());
    let (mut boot, mut refused) = (0, None);
    while let Some(arrived) = ear.arrivals.recv().await {
        shared.found().see(&arrived, ear.dropped.load(Ordering::Relaxed));
        notice_others(&shared, &arrived);
        shared.hashes.send_if_modified(|hashes| std::mem::replace(hashes, arrived.hashes) != arrived.hashes);
        let Arrived { topic, received_ns, data, .. } = arrived;
        if let Err(why) = feed.take(&topic, received_ns, data, &mut out) {
            shared.found().unused(&topic.name, why);
        }
        shared.found().problem = feed.problem().map(str::to_owned);
        let newest_ns = feed.newest_ns();
        shared.clock.send_if_modified(|clock| newest_ns.is_some_and(|ns| clock.see(ns, Instant::now())));
        for fed in out.drain(..) {
            let sent = match fed {
                Fed::Begins(plan) => {
                    let clock = match newest_ns {
                        Some(ns) if (received_ns - ns).abs() > UNIX_NS => Clock::Log,
                        _ => Clock::Unix,
                    };
                    let config =
                        RobotConfig { site: shared.site.clone(), clock, ..RobotConfig::new(&ros.robot) };
                    boot = config.boot.max(boot + 1);
                    let topic = match &plan.odometry {
                        Source::Tf { topic, .. } => topic.clone(),
                        Source::Topic { .. } | Source::None => feed.survey().tf_topic(&ros.namespace),
                    };
                    shared
                        .tf_topic
                        .send_if_modified(|known| std::mem::replace(known, topic.clone()) != topic);
                    // Where an earlier stream was says nothing of this one.
                    shared.pose.send_replace(None);
                    found::tell_plan(&shared, &plan);
                    shared.plan.send_replace(Some(plan));
                    let config = RobotConfig { boot, ..config };
                    Robot::connect(&shared.own, config).await.map(|new| robot = Some(new))
                }
                Fed::Message(Message::Say(say)) => {
                    info!(robot = ros.robot, "somebody speaks");
                    // A bag's ids are of its stamps, which a simulator's clock repeats.
                    guide.publish(&Say { id: sentence(&say.text).id, ..say }).await
                }
                Fed::Message(message) => match &mut robot {
                    Some(robot) => robot.send(message).await.map(|_| ()),
                    None => Ok(()),
                },
            };
            tell_refusal(&shared, &mut refused, sent);
        }
    }
    Err("the connection to the robot has ended".into())
}

/// Tells each refusal once, as long as it is the same.
fn tell_refusal(shared: &Shared, told: &mut Option<String>, sent: Result<(), ClientError>) {
    let why = sent.err().map(|e| e.to_string());
    if let Some(why) = why.filter(|why| told.as_ref() != Some(why)) {
        warn!(robot = shared.robot.robot, "the server does not take its messages: {why}");
        *told = Some(why);
    }
}

/// Whether somebody else tells where the robot's odometry lies in a map.
fn notice_others(shared: &Shared, arrived: &Arrived) {
    if arrived.topic.kind != kind::TF || arrived.topic.name != *shared.tf_topic.borrow() {
        return;
    }
    let odom = shared.plan.borrow().as_ref().and_then(|plan| plan.moving().map(|m| m.parent.clone()));
    let (Some(odom), Ok(message)) = (odom, cdr::read::<TFMessage>(&arrived.data)) else { return };
    let tells = |m: &Moving| m.child == odom;
    if message.transforms.iter().map(frames::moving).any(|m| tells(&m)) {
        shared.others_ns.store(arrived.received_ns, Ordering::Relaxed);
    }
}
