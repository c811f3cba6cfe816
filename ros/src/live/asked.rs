//! Questions in ROS's words: services, and topics for those who have no types of ours.

use super::broadcast::goal;
use super::mouth::{Asked, Speaker, Writer};
use super::{Failure, Shared};
use crate::cdr;
use crate::msg::{PoseStamped, StringMsg, TriggerResponse, WhereRequest, WhereResponse};
use crate::plan::kind;
use crate::wire::{self, Qos};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Handle;
use tokio::sync::Semaphore;
use toponym::told::{is_found, where_text};
use toponym::{ClientError, Planner};
use toponym_proto::Pose;
use toponym_proto::answer::WhereReply;
use tracing::warn;
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
    goals: Writer,
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
        goals: topic("/goal_pose", kind::POSE).await?,
    });
    for (name, go) in [("/toponym/ask", false), ("/toponym/go", true)] {
        let (name, desk) = (speaker.named(name), desk.clone());
        speaker.listens(&name, kind::TEXT, Qos::Reliable(10)).await?;
        ros.declare_subscriber(wire::key(shared.robot.domain, &name, kind::TEXT, "*"))
            .allowed_origin(Locality::Remote)
            .callback(move |sample| {
                if let Ok(StringMsg { data }) = cdr::read(&sample.payload().to_bytes()) {
                    desk.clone().work(move |desk| async move { desk.tell(&data, go).await });
                }
            })
            .background()
            .await?;
    }
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
        let best = reply.candidates.first().filter(|_| is_found(reply))?;
        let (x_m, y_m, yaw_rad) = match &best.goal {
            Some(goal) => (goal.x_m, goal.y_m, goal.yaw_rad),
            None => (best.x_m, best.y_m, best.yaw_rad),
        };
        Some(goal(&self.shared, &Pose { x_m, y_m, yaw_rad }))
    }

    /// To a question by topic: in words, as a pose, and, if asked to go, as a goal.
    async fn tell(&self, name: &str, go: bool) -> Result<(), String> {
        let (data, pose) = match self.ask(name).await {
            Ok(reply) => (where_text(&reply), self.pose(&reply)),
            Err(e) => (e.to_string(), None),
        };
        self.answers.write(&StringMsg { data: data.trim_end().to_owned() }).await?;
        let Some(pose) = pose else { return Ok(()) };
        self.answer_poses.write(&pose).await?;
        if go { self.goals.write(&pose).await } else { Ok(()) }
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
                TriggerResponse { success: is_found(&reply), message }
            }
            Err(e) => TriggerResponse { success: false, message: e.to_string() },
        }
    }

    async fn where_is(&self, request: &WhereRequest) -> WhereResponse {
        // The question is about this robot's map, whoever asks.
        match self.ask(&request.name).await {
            Ok(reply) => WhereResponse {
                found: is_found(&reply),
                probability: reply.candidates.first().map_or(0.0, |best| best.probability),
                p_none: reply.p_none,
                pose: self.pose(&reply).unwrap_or_default(),
                message: where_text(&reply).trim_end().to_owned(),
            },
            Err(e) => WhereResponse { message: e.to_string(), p_none: 1.0, ..WhereResponse::default() },
        }
    }
}
