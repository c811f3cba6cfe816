//! A robot's messages as they come, as toponym's: looked through until it is known what they are, then as a bag's.

use crate::bag::Topic;
use crate::plan::{Plan, Survey, kind};
use crate::stream::{Stream, Taken};
use std::collections::VecDeque;
use toponym::log::Options;
use toponym_proto::Message;

/// All lasers and transforms of a robot have been heard after so long by its stamps.
const LOOK_NS: i64 = 300_000_000;
/// What is not known after so long is supposed.
const LOOK_MAX_NS: i64 = 8_000_000_000;
/// Kept until it is known what they are, bytes.
const KEPT_MAX_BYTES: usize = 64 << 20;
/// So many messages in a row from before the newest, and the robot's clock began anew.
const BACK_MAX: u32 = 20;

/// What comes from one robot.
pub struct Feed {
    options: Options,
    survey: Survey,
    /// What came before it was known what it is.
    kept: VecDeque<(Topic, i64, Vec<u8>)>,
    kept_bytes: usize,
    first_ns: Option<i64>,
    stream: Option<(Plan, Stream)>,
    /// Where to look if there is no plan.
    problem: Option<String>,
}

/// What there is to send.
#[derive(Clone, Debug, PartialEq)]
pub enum Fed {
    /// From now on it is a stream of its own, as planned.
    Begins(Plan),
    /// The next message.
    Message(Message),
}

impl Feed {
    /// Of nothing yet; of these topics and all transforms, or of all.
    pub fn new(options: Options, wanted: &[String]) -> Self {
        Self {
            options,
            survey: Survey::new(wanted),
            kept: VecDeque::new(),
            kept_bytes: 0,
            first_ns: None,
            stream: None,
            problem: None,
        }
    }

    /// What is known so far.
    pub fn survey(&self) -> &Survey {
        &self.survey
    }

    /// Why there is no plan yet, if one was tried.
    pub fn problem(&self) -> Option<&str> {
        self.problem.as_deref()
    }

    /// Takes a message that was received at a time, nanoseconds; what is to be sent by that is added to `out`.
    ///
    /// # Errors
    /// What is wrong with it; nothing of it is taken then.
    pub fn take(
        &mut self,
        topic: &Topic,
        received_ns: i64,
        data: Vec<u8>,
        out: &mut Vec<Fed>,
    ) -> Result<(), String> {
        if self.stream.is_some() {
            return self.stream_on(topic, received_ns, &data, out);
        }
        self.survey.take(topic, &data)?;
        self.kept_bytes += data.len();
        self.kept.push_back((topic.clone(), received_ns, data));
        while self.kept_bytes > KEPT_MAX_BYTES
            && let Some((.., oldest)) = self.kept.pop_front()
        {
            self.kept_bytes -= oldest.len();
        }
        // Not from when nothing but the floor plan of its frames was there.
        if topic.kind != kind::SCAN && self.first_ns.is_none() {
            return Ok(());
        }
        let looked_ns = received_ns.saturating_sub(*self.first_ns.get_or_insert(received_ns));
        let is_looked_at = self.survey.scanned_ns() >= LOOK_NS && self.survey.is_complete();
        if is_looked_at || looked_ns >= LOOK_MAX_NS {
            self.begin(out);
        }
        Ok(())
    }

    fn begin(&mut self, out: &mut Vec<Fed>) {
        let plan = match self.survey.plan() {
            Ok(plan) => plan,
            Err(why) => {
                self.problem = Some(why);
                return;
            }
        };
        self.problem = None;
        self.open(plan, out);
        self.kept_bytes = 0;
        for (topic, received_ns, data) in std::mem::take(&mut self.kept) {
            // It was looked at before; what is wrong with it now is its stamp.
            let _ = self.stream_on(&topic, received_ns, &data, out);
        }
    }

    fn open(&mut self, plan: Plan, out: &mut Vec<Fed>) {
        out.push(Fed::Begins(plan.clone()));
        self.stream = Some((plan.clone(), Stream::new(plan, self.options.clone())));
    }

    fn stream_on(
        &mut self,
        topic: &Topic,
        received_ns: i64,
        data: &[u8],
        out: &mut Vec<Fed>,
    ) -> Result<(), String> {
        // What was not heard when it began may be now: how a laser is mounted, or another laser.
        let is_news = match topic.kind.as_str() {
            kind::TF => topic.name.ends_with("_static"),
            kind::SCAN => {
                self.stream.as_ref().is_some_and(|(plan, _)| !plan.lasers.contains_key(&topic.name))
            }
            _ => false,
        };
        if is_news {
            self.survey.take(topic, data)?;
            let old = self.stream.as_ref().map(|(plan, _)| plan);
            if let Some(plan) = self.survey.plan().ok().filter(|new| old.is_none_or(|old| !old.is_as(new))) {
                self.finish(out);
                self.open(plan, out);
            }
        }
        let Some((plan, stream)) = &mut self.stream else { return Ok(()) };
        let taken = stream.take(topic, received_ns, data);
        if stream.back() >= BACK_MAX {
            let plan = plan.clone();
            self.finish(out);
            self.open(plan, out);
        } else {
            out.extend(stream.said().into_iter().map(Fed::Message));
            out.extend(std::iter::from_fn(|| stream.pop()).map(Fed::Message));
        }
        taken.map(|_: Taken| ())
    }

    /// What is still waited for is not.
    pub fn finish(&mut self, out: &mut Vec<Fed>) {
        if let Some((_, stream)) = &mut self.stream {
            stream.finish();
            out.extend(std::iter::from_fn(|| stream.pop()).map(Fed::Message));
        }
    }

    /// The newest stamp of the robot's clock.
    pub fn newest_ns(&self) -> Option<i64> {
        self.stream.as_ref().map(|(_, stream)| stream.newest_ns()).filter(|&ns| ns != i64::MIN)
    }
}
