//! Questions in ROS's words: services, and topics for those who have no types of ours.

use super::broadcast::goal;
use super::mouth::{Asked, Speaker, Writer};
use super::{Failure, Shared};
use crate::cdr;
use crate::frames::{isometry, on_floor};
use crate::msg::{
    PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped, StringMsg, Transform, TriggerResponse,
    WhereRequest, WhereResponse,
};
use crate::plan::kind;
use crate::wire::{self, Qos};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Handle;
use tokio::sync::Semaphore;
use toponym::guide::sentence;
use toponym::told::where_text;
use toponym::{ClientError, Planner};
use toponym_proto::answer::WhereReply;
use toponym_proto::stream::{TOLD_SIGMA_M, TOLD_SIGMA_RAD};
use toponym_proto::{Mend, Pose};
use tracing::{info, warn};
use zenoh::Session;
use zenoh::sample::Locality;

/// How long an answer may take.
const ANSWER_WAIT: Duration = Duration::from_secs(5);
/// Questions answered at a time; more are told to ask again.
const AT_A_TIME: usize = 8;
const BUSY: &str = "too many questions: ask again";

/// What is needed to answer.
struct Desk {
    shared: Arc<Shared>,
    planner: Planner,
    runtime: Handle,
    permits: Arc<Semaphore>,
    answers: Writer,
    answer_poses: Writer,
}

/// From now on, until the session closes.
pub async fn answer_all(shared: &Arc<Shared>, ros: &Session, speaker: &Speaker) -> Result<(), Failure> {
    let topic = |name: &'static str, kind| async move {
        speaker.topic(&speaker.named(name), kind, Qos::Reliable(10)).await
    };
    let desk = Arc::new(Desk {
        shared: shared.clone(),
        planner: Planner::new(&shared.own, &shared.site, &shared.robot.map, ANSWER_WAIT)?,
        runtime: Handle::current(),
        permits: Arc::new(Semaphore::new(AT_A_TIME)),
        answers: topic("/toponym/answer", kind::TEXT).await?,
        answer_poses: topic("/toponym/answer_pose", kind::POSE).await?,
    });
    for (name, go) in [("/toponym/ask", false), ("/toponym/go", true)] {
        let (name, desk) = (speaker.named(name), desk.clone());
        speaker.listens(&name, kind::TEXT, Qos::Reliable(10)).await?;
        ros.declare_subscriber(wire::key(shared.robot.domain, &name, kind::TEXT, "*"))
            .allowed_origin(Locality::Remote)
            .callback(move |sample| {
                if let Ok(StringMsg { data }) = cdr::read(&sample.payload().to_bytes()) {
                    desk.clone().work(move |desk| async move {
                        if go { desk.send(&data).await } else { desk.tell(&data).await }
                    });
                }
            })
            .background()
            .await?;
    }
    let (name, told) = (speaker.named("/initialpose"), desk.clone());
    speaker.listens(&name, kind::POSE_WITH_COVARIANCE, Qos::Reliable(10)).await?;
    ros.declare_subscriber(wire::key(shared.robot.domain, &name, kind::POSE_WITH_COVARIANCE, "*"))
        .allowed_origin(Locality::Remote)
        .callback(move |sample| {
            if let Ok(pose) = cdr::read(&sample.payload().to_bytes()) {
                told.clone().work(move |desk| async move { desk.take_pose(&pose).await });
            }
        })
        .background()
        .await?;
    let (last, is) = (desk.clone(), desk);
    let answer = move |asked: Asked| {
        let asked = Arc::new(asked);
        let busy = TriggerResponse { success: false, message: BUSY.into() };
        last.clone()
            .work_or(asked.clone(), busy, move |desk| async move { asked.answer(&desk.last().await).await });
    };
    speaker.service(&speaker.named("/toponym/where"), kind::TRIGGER, answer).await?;
    let answer = move |asked: Asked| {
        let asked = Arc::new(asked);
        let busy = WhereResponse { message: BUSY.into(), p_none: 1.0, ..WhereResponse::default() };
        is.clone().work_or(asked.clone(), busy, move |desk| async move {
            let response = match asked.request::<WhereRequest>() {
                Ok(request) => desk.where_is(&request).await,
                Err(message) => WhereResponse { message, ..WhereResponse::default() },
            };
            asked.answer(&response).await
        });
    };
    speaker.service(&speaker.named("/toponym/where_is"), kind::WHERE, answer).await?;
    Ok(())
}

impl Desk {
    /// Answers beside what else is asked, unless that is too much: then false.
    fn work<F>(self: Arc<Self>, answer: impl FnOnce(Arc<Self>) -> F) -> bool
    where
        F: Future<Output = Result<(), String>> + Send + 'static,
    {
        let Ok(permit) = self.permits.clone().try_acquire_owned() else {
            warn!(robot = self.shared.robot.robot, "{BUSY}");
            return false;
        };
        let (runtime, answer) = (self.runtime.clone(), answer(self));
        runtime.spawn(async move {
            if let Err(why) = answer.await {
                warn!("a question could not be answered: {why}");
            }
            drop(permit);
        });
        true
    }

    /// The same for a service: one that is not answered waits for ever.
    fn work_or<F, T>(self: Arc<Self>, asked: Arc<Asked>, busy: T, answer: impl FnOnce(Arc<Self>) -> F)
    where
        F: Future<Output = Result<(), String>> + Send + 'static,
        T: serde::Serialize + Send + Sync + 'static,
    {
        let runtime = self.runtime.clone();
        if !self.work(answer) {
            runtime.spawn(async move { asked.answer(&busy).await });
        }
    }

    async fn ask(&self, name: &str) -> Result<WhereReply, ClientError> {
        if let Ok(mut asked_for) = self.shared.asked_for.lock() {
            *asked_for = Some(name.to_owned());
        }
        self.planner.where_is(name).await
    }

    /// Where to go for the likeliest; none where it is rather nowhere.
    fn pose(&self, reply: &WhereReply) -> Option<PoseStamped> {
        let best = reply.candidates.first().filter(|_| reply.is_found())?;
        let (x_m, y_m, yaw_rad) = match &best.goal {
            Some(goal) => (goal.x_m, goal.y_m, goal.yaw_rad),
            None => (best.x_m, best.y_m, best.yaw_rad),
        };
        Some(goal(&self.shared, &Pose { x_m, y_m, yaw_rad }))
    }

    /// To a question by topic: in words, and as a pose.
    async fn tell(&self, name: &str) -> Result<(), String> {
        let (data, pose) = match self.ask(name).await {
            Ok(reply) => (where_text(&reply), self.pose(&reply)),
            Err(e) => (e.to_string(), None),
        };
        self.answers.write(&StringMsg { data: data.trim_end().to_owned() }).await?;
        match pose {
            Some(pose) => self.answer_poses.write(&pose).await,
            None => Ok(()),
        }
    }

    /// Sends the robot there: the server tells the goal as it does for whoever asks it.
    async fn send(&self, name: &str) -> Result<(), String> {
        let data = match self.planner.go(name, None).await {
            Ok(sent) => sent.words,
            Err(e) => e.to_string(),
        };
        self.answers.write(&StringMsg { data }).await
    }

    /// Somebody points at where the robot is: evidence for the map.
    async fn take_pose(&self, told: &PoseWithCovarianceStamped) -> Result<(), String> {
        let (frame, own) = (told.header.frame_id.trim_start_matches('/'), &self.shared.robot.map_frame);
        let data = match pointed_at(&told.pose).filter(|_| frame == own) {
            Some(pose) => match self.planner.mend(&pose).await {
                Ok(mended) => mended.words,
                Err(e) => e.to_string(),
            },
            None => format!("a pose in {frame:?} says nothing here: give numbers in {own:?}"),
        };
        info!(robot = self.shared.robot.robot, "/initialpose: {data}");
        self.answers.write(&StringMsg { data }).await
    }

    /// To a question without words: where what was asked for last is, or else where the robot is.
    async fn last(&self) -> TriggerResponse {
        let asked_for = self.shared.asked_for.lock().ok().and_then(|name| name.clone());
        let Some(name) = asked_for else {
            return match self.planner.what(None).await {
                Ok(what) => {
                    let names: Vec<String> =
                        what.names.iter().map(|n| format!("{} ({:.2})", n.shown, n.p)).collect();
                    let named =
                        if names.is_empty() { "nobody told a name of it".into() } else { names.join(", ") };
                    let at = format!("x {:.2} m, y {:.2} m", what.x_m, what.y_m);
                    TriggerResponse {
                        success: !names.is_empty(),
                        message: format!("you are here: {named} ({at})"),
                    }
                }
                Err(e) => TriggerResponse { success: false, message: e.to_string() },
            };
        };
        match self.ask(&name).await {
            Ok(reply) => {
                let message = where_text(&reply).trim_end().to_owned();
                TriggerResponse { success: reply.is_found(), message }
            }
            Err(e) => TriggerResponse { success: false, message: e.to_string() },
        }
    }

    async fn where_is(&self, request: &WhereRequest) -> WhereResponse {
        // The question is about this robot's map, whoever asks.
        match self.ask(&request.name).await {
            Ok(reply) => WhereResponse {
                found: reply.is_found(),
                probability: reply.candidates.first().map_or(0.0, |best| best.probability),
                p_none: reply.p_none,
                pose: self.pose(&reply).unwrap_or_default(),
                message: where_text(&reply).trim_end().to_owned(),
            },
            Err(e) => WhereResponse { message: e.to_string(), p_none: 1.0, ..WhereResponse::default() },
        }
    }
}

/// A pose and how sure it is. What leaves that open is as sure as a hand on a picture of the map; none if it is no pose.
fn pointed_at(told: &PoseWithCovariance) -> Option<Mend> {
    let transform = Transform { translation: told.pose.position, rotation: told.pose.orientation };
    let sigma = |variance: f64, default: f64| if variance > 0.0 { variance.sqrt() } else { default };
    let (planar, heading) = (0.5 * (told.covariance[0][0] + told.covariance[1][1]), told.covariance[5][5]);
    Some(Mend::Pose {
        id: sentence("").id,
        map_from_body: on_floor(&isometry(&transform))?,
        sigma_m: sigma(planar, TOLD_SIGMA_M).clamp(0.05, 100.0),
        sigma_rad: sigma(heading, TOLD_SIGMA_RAD).clamp(0.02, 3.0),
    })
}
